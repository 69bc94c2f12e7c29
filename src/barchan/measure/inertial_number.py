"""How fast a sheared sample is rearranged."""

import numpy as np

from barchan.domain import numbers
from barchan.errors import SceneError


def inertial_number(shear_rate, pressure, diameter, density):
    """I = shear rate times d sqrt(rho / p): the time in which pressure moves a grain by its diameter, over that of the shear.

    Numbers, or arrays that go together. Below about 1e-3 flow is quasi-static. Source: GDR MiDi, Eur. Phys. J. E 14, 341 (2004).

    Args:
        shear_rate: of either sign [1/time].
        pressure: [force/length^2].
        diameter: mean, of the grains [length].
        density: of the grains, not of the bulk [mass/length^3].

    Raises:
        SceneError: a value is no finite number, or pressure, diameter or density is not positive.

    >>> inertial_number(2.0, pressure=100.0, diameter=0.001, density=2500.0)
    0.01
    """
    given = {
        "shear_rate": numbers("inertial_number: shear_rate", shear_rate, "1/time"),
        "pressure": numbers("inertial_number: pressure", pressure, "force/length^2"),
        "diameter": numbers("inertial_number: diameter", diameter, "length"),
        "density": numbers("inertial_number: density", density, "mass/length^3"),
    }
    for name, value in given.items():
        if not np.isfinite(value).all() or (name != "shear_rate" and (value <= 0.0).any()):
            raise SceneError(f"inertial_number: {name} = {value.tolist()!r} must be finite{' and > 0' * (name != 'shear_rate')}")
    found = np.abs(given["shear_rate"]) * given["diameter"] * np.sqrt(given["density"] / given["pressure"])
    return float(found) if found.ndim == 0 else found
