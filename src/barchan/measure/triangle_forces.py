"""What grains do to each triangle of a mesh."""

import numpy as np

from barchan.errors import SceneError
from barchan.measure.sums import exact_sums
from barchan.measure.touching import check_contacts

#: Triangles that are summed at a time: 16 MB.
AT_A_TIME = 10_000


def triangle_forces(sim, mesh):
    """Forces of the grains on the triangles of a mesh, each on the one where the grain touches, of several at an edge on one of
    these; exact sums over all ranks, which all must ask.

    Args:
        mesh: a ``Mesh`` of the scene.

    Returns:
        (t, 3) in the order of its triangles [force].

    Raises:
        SceneError: it is no mesh of this scene, or the contacts are out of date.
    """
    if not any(mesh is wall for wall in sim.walls) or mesh.kind != "mesh":
        raise SceneError("triangle_forces: this is no mesh of the scene; give one that add_wall took up")
    check_contacts(sim)
    begin, end = sim.contacts.wall_ranges[mesh.number]
    first = sim.contacts.n_pairs
    force = -sim.contacts.forces(slice(first + begin, first + end))
    touched, count, parts = mesh.touched, len(mesh.places), []
    for start in range(0, count, AT_A_TIME):
        here = (touched >= start) & (touched < start + AT_A_TIME)
        parts.append(exact_sums(list(force[:, here]), sim.comm, touched[here] - start, min(AT_A_TIME, count - start)))
    return np.concatenate(parts, axis=1).T
