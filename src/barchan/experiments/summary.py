"""What a run has shown, from its directory: printed at its end, and again by ``barchan show``."""

from barchan import atomic, record
from barchan.errors import OutputError, ResultError
from barchan.report import table


def show(experiment, scene, directory, journal):
    """Tell the results and draw the figures of the run in ``directory``."""
    try:
        results = experiment.results(scene, directory)
        text = lines(experiment, results, directory)
        for line in text:
            journal.say(line)
        with atomic.writing(directory / "summary.txt") as partial:
            partial.write_text("\n".join(text) + "\n")
        journal.say("drawing figures ...", passing=True)
        for path in experiment.figures(scene, directory):
            journal.say(f"figure {path}")
    except KeyError as name:
        raise ResultError(f"the tables in {directory} have no column {name}; they are damaged, or of another version") from None
    except OSError as error:
        raise OutputError(
            f"{error.filename or directory} cannot be written: {error.strerror}; the run itself is complete"
        ) from None


def lines(experiment, results, directory):
    """The summary as lines of text."""
    text = [experiment.title, "results:", *table(results.values)]
    if results.differs:
        text += ["differs from the paper, as simulated:", *table([("parameter", "here", "paper"), *results.differs])]
    text += ["where the time went:", *(f"  {line}" for line in record.lines(directory / "record.json"))]
    text += [
        "checks:",
        *table([("passed" if c.passed else "FAILED", c.name, c.measured, f"allowed: {c.allowed}") for c in results.checks]),
    ]
    return text
