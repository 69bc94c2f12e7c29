"""The standard normal distribution, exact to rounding in its tails, too."""

from math import erfc, sqrt

import numpy as np

# Numerators and denominators of Wichura's rational functions, highest power first: in the middle, near and far in the tails.
_MIDDLE = (
    (
        2.5090809287301226727e3,
        3.3430575583588128105e4,
        6.7265770927008700853e4,
        4.5921953931549871457e4,
        1.3731693765509461125e4,
        1.9715909503065514427e3,
        1.3314166789178437745e2,
        3.3871328727963666080e0,
    ),
    (
        5.2264952788528545610e3,
        2.8729085735721942674e4,
        3.9307895800092710610e4,
        2.1213794301586595867e4,
        5.3941960214247511077e3,
        6.8718700749205790830e2,
        4.2313330701600911252e1,
        1.0,
    ),
)
_NEAR = (
    (
        7.74545014278341407640e-4,
        2.27238449892691845833e-2,
        2.41780725177450611770e-1,
        1.27045825245236838258e0,
        3.64784832476320460504e0,
        5.76949722146069140550e0,
        4.63033784615654529590e0,
        1.42343711074968357734e0,
    ),
    (
        1.05075007164441684324e-9,
        5.47593808499534494600e-4,
        1.51986665636164571966e-2,
        1.48103976427480074590e-1,
        6.89767334985100004550e-1,
        1.67638483018380384940e0,
        2.05319162663775882187e0,
        1.0,
    ),
)
_FAR = (
    (
        2.01033439929228813265e-7,
        2.71155556874348757815e-5,
        1.24266094738807843860e-3,
        2.65321895265761230930e-2,
        2.96560571828504891230e-1,
        1.78482653991729133580e0,
        5.46378491116411436990e0,
        6.65790464350110377720e0,
    ),
    (
        2.04426310338993978564e-15,
        1.42151175831644588870e-7,
        1.84631831751005468180e-5,
        7.86869131145613259100e-4,
        1.48753612908506148525e-2,
        1.36929880922735805310e-1,
        5.99832206555887937690e-1,
        1.0,
    ),
)


def below(z):
    """Share of the standard normal distribution below ``z``, with all digits where it is small; that above is ``below(-z)``.

    >>> round(below(-1.0), 6), f"{below(-30.0):.9e}"
    (0.158655, '4.906713927e-198')
    """
    return 0.5 * erfc(-z / sqrt(2.0))


def between(low, high):
    """Share of the standard normal distribution between two numbers, ``low < high``.

    >>> round(between(-1.0, 1.0), 6), between(30.0, 40.0) == below(-30.0)
    (0.682689, True)
    """
    if low > 0.0:  # shares above have the digits there
        low, high = -high, -low
    return below(high) - below(low)


def quantile(below, above):
    """Numbers below and above which given shares of the standard normal distribution lie.

    Both are given, since the smaller one has the digits. Source: Wichura, Algorithm AS 241, Applied Statistics 37, 477 (1988);
    relative error about 1e-16 as far as shares of 1e-308.

    Args:
        below: (k,) shares from 0 to 1 [1].
        above: (k,) ``1 - below`` [1].

    Returns:
        (k,); where a share is 0 the quantile of the smallest one that a double can hold, about 37.5 from the middle.

    >>> quantile(np.array([0.5, 0.975, 1.0]), np.array([0.5, 0.025, 1e-20])).round(6).tolist()
    [0.0, 1.959964, 9.26234]
    """
    small, z = np.minimum(below, above), np.empty(len(below))
    off, tail = np.copysign(0.5 - small, below - above), np.sqrt(-np.log(np.maximum(small, np.finfo(float).tiny)))
    middle, far = np.abs(off) <= 0.425, tail > 5.0
    near = ~(middle | far)
    z[middle] = off[middle] * _ratio(_MIDDLE, 0.180625 - off[middle] ** 2)
    z[near] = np.copysign(_ratio(_NEAR, tail[near] - 1.6), off[near])
    z[far] = np.copysign(_ratio(_FAR, tail[far] - 5.0), off[far])
    return z


def _ratio(polynomials, x):
    over, under = polynomials
    return np.polyval(over, x) / np.polyval(under, x)
