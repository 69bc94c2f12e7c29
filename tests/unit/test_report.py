"""What a person is told: the progress line, the journal, and the record of a run's sittings."""

import io
import json
from pathlib import Path
from types import SimpleNamespace

import pytest
from rich.console import Console
from scenes import simulation

import barchan as bc
from barchan import record
from barchan.experiments import summary
from barchan.experiments.experiment import Check, Results
from barchan.parallel import virtual_ranks
from barchan.report import Journal, ProgressLine

PHASES = [("equilibrate", 1000), ("flow", 3000)]


@pytest.fixture
def time(monkeypatch):
    """A clock that stands still until it is moved."""
    now = SimpleNamespace(seconds=0.0)
    monkeypatch.setattr("barchan.report.time.monotonic", lambda: now.seconds)
    return now


def at(step):
    return SimpleNamespace(
        step_number=step, time=step * 1e-4, comm=SimpleNamespace(rank=0, size=1), grains=SimpleNamespace(n=500)
    )


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
    time.seconds = 100_000.0
    assert "equilibrate" in shown(line, at(64))
    time.seconds += 61.0
    assert "equilibrate" in shown(line, at(80)), "but at least one a minute"


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


def test_on_a_terminal_the_log_gets_a_line_a_minute(time, tmp_path):
    journal = Journal(tmp_path / "log.txt", stream=io.StringIO())
    journal.console = Console(file=journal.console.file, force_terminal=True, width=160)
    line = ProgressLine(PHASES, 0, journal)
    logged = []
    for time.seconds in (30.0, 70.0, 71.0, 125.0, 135.0):
        line.write(at(160))
        logged.append(len((tmp_path / "log.txt").read_text().splitlines()))
    line.close()
    assert logged == [0, 1, 1, 1, 2]


def test_a_phase_ends_with_its_last_step(time):
    line = ProgressLine(PHASES, 0, Journal(stream=io.StringIO()))
    for step, phase in ((999, "equilibrate"), (1000, "equilibrate"), (1001, "flow"), (3000, "flow")):
        line.write(at(step))
        assert line.journal.console.file.getvalue().splitlines()[-1].startswith(f"{phase}:")


def test_speed_and_time_left_are_those_of_the_last_seconds(time):
    """1,000 steps in the first 100 s, then 100 in 1 s: 100 steps/s, not 1,100/101, and 1,900 steps are left."""
    line = ProgressLine(PHASES, 0, Journal(stream=io.StringIO()))
    time.seconds = 100.0
    line.write(at(1000))
    time.seconds = 101.0
    line.write(at(1100))
    last = line.journal.console.file.getvalue().splitlines()[-1]
    assert "0:19 left" in last and "  100 steps/s" in last


def test_a_line_is_on_its_way_to_the_user_at_once(tmp_path):
    """A pipe or a file has a buffer; nobody wants to wait until it is full."""
    with open(tmp_path / "told.txt", "w") as stream:
        Journal(stream=stream).say("starting")
        assert (tmp_path / "told.txt").read_text() == "starting\n"


def test_a_resumed_run_adds_to_the_log(tmp_path):
    for text in ("first sitting", "second sitting"):
        journal = Journal(tmp_path / "log.txt", stream=io.StringIO())
        journal.say(text)
        journal.close()
    kept = [line.split("  ")[1] for line in (tmp_path / "log.txt").read_text().splitlines()]
    assert kept == ["first sitting", "second sitting"]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="only Linux has it")
def test_a_log_that_cannot_be_written_is_told_once_and_ends_no_run():
    """/dev/full refuses every byte, as a full disk does."""
    journal = Journal("/dev/full", stream=io.StringIO())
    journal.say("one")
    journal.say("two")
    told = journal.console.file.getvalue().splitlines()
    assert told == ["one", "warning: the log ends here, it cannot be written: No space left on device", "two"]


def test_a_reader_that_goes_away_is_let_go():
    class Closed(io.StringIO):
        def write(self, text):
            raise BrokenPipeError

    journal = Journal(stream=Closed())
    journal.say("one")
    journal.say("two")
    assert journal.console.file.getvalue() == "two\n", "from now on it is kept where nobody reads"


def test_on_a_terminal_a_passing_line_gives_way_to_the_next():
    journal = Journal(stream=io.StringIO())
    journal.console = Console(file=journal.console.file, force_terminal=True, highlight=False, width=80)
    journal.say("compiling ...", passing=True)
    journal.say("compiled")
    journal.say("starting")
    assert journal.console.file.getvalue() == "compiling ...\r\x1b[Kcompiled\nstarting\n"


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
    record.add(path, sitting(3000, 4000, 60.0, threads=1, shortest_interval=5, bound_13=4.5, steps_between_rebuilds=300))
    text = "\n".join(record.lines(path))
    assert "4,000 steps in 100.0 s on 1 thread(s), 3 sitting(s)" in text
    assert "20 rebuilds, every 40.0 steps on average, shortest 5; equation (13) allows 4.5 steps" in text
    assert "size classes" not in text, "of a run that told of none"
    record.add(path, sitting(4000, 5000, 60.0, processes=4))
    assert "5,000 steps in 160.0 s on 4 processes of 2 thread(s), 4 sitting(s)" in "\n".join(record.lines(path))


def test_a_run_tells_of_the_size_classes_of_its_last_sitting(tmp_path):
    path, sim = tmp_path / "record.json", simulation(bc.Box((0, 0, 0), (9, 9, 9)))
    sim.add_grains([[3.0, 3.0, 3.0], [6.0, 6.0, 6.0]], [0.5, 1.0])
    sim.prepare()
    record.add(path, sitting(0, 1000, 30.0, size_classes="2 (chosen)"))
    record.add(path, record.Sitting(sim).account(sim))
    told = record.lines(path)[-1]
    assert told.startswith("size classes: 1 (chosen): up to radius 1: 2 grains, ") and "a search takes one core" in told


def test_the_summary_tells_checks_that_passed_from_those_that_failed(tmp_path):
    checks = [Check("at rest", "1e-5", "1e-3", True), Check("lost grains", "4", "0", False)]
    text = summary.lines(SimpleNamespace(title="sand"), Results([("front", "2 m")], [("dt", "2 s", "1 s")], checks), tmp_path)
    assert text[:3] == ["sand", "results:", "  front  2 m"]
    assert text[3:6] == ["differs from the paper, as simulated:", "  parameter  here  paper", "  dt         2 s   1 s"]
    assert text[-2:] == ["  passed  at rest      1e-5  allowed: 1e-3", "  FAILED  lost grains  4     allowed: 0"]


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


def test_a_sitting_counts_what_all_ranks_found():
    def program():
        sim = simulation()
        sim.faults.large_overlaps = 2 + sim.comm.rank
        sitting = record.Sitting(sim)
        sitting.count(sim)
        account = sitting.account(sim)
        return account.large_overlaps, account.processes

    assert virtual_ranks(2, program) == [(5, 2), (5, 2)]
