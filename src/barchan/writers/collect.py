"""What is written, as arrays over all ranks: grains at the full step, contacts as lines."""

import numpy as np

from barchan.errors import SceneError
from barchan.measure import contact_table

#: Fields of a grain that are written as they are, besides the user's own; velocities are brought to the full step.
FIELDS = ("id", "position", "radius", "mass", "force", "material", "frozen", "image")


def grains_at_full_step(sim):
    """All grains in ascending order of id, all quantities at the full step n.

    The state holds velocities at n-1/2; half a kick brings them to n: v + dt/2 F/m, the values that energies are made of.

    Returns:
        Field name -> array (grains,) or (grains, width), on every rank: ``FIELDS``, ``velocity``, ``omega``, and the fields
        that the user added.

    Raises:
        SceneError: forces are not known, since the simulation was not prepared.
    """
    _require(sim.is_primed, sim)
    grains, half = sim.grains, 0.5 * sim.dt
    names = FIELDS + tuple(field.name for field in grains.table if field.block.startswith("user_"))
    columns = {name: grains.view(name) for name in names}
    columns["velocity"] = grains.view("velocity") + half * grains.view("force") * grains.view("inverse_mass")[:, None]
    columns["omega"] = grains.view("omega") + half * grains.view("torque") * grains.view("inverse_inertia")[:, None]
    return _gathered(sim, columns)


def contact_lines(sim):
    """Contacts that touch, each once, in ascending order of (first, second), as lines between what touches.

    A line begins at the centre of the first grain and ends at the centre of the second, at its image that touches, or at the
    wall: it never crosses the box.

    Returns:
        (points (k, 2, 3) [length], cell name -> array (k,) or (k, 3)): ``force`` on the first grain [force],
        ``normal_force`` its part along the normal, positive where it pushes [force], ``overlap`` [length], ``first``,
        ``second`` (ids; the negative key of a wall), on every rank.

    Raises:
        SceneError: contacts are not known, since the simulation was not prepared.
    """
    _require(sim.is_primed and sim.is_listed, sim)
    table = contact_table(sim)
    grains = _gathered(sim, {name: sim.grains.view(name) for name in ("id", "position")})
    at_wall = table["second"] < 0
    centre = grains["position"][np.searchsorted(grains["id"], table["first"])]
    other = grains["position"][np.searchsorted(grains["id"], np.where(at_wall, table["first"], table["second"]))]
    branch = np.where(at_wall[:, None], table["point"] - centre, sim.box.difference(other, centre))
    length = np.sqrt((branch**2).sum(axis=1))
    normal = -branch / np.where(length > 0.0, length, 1.0)[:, None]
    cells = {name: table[name] for name in ("first", "second", "overlap", "force")}
    cells["normal_force"] = (table["force"] * normal).sum(axis=1)
    return np.stack([centre, centre + branch], axis=1), cells


def _require(known, sim):
    if not known:
        raise SceneError(
            f"step {sim.step_number}: forces and contacts are not known yet, so they cannot be written; "
            f"call Simulation.prepare() first"
        )


def _gathered(sim, columns):
    """Columns of the owned grains joined over all ranks, in ascending order of id."""
    parts = sim.comm.all_gather({name: column.copy() for name, column in columns.items()})
    joined = {name: np.concatenate([part[name] for part in parts]) for name in columns}
    order = np.argsort(joined["id"], kind="stable")
    return {name: column[order] for name, column in joined.items()}
