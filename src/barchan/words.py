"""Words of users in messages: the nearest known name for a misspelt one, a value on one line, dimensions spelt as text."""

import re
from difflib import get_close_matches

from barchan.errors import SceneError

#: What dimensions are made of.
DIMENSIONS = ("length", "time", "mass", "force", "energy", "pressure", "temperature", "charge")

_POWER = r"(\^(-?\d+(\.\d+)?|\(-?\d+/\d+\)))?"
_PRODUCT = rf"(1|x{_POWER})([ *]x{_POWER})*"
_DIMENSION = re.compile(rf"{_PRODUCT}(/(x{_POWER}|\({_PRODUCT}\)))*")


def shown(value, most=80):
    """A value for a message: on one line, and no longer than ``most`` characters.

    >>> shown([1.5, "a b"]), shown("abcdef", most=6)
    ("[1.5, 'a b']", "'ab...")
    """
    try:
        text = " ".join(repr(value).split())
    except ValueError:  # a whole number of thousands of digits
        text = f"<{type(value).__name__}>"
    return text if len(text) <= most else text[: most - 3] + "..."


def nearest(name, known):
    """The end of a message about a name that nobody knows.

    >>> nearest("radus", ["radius", "mass"])
    "did you mean 'radius'?"
    >>> nearest("colour", ["radius", "mass"])
    'known are: radius, mass'
    """
    near = get_close_matches(str(name), [str(other) for other in known], n=1)
    return f"did you mean '{near[0]}'?" if near else f"known are: {', '.join(known)}"


def check_dimension(what, text):
    """Refuse what is no dimension, such as a misspelt one.

    Args:
        what: whose dimension it is, for the message.
        text: such as "force/length^2", "1/(length time)" or "1".

    Raises:
        SceneError: naming the word that is unknown, or the text.

    >>> check_dimension("stiffness", "force/length^(3/2)")
    >>> check_dimension("stiffness", "force/lenght")
    Traceback (most recent call last):
    barchan.errors.SceneError: stiffness: dimension 'force/lenght' has 'lenght' in it; did you mean 'length'?
    """
    if not isinstance(text, str):
        raise SceneError(f"{what}: its dimension {shown(text)} must be text, such as 'force/length^2', or '1' for a plain number")
    for word in re.findall(r"[^\W\d]\w*", text):
        if word not in DIMENSIONS:
            raise SceneError(f"{what}: dimension {shown(text)} has '{word}' in it; {nearest(word, DIMENSIONS)}")
    if not _DIMENSION.fullmatch(re.sub(r"[^\W\d]\w*", "x", text)):
        raise SceneError(
            f"{what}: dimension {shown(text)} cannot be read; write it like 'force/length^2', '1/(length time)' or '1'"
        )
