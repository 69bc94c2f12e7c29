"""What is written, as arrays in the order of ids, of which each rank has a part: grains at the full step, contacts as lines;
and meshes as triangles, of which each has all."""

import numpy as np

from barchan.errors import SceneError
from barchan.measure import contact_table, triangle_forces, triangle_torques
from barchan.parallel.mapping import Mapping, by_rank
from barchan.parallel.regroup import ById

#: Fields of a grain that are written as they are, besides the user's own; velocities are brought to the full step.
FIELDS = ("id", "position", "radius", "mass", "force", "material", "frozen", "image")


def grains_at_full_step(sim):
    """All grains in ascending order of id, all quantities at the full step n.

    The state holds velocities at n-1/2; half a kick brings them to n: v + dt/2 F/m, the values that energies are made of.

    Returns:
        Field name -> array (grains,) or (grains, width): ``FIELDS``, ``velocity``, ``omega``, and the fields that the user added;
        of several ranks each has a range of ids.

    Raises:
        SceneError: forces are not known, since the simulation was not prepared.
    """
    _require(sim.is_primed, sim)
    grains, half = sim.grains, 0.5 * sim.dt
    names = FIELDS + tuple(field.name for field in grains.table if field.block.startswith("user_"))
    columns = {name: grains.view(name) for name in names}
    columns["velocity"] = grains.view("velocity") + half * grains.view("force") * grains.view("inverse_mass")[:, None]
    columns["omega"] = grains.view("omega") + half * grains.view("torque") * grains.view("inverse_inertia")[:, None]
    parts = ById(sim.comm, grains.view("id"), 0, sim.next_id)
    return {name: parts.bring(np.ascontiguousarray(column)) for name, column in columns.items()}


def contact_lines(sim):
    """Contacts that touch, each once, in ascending order of (first, second), as lines between what touches.

    A line begins at the centre of the first grain and ends at the centre of the second, at its image that touches, or at the
    wall: it never crosses the box.

    Returns:
        (points (k, 2, 3) [length], cell name -> array (k,) or (k, 3)): ``force`` on the first grain [force],
        ``normal_force`` its part along the normal, positive where it pushes [force], ``overlap`` [length], ``first``,
        ``second`` (ids; the negative key of a wall); of several ranks each has those of a range of first ids.

    Raises:
        SceneError: contacts are not known, since the simulation was not prepared.
    """
    _require(sim.is_primed and sim.is_listed, sim)
    table, (centre, other) = contact_table(sim, all_ranks=False), _centres(sim)
    at_wall = table["second"] < 0
    branch = np.where(at_wall[:, None], table["point"] - centre, sim.box.difference(other, centre))
    length = np.sqrt((branch**2).sum(axis=1))
    normal = -branch / np.where(length > 0.0, length, 1.0)[:, None]
    cells = {name: table[name] for name in ("first", "second", "overlap", "force")}
    cells["normal_force"] = (table["force"] * normal).sum(axis=1)
    lines = np.concatenate([centre, centre + branch], axis=1)
    travel = Mapping.define(sim.comm, by_rank(cells["first"] * sim.comm.size // max(sim.next_id, 1)))
    for column in (lines, *cells.values()):
        travel.push(column)
    travel.send()
    lines, *columns = (travel.pop() for _ in range(1 + len(cells)))
    cells = dict(zip(cells, columns))
    order = np.lexsort((cells["second"], cells["first"]))
    return lines[order].reshape(-1, 2, 3), {name: column[order] for name, column in cells.items()}


def mesh_triangles(sim):
    """The triangles of all meshes, and what grains do to them; the same on all ranks, which all must ask.

    Returns:
        (corners (k, 3, 3) [length], cell name -> array (k,) or (k, 3)): what ``MeshFrames`` says.

    Raises:
        SceneError: contacts are not known, since the simulation was not prepared.
    """
    _require(sim.is_primed and sim.is_listed, sim)
    corners = [np.zeros((0, 3, 3))]
    none = np.zeros(0, dtype=np.int64)
    parts = {"wall": [none], "triangle": [none], "force": [np.zeros((0, 3))], "torque": [np.zeros((0, 3))]}
    for mesh in (wall for wall in sim.walls if wall.kind == "mesh"):
        corners.append(mesh.places)
        parts["wall"].append(np.full(mesh.n_triangles, mesh.number))
        parts["triangle"].append(np.arange(mesh.n_triangles))
        parts["force"].append(triangle_forces(sim, mesh))
        parts["torque"].append(triangle_torques(sim, mesh))
    corners = np.concatenate(corners)
    cells = {name: np.concatenate(part) for name, part in parts.items()}
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    cells["stress"] = cells["force"] / (0.5 * np.sqrt((across**2).sum(axis=1)))[:, None]
    return corners, cells


def _centres(sim):
    """Centres of the first and of the second grain of each contact that ``contact_table`` has of this rank, in its order."""
    place, ids = sim.grains.block("place", True)[:, :3], sim.grains.view("id", True)
    contacts = sim.contacts
    first = np.concatenate([contacts.first, contacts.wall_grain])
    second = np.concatenate([contacts.second, contacts.wall_grain])
    keys = np.concatenate([ids[contacts.second], contacts.wall_key])
    mine = np.flatnonzero((first < sim.grains.n) & (contacts.slot > 0))
    order = mine[np.lexsort((keys[mine], ids[first[mine]]))]
    return place[first[order]], place[second[order]]


def _require(known, sim):
    if not known:
        raise SceneError(
            f"step {sim.step_number}: forces and contacts are not known yet, so they cannot be written; "
            f"call Simulation.prepare() first"
        )
