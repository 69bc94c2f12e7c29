"""The contacts of a state, as arrays."""

import numpy as np

from barchan.measure.touching import check_listed


def contact_table(sim, all_ranks=True):
    """Contacts that touch, each once, in ascending order of (first, second).

    Args:
        all_ranks: gather the contacts of all ranks on every rank.

    Returns:
        A dict of arrays, one row a contact: ``first`` (id), ``second`` (id, or the negative key of a wall, ``wall.key``, and
        of a mesh those below, one for each of its ``patches``),
        ``overlap`` [length], ``relative_overlap`` (to the smaller diameter), ``force`` (k, 3) on the first [force],
        ``point`` (k, 3) in the middle of the overlap [length], ``memory`` (k, width) of the law.

    Raises:
        SceneError: the contacts were not computed since the scene was changed or restored.
    """
    check_listed(sim)
    contacts, grains = sim.contacts, sim.grains
    place, ids = grains.block("place", True), grains.view("id", True)
    first, second = contacts.first, contacts.second
    branch = sim.box.difference(place[first, :3], place[second, :3])
    distance = np.sqrt((branch**2).sum(axis=1))
    overlap = place[first, 3] + place[second, 3] - distance
    arm = place[second, 3] - 0.5 * overlap
    on_walls = contacts.wall_grain
    wall_overlap = place[on_walls, 3] - contacts.surface[0]
    table = {
        "first": np.concatenate([ids[first], ids[on_walls]]),
        "second": np.concatenate([ids[second], contacts.wall_key]),
        "overlap": np.concatenate([overlap, wall_overlap]),
        "relative_overlap": np.concatenate(
            [overlap / (2.0 * np.minimum(place[first, 3], place[second, 3])), wall_overlap / (2.0 * place[on_walls, 3])]
        ),
        "force": contacts.forces(slice(None)).T.copy(),
        "point": np.concatenate(
            [
                place[second, :3] + branch * (arm / distance)[:, None],
                place[on_walls, :3] - contacts.surface[1:4].T * contacts.surface[0][:, None],
            ]
        ),
        "memory": contacts.memory().T.copy(),
    }
    mine = np.concatenate([first < grains.n, np.ones(len(on_walls), dtype=bool)]) & (contacts.slot > 0)
    parts = [{name: column[mine] for name, column in table.items()}]
    if all_ranks:
        parts = sim.comm.all_gather(parts[0])
    joined = {name: np.concatenate([part[name] for part in parts]) for name in table}
    order = np.lexsort((joined["second"], joined["first"]))
    return {name: column[order] for name, column in joined.items()}
