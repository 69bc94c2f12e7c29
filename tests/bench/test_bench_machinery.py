"""The machinery of a benchmark, with codes that compute nothing: turns, arithmetic, and codes that die, hang or lie."""

import io
import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from barchan.bench import benchmark, comparison, results
from barchan.bench.cases import small
from barchan.bench.peers.peer import Peer
from barchan.bench.process import Code, family
from barchan.errors import RunError, SceneError
from barchan.report import Journal

FAKE = Path(__file__).with_name("fake_code.py")


#: All that a code finds of barchan.
ALONE = {"PYTHONPATH": str(Path(comparison.__file__).parent)}


def fake(name, mischief="none", pace=1e-4):
    return Peer(name, (sys.executable, str(FAKE), mischief, str(pace)), ALONE)


@pytest.fixture
def case():
    return small(None)._replace(steps=50, scan_steps=50, rounds=3, skins=(0.05, 0.1, 0.2))


def quiet():
    return Journal(stream=io.StringIO())


def alive(pid):
    try:
        return "Z" not in Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False


def test_ratios_are_of_pairs_and_others_may_fail_in_any_way(case):
    """A code that fails, at the start or first in its turn, is a row with its reason; no process stays."""
    journal = quiet()
    peers = [fake("ours"), fake("double", pace=2e-4), Peer("absent", missing="not installed"), fake("other", "other")]
    peers.append(Peer("no program", ("/no/such/program",)))
    peers += [fake(mischief, mischief) for mischief in ("nan", "hang", "raise", "die")]
    entries, steps = comparison.compare(case, peers, journal, timeout=3.0)
    assert steps == 50
    rows = {row["peer"]: row for row in (results.row(entry, entries[0], case) for entry in entries)}
    assert [entry.reason for entry in entries[:4]] == [None, None, "not installed", None]
    assert "status 7" in rows["die"]["reason"] and "no more grains" in rows["raise"]["reason"]
    assert "nowhere" in rows["nan"]["reason"]
    assert "no answer" in rows["hang"]["reason"] and "/no/such/program" in rows["no program"]["reason"]
    assert rows["double"]["ratio_median"] == pytest.approx(2.0) and rows["ours"]["ratio_max"] == 1.0
    assert rows["double"]["same_work"] and not rows["other"]["same_work"]
    assert rows["ours"]["skin"] == 0.1 and not rows["ours"]["skin_at_border"]
    assert rows["ours"]["seconds"] == pytest.approx(1e-4) and rows["ours"]["rebuilds"] == 10
    assert rows["ours"]["grain_steps_per_second"] == pytest.approx(100 / 1e-4)
    assert "best 0.1" in journal.console.file.getvalue()
    assert all(entry.code is None or not alive(entry.code._process.pid) for entry in entries)


def test_median_and_range_of_uneven_rounds(case):
    ours, theirs = (comparison.Entry(fake(name)) for name in ("a", "b"))
    ours.timings, theirs.timings = [(1.0, 9), (2.0, 8), (1.0, 7)], [(2.0, 9), (2.0, 6), (5.0, 9)]
    for entry in (ours, theirs):
        entry.skin = entry.contacts = entry.energy = 1.0
    row = results.row(theirs, ours, case)
    assert (row["ratio_median"], row["ratio_min"], row["ratio_max"], row["rebuilds"]) == (2.0, 1.0, 5.0, 6)
    assert row["seconds"] == 2.0 and row["memory_per_grain"] is None


def test_turns_alternate(case, monkeypatch):
    """A B, B A, A B: what drifts while a round lasts, such as the clock of a warming processor, favours none."""
    turns = []
    act = comparison.Entry.time
    monkeypatch.setattr(comparison.Entry, "time", lambda entry, *args: (turns.append(entry.peer.name), act(entry, *args)))
    comparison.compare(case, [fake("A"), fake("B")], quiet())
    assert "".join(turns) == "ABBAAB"


def test_without_ours_there_is_no_benchmark(case):
    with pytest.raises(RunError, match="ours: died with status 7"):
        comparison.compare(case, [fake("ours", "die"), fake("other")], quiet())


def test_steps_are_raised_until_every_timing_holds_enough_rebuilds(case):
    """A code that rebuilds every 50 steps needs 6 x 50: by its scan, or by doubling where that shows nothing."""
    assert comparison.compare(case, [fake("ours"), fake("lazy", "lazy")], quiet())[1] == 300
    entries, steps = comparison.compare(case._replace(scan_steps=40), [fake("ours"), fake("lazy", "lazy")], quiet())
    assert steps == 50 * 2**3 and entries[1].timings[0][1] == 8


def test_a_rebuild_is_what_forced_steps_cost_more(case):
    case = case._replace(forced=True, steps=4, skins=(0.1,))
    entries, steps = comparison.compare(case, [fake("ours")], quiet())
    assert steps == 4
    assert entries[0].timings == [(pytest.approx(1e-4), 4)] * 3


def test_a_code_that_rebuilds_on_its_own_cannot_show_what_a_rebuild_costs(case):
    with pytest.raises(RunError, match="2 in others"):
        comparison.compare(case._replace(forced=True, steps=10, skins=(0.1,)), [fake("ours")], quiet())


def test_memory_counts_children_and_closing_ends_them(case, tmp_path):
    """As with mpiexec: the code is a child of what was started, in a session of its own."""
    case.save(tmp_path)
    program = f"import subprocess, sys; subprocess.run([*{fake('x').command!r}, sys.argv[1]], start_new_session=True)"
    code = Code(Peer("parent", (sys.executable, "-c", program), ALONE), tmp_path)
    code.ask("start")
    pids = family(code._process.pid)
    assert len(pids) == 2 and code.resident() > 30e6
    code.close(politely=False)
    time.sleep(0.1)
    assert not any(alive(pid) for pid in pids)


def test_a_driver_ends_when_the_benchmark_is_killed(case, tmp_path):
    case.save(tmp_path)
    program = (
        "import sys, time; from pathlib import Path; from barchan.bench.process import Code; "
        "from barchan.bench.peers.peer import Peer; "
        f"code = Code(Peer{tuple(fake('x'))!r}, {str(tmp_path)!r}); code.ask('start'); "
        "print(code._process.pid, flush=True); time.sleep(60)"
    )
    asker = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
    driver = int(asker.stdout.readline())
    assert alive(driver)
    asker.kill()
    asker.wait()
    began = time.monotonic()
    while alive(driver) and time.monotonic() - began < 10.0:
        time.sleep(0.02)
    assert not alive(driver)
    asker.stdout.close()


@pytest.mark.parametrize(
    ("name", "message"),
    [("x.png", "must end in .json"), (".", "must end in .json"), ("d.json", "is a directory"), ("f/x.json", "cannot be written")],
)
def test_a_file_that_cannot_hold_the_result_is_refused_before_the_measurement(name, message, tmp_path):
    (tmp_path / "d.json").mkdir()
    (tmp_path / "f").write_text("")
    with pytest.raises(SceneError, match=message):
        results.check_path(tmp_path / name)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["d.json", "f"]


def test_the_result_is_json_in_the_agreed_form_with_a_table_and_a_figure(case, tmp_path):
    peers = [fake("ours"), fake("slow", pace=3e-4), Peer("absent", missing="not installed (say why)")]
    result = benchmark.measure(case, peers, quiet())
    results.check_path(tmp_path / "new" / "x.json")
    assert not (tmp_path / "new").exists()
    [picture] = results.write(result, tmp_path / "new" / "x.json")
    assert picture == tmp_path / "new" / "x.png" and picture.read_bytes()[1:4] == b"PNG"
    read = json.loads((tmp_path / "new" / "x.json").read_text())
    assert read == result
    assert {"cpu", "cores", "versions"} <= set(read["machine"])
    wanted = {"peer", "ratio_median", "ratio_min", "ratio_max", "skin", "rebuilds", "grain_steps_per_second"}
    assert wanted | {"contacts_per_grain", "memory_per_grain", "same_work"} <= set(read["rows"][1])
    assert read["rows"][2] == {"peer": "absent", "reason": "not installed (say why)"}
    assert np.median(read["rows"][1]["seconds_each"]) == read["rows"][1]["seconds"]
    text = "\n".join(results.lines(result))
    assert "not quiet" not in text
    result["rows"][1]["ratio_max"] = 1.5 * result["rows"][1]["ratio_min"]
    assert "the machine was not quiet: ratios of slow differ by more than 40%" in results.lines(result)[-1]
    for word in ("slow", "3.00 (3.00-3.00)", "absent", "not run: not installed (say why)", "first start"):
        assert word in text


@pytest.mark.parametrize("ends", [[(0.2,)], [(0.2,), (0.3,), (0.2, 0.3)]])
def test_a_code_that_is_told_tries_each_division_and_keeps_the_best(case, ends, tmp_path):
    peers = [fake("ours"), fake("classes")._replace(told=True), fake("cells")._replace(told=True, cells=True, ranks=2)]
    case = case._replace(ends=tuple(ends), cells=(0.5, 1.0, 2.0), forced=True, skins=(0.1,), steps=4, scan_steps=4)
    result = benchmark.measure(case, peers, quiet())
    ours, classes, cells = result["rows"]
    assert "divisions" not in ours and "ghosts" not in ours and cells["ghosts"] == 17
    assert [(one["ends"], one["cells"]) for one in classes["divisions"]] == [(end, None) for end in ends]
    assert len(cells["divisions"]) == 3 * len(ends) and all(len(one["seconds"]) == 2 for one in cells["divisions"])
    assert cells["division"] == f"classes to {0.3 if len(ends) > 1 else 0.2}, cells 1"
    assert cells["ratio_median"] == pytest.approx(1.0 if len(ends) > 1 else 1.1)
    pictures = results.write(result, tmp_path / "x.json")
    assert [picture.name for picture in pictures] == ["x.png", "x-divisions.png"]
    text = "\n".join(results.lines(result))
    assert f"searched in {cells['division']}" in text and "17 ghosts on the first rank" in text


def test_the_first_start_finds_nothing_compiled_and_the_second_all(case):
    first, second = benchmark.start_times(case, fake("ours", "compile"), quiet())
    assert first > 1.0 and 0.0 < second < first - 0.5


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_command_and_its_codes(tmp_path, number):
    command = subprocess.Popen(
        [sys.executable, "-m", "barchan", "bench", "small"], cwd=tmp_path, stderr=subprocess.PIPE, text=True
    )
    assert "timing the first start" in command.stderr.readline()
    while len(family(command.pid)) < 2:
        time.sleep(0.02)
    codes = family(command.pid)[1:]
    command.send_signal(number)
    text = command.communicate(timeout=20)[1]
    assert command.returncode == 130 and "interrupted" in text and "Traceback" not in text
    assert not any(alive(pid) for pid in codes) and not list(tmp_path.iterdir())


def test_a_case_survives_its_file(case, tmp_path):
    case.save(tmp_path)
    again = type(case).load(tmp_path)
    assert again._replace(grains=None) == case._replace(grains=None)
    assert all(np.array_equal(a, b) for a, b in zip(again.grains, case.grains))
