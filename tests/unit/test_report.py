"""What a person is told: the progress line, the journal, and the record of a run's sittings."""

import io
import json
from types import SimpleNamespace

import pytest
from rich.console import Console

from barchan import record
from barchan.report import Journal, ProgressLine

PHASES = [("equilibrate", 1000), ("flow", 3000)]


@pytest.fixture
def time(monkeypatch):
    """A clock that stands still until it is moved."""
    now = SimpleNamespace(seconds=0.0)
    monkeypatch.setattr("barchan.report.time.monotonic", lambda: now.seconds)
    return now


def at(step):
    return SimpleNamespace(step_number=step, time=step * 1e-4, comm=SimpleNamespace(rank=0), grains=SimpleNamespace(n=500))


def shown(line, sim):
    """What the line prints at a step, if it is due."""
    stream = line.journal.console.file
    before = len(stream.getvalue())
    if line.due(sim.step_number):
        line.write(sim)
    return stream.getvalue()[before:]


def test_a_plain_line_tells_phase_share_step_time_speeds_and_time_left(time):
    line = ProgressLine(PHASES, 200, Journal(stream=io.StringIO()))
    time.seconds = 4.0
    assert shown(line, at(320)) == "", "not before five seconds"
    time.seconds = 8.0
    text = shown(line, at(1008))
    assert text == "flow:  34 %  0:19 left  step 1,008/3,000  t = 0.1008 s  101 steps/s  5.05e+04 grain-steps/s\n"
    assert shown(line, at(1024)) == "", "not again at once"
    assert "flow: 100 %  0:00 left  step 3,000/3,000" in shown(line, at(3000)), "the last step always"


def test_long_runs_print_fewer_lines(time):
    line = ProgressLine(PHASES, 0, Journal(stream=io.StringIO()))
    time.seconds = 1000.0
    assert "equilibrate" in shown(line, at(16))
    time.seconds += 30.0
    assert shown(line, at(32)) == ""
    time.seconds += 25.0
    assert "equilibrate" in shown(line, at(48)), "a twentieth of the time that has passed"


def test_on_a_terminal_the_line_is_drawn_in_place_and_logged_now_and_then(time, tmp_path):
    journal = Journal(tmp_path / "log.txt", stream=io.StringIO())
    journal.console = Console(file=journal.console.file, force_terminal=True, width=160)
    line = ProgressLine(PHASES, 0, journal)
    time.seconds = 0.5
    line.write(at(160))
    assert (tmp_path / "log.txt").read_text() == ""
    time.seconds = 70.0
    line.write(at(1600))
    line.close()
    assert "flow:  53 %" in journal.console.file.getvalue() and "step 1,600/3,000" in journal.console.file.getvalue()
    assert "flow:  53 %" in (tmp_path / "log.txt").read_text()


def test_only_the_first_rank_speaks(time):
    line = ProgressLine(PHASES, 0, Journal(stream=io.StringIO()))
    sim = at(3000)
    sim.comm.rank = 1
    assert shown(line, sim) == ""


def sitting(first, last, seconds, **changes):
    plain = {
        "threads": 2,
        "first_step": first,
        "last_step": last,
        "seconds": seconds,
        "stages": {"flow": seconds},
        "work": {"forces": 0.5 * seconds},
        "rebuilds": 10,
        "steps_between_rebuilds": 10 * (last - first) // 20,
        "shortest_interval": 7,
        "bound_13": 6.25,
    }
    return record.Account(**plain | changes)


def test_sittings_of_a_resumed_run_add_up(tmp_path):
    path = tmp_path / "record.json"
    record.add(path, sitting(0, 1000, 30.0))
    record.add(path, sitting(1000, 3000, 10.0, shortest_interval=None, bound_13=None, rebuilds=0, steps_between_rebuilds=0))
    text = "\n".join(record.lines(path))
    assert "3,000 steps in 40.0 s on 2 thread(s), 2 sitting(s)" in text
    assert "forces 20.0 s (50 %)" in text
    assert "10 rebuilds, every 50.0 steps on average, shortest 7; equation (13) allows 6.2 steps" in text


@pytest.mark.parametrize("content", [b"", b"{", b"[1]", b'{"sittings": 3}', b"\xff", b'{"sittings": [{"seconds": "x"}]}'])
def test_a_damaged_record_counts_as_none(tmp_path, content):
    path = tmp_path / "record.json"
    path.write_bytes(content)
    assert record.lines(path) == ["no record of how this run went"]
    record.add(path, sitting(0, 1, 1.0))
    assert len(json.loads(path.read_text())["sittings"]) == 1


def test_a_narrow_terminal_cuts_the_end_of_the_line_only(time):
    journal = Journal(stream=io.StringIO())
    journal.console = Console(file=journal.console.file, force_terminal=True, width=40)
    line = ProgressLine(PHASES, 0, journal)
    time.seconds = 8.0
    line.write(at(1600))
    line.close()
    assert "flow:  53 %  0:07 left" in journal.console.file.getvalue()
