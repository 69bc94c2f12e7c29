"""What a check of the self-test found."""

from typing import NamedTuple


class Finding(NamedTuple):
    """What was measured, what is allowed, and whether that passed."""

    measured: str
    allowed: str
    passed: bool


def at_most(value, most, unit=""):
    """The finding that a number is no larger than ``most``; NaN is."""
    return Finding(f"{value:.2g}{unit}", f"<= {most:.2g}{unit}", bool(value <= most))
