"""How many contacts slide."""

import numpy as np

from barchan.errors import SceneError
from barchan.measure.touching import check_contacts, dot, touching_pairs, touching_walls

#: A tangential force within this part of Coulomb's limit is at it: laws reach it but for rounding.
_ROUNDING = 1e-9


def sliding_fraction(sim):
    """Part of the contacts, with grains and with walls, whose tangential force is at Coulomb's limit, mu times the normal force.

    mu is the law's parameter ``friction`` of the pair of materials. Contacts without any friction always slide, those without
    normal force never. 0.0 without contacts.

    Raises:
        SceneError: the law has no parameter ``friction``, or grains or walls were changed since the last run.
    """
    check_contacts(sim)
    if "friction" not in sim.law.parameters:
        raise SceneError(
            f"sliding_fraction: law '{sim.law.name}' has no parameter 'friction', so Coulomb's limit is not known; it has "
            f"{', '.join(sim.law.parameters) or 'none'}"
        )
    friction = sim.materials.table(sim.law)[sim.law.parameters.index("friction")]
    material, stride = sim.grains.block("material", True), len(sim.materials)
    at_walls = touching_walls(sim)
    partner = sim.contacts.wall_material[at_walls.contact]
    slide = [_slides(at_walls, friction[material[at_walls.grain] * stride + partner])]
    for pairs in touching_pairs(sim):
        slide.append(_slides(pairs, friction[material[pairs.first] * stride + material[pairs.second]]))
    slide = np.concatenate(slide)
    sliding, count = sim.comm.sum([slide.sum(), len(slide)]).tolist()
    return sliding / count if count else 0.0


def _slides(contacts, friction):
    """Which of ``Pairs`` or ``AtWalls`` slide."""
    normal = contacts.branch / np.sqrt(dot(contacts.branch, contacts.branch))
    tangential = contacts.force - contacts.normal_force * normal
    limit = friction * np.abs(contacts.normal_force)
    return (np.sqrt(dot(tangential, tangential)) >= (1.0 - _ROUNDING) * limit) & (contacts.normal_force != 0.0)
