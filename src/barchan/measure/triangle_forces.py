"""What grains do to each triangle of a mesh."""

import numpy as np

from barchan.errors import SceneError
from barchan.measure.sums import exact_sums
from barchan.measure.touching import check_contacts

#: Triangles that are summed at a time: 16 MB.
AT_A_TIME = 10_000


def triangle_forces(sim, mesh):
    """Forces of the grains on the triangles of a mesh, each on the one where the grain touches, of several at an edge on one of
    these; exact sums over all ranks, which all must ask. Their sum is ``mesh.force``, up to rounding.

    Args:
        mesh: a ``Mesh`` of the scene.

    Returns:
        (t, 3) in the order of its triangles [force].

    Raises:
        SceneError: it is no mesh of this scene, or the contacts are out of date.
    """
    _check(sim, mesh, "triangle_forces")
    return _by_triangle(sim, mesh, -_on_grains(sim, mesh)[:3])


def triangle_torques(sim, mesh):
    """Torques of the grains on the triangles of a mesh about its ``point``, couples of laws that have them included: (t, 3)
    [force length]. Takes and raises what ``triangle_forces`` does; their sum is ``mesh.torque``, up to rounding."""
    _check(sim, mesh, "triangle_torques")
    contacts, (begin, end) = sim.contacts, sim.contacts.wall_ranges[mesh.number]
    out, surface = _on_grains(sim, mesh), contacts.surface[:, begin:end]
    centre = sim.grains.block("place")[contacts.wall_grain[begin:end], :3]
    arm = centre - (surface[0] * surface[1:4]).T - mesh.point
    torque = np.cross(arm, -out[:3].T).T
    return _by_triangle(sim, mesh, torque - out[-3:] if contacts.couple else torque)


def _check(sim, mesh, what):
    if not any(mesh is wall for wall in sim.walls) or mesh.kind != "mesh":
        raise SceneError(f"{what}: this is no mesh of the scene; give one that add_wall took up")
    check_contacts(sim)


def _on_grains(sim, mesh):
    """What the law said of the contacts of a mesh, (rows, contacts); 0 for those that do not touch."""
    contacts, (begin, end) = sim.contacts, sim.contacts.wall_ranges[mesh.number]
    return contacts.out[:, contacts.slot[contacts.n_pairs + begin : contacts.n_pairs + end]]


def _by_triangle(sim, mesh, values):
    """Sums of ``values`` (3, contacts of the mesh) for each triangle, (t, 3)."""
    touched, count, parts = mesh.touched, mesh.n_triangles, []
    for start in range(0, count, AT_A_TIME):
        here = (touched >= start) & (touched < start + AT_A_TIME)
        parts.append(exact_sums(list(values[:, here]), sim.comm, touched[here] - start, min(AT_A_TIME, count - start)))
    return np.concatenate(parts, axis=1).T
