"""How far a column of grains runs out, and how high its deposit is, as published of experiments.

Lube, Huppert, Sparks & Hallworth (2004, J. Fluid Mech. 508, 175), for a = h_0 / r_0, height of a round column over its radius:
(r_inf - r_0) / r_0 = 1.24 a for a < 1.7 and 1.6 sqrt(a) beyond; h_inf / r_0 = a for a < 1 and 0.88 a^(1/6) for a > 1.7; over
after about 3 sqrt(h_0 / g). Lajeunesse, Mangeney-Castelnau & Vilotte (2004, Phys. Fluids 16, 2371): h_inf / r_0 = 0.74 for
a > 0.74.
"""

import numpy as np

#: Aspect ratio at which the run-out of Lube et al. begins to follow its square root.
TALL = 1.7

#: Height of the deposit over r_0 by Lajeunesse et al., of columns whose aspect ratio exceeds it.
SATURATED = 0.74


def run_out(aspect):
    """(r_inf - r_0) / r_0 by Lube et al."""
    aspect = np.asarray(aspect, dtype=float)
    return np.where(aspect < TALL, 1.24 * aspect, 1.6 * np.sqrt(aspect))


def height(aspect):
    """h_inf / r_0 by Lube et al.; between a = 1 and 1.7 they give no law, and the value is interpolated."""
    aspect = np.asarray(aspect, dtype=float)
    between = np.interp(aspect, (1.0, TALL), (1.0, 0.88 * TALL ** (1.0 / 6.0)))
    return np.where(aspect < 1.0, aspect, np.where(aspect > TALL, 0.88 * aspect ** (1.0 / 6.0), between))


def saturated_height(aspect):
    """h_inf / r_0 by Lajeunesse et al."""
    return np.minimum(np.asarray(aspect, dtype=float), SATURATED)
