"""What a run has shown, from its directory: printed at its end, and again by ``barchan show``."""

from barchan import atomic, record
from barchan.report import table


def show(experiment, scene, directory, journal):
    """Tell the results and draw the figures of the run in ``directory``; returns True if all its checks passed."""
    results = experiment.results(scene, directory)
    text = lines(experiment, results, directory)
    with atomic.writing(directory / "summary.txt") as partial:
        partial.write_text("\n".join(text) + "\n")
    for line in text:
        journal.say(line)
    journal.say("drawing figures ...", passing=True)
    for path in experiment.figures(scene, directory):
        journal.say(f"figure {path}")
    return all(check.passed for check in results.checks)


def lines(experiment, results, directory):
    """The summary as lines of text."""
    text = [experiment.title, "results:", *table(results.values)]
    if results.differs:
        text += ["differs from the paper:", *table([("parameter", "here", "paper"), *results.differs])]
    text += ["where the time went:", *(f"  {line}" for line in record.lines(directory / "record.json"))]
    text += [
        "checks:",
        *table([("passed" if c.passed else "FAILED", c.name, c.measured, f"allowed: {c.allowed}") for c in results.checks]),
    ]
    return text
