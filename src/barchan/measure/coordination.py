"""How many contacts a grain has."""

from typing import NamedTuple

from barchan.measure.base import flowing_rows
from barchan.measure.touching import check_contacts


class Coordination(NamedTuple):
    """Mean numbers of contacts of a grain, and who bears nothing.

    ``plain``: of all grains. ``mechanical``: of those that bear, (2 C - N1) / (N - N0 - N1). ``rattlers``: number of grains
    with fewer than two contacts, N0 + N1. Both means are 0.0 where there is no such grain.
    """

    plain: float
    mechanical: float
    rattlers: int


def coordination(sim):
    """Coordination numbers of the grains that are not frozen.

    A contact with a wall or a frozen grain counts for the moving one only, a contact of two moving grains for both: 2 C is
    the sum of the contacts of N grains, of which N0 have none and N1 a single one. Rattlers are not removed anew once
    others are.
    Source of the mechanical one: Thornton, Geotechnique 50, 43 (2000).

    Returns:
        ``Coordination``.

    Raises:
        SceneError: grains or walls were changed since the last run.
    """
    check_contacts(sim)
    contacts = sim.contacts.touched[flowing_rows(sim)]
    counts = [contacts.sum(), len(contacts), (contacts == 0).sum(), (contacts == 1).sum()]
    sides, grains, without, single = sim.comm.sum(counts).tolist()
    bearing = grains - without - single
    plain = sides / grains if grains else 0.0
    return Coordination(plain, (sides - single) / bearing if bearing else 0.0, without + single)
