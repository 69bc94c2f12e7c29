"""Many steps in one call: for scenes so small that calling compiled code from Python would cost more than what it does (100
grains: 60 us a step, 4 in here). The text is part of the module that ``generate.py`` writes for a law; it runs every loop on
one thread, in the order in which ``Simulation.step`` does."""

from typing import NamedTuple

import numpy as np


class Bodies(NamedTuple):
    """Blocks of all grains, those that the law reads also of their ghosts."""

    place: np.ndarray
    motion: np.ndarray
    spin: np.ndarray
    image: np.ndarray
    force: np.ndarray
    torque: np.ndarray
    mass: np.ndarray
    material: np.ndarray


#: Those that the law reads.
OF_GHOSTS = frozenset({"place", "motion", "spin", "material"})


class Lists(NamedTuple):
    """The neighbour list, by the names of ``neighbors.contacts.Contacts``."""

    first: np.ndarray
    second: np.ndarray
    ids: np.ndarray
    wall_key: np.ndarray
    slot: np.ndarray
    start: np.ndarray
    touched: np.ndarray
    incidence: np.ndarray
    changed: np.ndarray
    wall_grain: np.ndarray
    wall_material: np.ndarray
    wall_begin: np.ndarray


class Rooms(NamedTuple):
    """Shares of the pairs, (1 or 2, 2): those of owned grains, and with ghosts; one share of the grains; room to work in."""

    pairs: np.ndarray
    rows: np.ndarray
    branch: np.ndarray
    fresh: np.ndarray
    grains: np.ndarray
    keys: np.ndarray
    fresh_at_walls: np.ndarray


class Then(NamedTuple):
    """Where grains, (4, ...) by coordinate, and flat walls, (planes, 3), were at the rebuild."""

    seen: np.ndarray
    point: np.ndarray


class Planes(NamedTuple):
    """Flat walls that do not turn, (planes, 3) each, but ``number`` (planes,) among all walls; ``surface``: the geometry of the
    contacts with all walls."""

    number: np.ndarray
    point: np.ndarray
    normal: np.ndarray
    velocity: np.ndarray
    omega: np.ndarray
    surface: np.ndarray


class Rules(NamedTuple):
    """What the steps depend on, besides the grains, and when they have to end."""

    n_materials: np.uint32
    table: np.ndarray
    low: np.ndarray
    length: np.ndarray
    half: np.ndarray
    tilt: np.ndarray
    rate: np.ndarray
    gravity: np.ndarray
    local_damping: float
    viscous_damping: float
    dt: float
    allowed_overlap: float
    max_overlap: float
    wall_speed: float
    skin: float
    warned: bool


class Progress(NamedTuple):
    """What became of the steps.

    ``done``: whole steps. ``begun``: one more has moved the grains, and has to be finished. ``fastest``, ``bad``: what
    ``kick_drift_wrap`` returned last. ``quickest``: largest speed of the whole steps. The rest belongs to the last whole step,
    but for ``large``, which is their sum.
    """

    done: int
    begun: int
    fastest: float
    bad: int
    time: float
    approach: float
    quickest: float
    touching: int
    large: int
    too_large: int
    not_finite: int

    @classmethod
    def read(cls, told):
        """What ``advance`` wrote into ``told``, an array of as many numbers."""
        return cls(*(int(value) if kind is int else value for kind, value in zip(cls.__annotations__.values(), told.tolist())))


#: What stands in it for laws with couples.
COUPLES_IMPORT = "from barchan.kernels.couples import add_couples_alone as barchan_add_couples"
COUPLES = """
        not_finite += barchan_add_couples(lists.start, lists.touched, lists.incidence, slot, out, torque)"""

STEPS = '''
barchan_pair_forces = on_one_thread(pair_forces)
barchan_wall_forces = on_one_thread(wall_forces)


@kernel()
def barchan_advance(most, time, approach, bodies, lists, history, out, planes, meshes, then, rooms, rules, wire, told):
    """At most ``most`` steps; all arrays that a step writes are modified, and ``told`` becomes what ``Progress`` reads: written,
    not returned, since a signal that came meanwhile is raised before Python has taken what is returned. Ends before the forces
    of a step in which the list may be stale or a grain is bad, and after one with something to tell of; of several ranks all end
    in the same step, of which they agree as it begins. ``meshes`` is None where there are none: such scenes need not wait until
    all of meshes is compiled."""
    place, motion, spin, force, torque = bodies.place, bodies.motion, bodies.spin, bodies.force, bodies.torque
    first, second, slot = lists.first, lists.second, lists.slot
    dt, n_owned, n_pairs = rules.dt, barchan_np.uint32(force.shape[0]), barchan_np.uint64(first.shape[0])
    several, own_place = rooms.pairs.shape[0] > 1, place[:force.shape[0]]
    wall_column = (n_pairs + barchan_block - barchan_np.uint64(1)) // barchan_block * barchan_block
    done, begun, fastest, bad, quickest, total = 0, False, 0.0, 0, 0.0, 0
    touching, large, too_large, not_finite, ends = 0, 0, 0, 0, False
    barchan_start_watch(wire)
    while done < most and (several or not ends):
        fastest, bad = barchan_kick_drift_wrap(
            place, motion, spin, bodies.image, force, torque, rules.low, rules.length, rules.half, rules.tilt, dt)
        for w in range(planes.point.shape[0]):
            for axis in range(3):
                planes.point[w, axis] += dt * planes.velocity[w, axis]
        if meshes is not None:
            barchan_move_meshes(meshes, dt)
        speed, ends = barchan_agree(wire, max(barchan_sqrt(fastest), rules.wall_speed), ends or bad != 0)
        nearer = approach + 2.0 * speed * dt
        if nearer > rules.skin:
            barchan_measure_travel(own_place, then.seen, planes.point, then.point, rules.length, rules.half, rules.tilt,
                                   wire.numbers)
            if meshes is not None:
                barchan_travel_of_meshes(meshes, wire.numbers)
            barchan_largest_of_all(wire)
            nearer = barchan_approach_after(wire.numbers)
        if ends or nearer > rules.skin:
            begun = True
            break
        approach = nearer
        quickest = max(quickest, speed)
        time += dt
        touching, large, too_large = 0, 0, 0
        if several:
            barchan_send_ghosts(wire, place, motion, spin)
        for part in range(rooms.pairs.shape[0]):
            if part > 0:
                barchan_receive_ghosts(wire, force.shape[0], place, motion, spin)
            more, large_more, too_large_more = barchan_pair_forces(
                rooms.pairs[part], first, second, n_owned, place, motion, spin, bodies.material, rules.n_materials, rules.table,
                slot, history, out, lists.changed, rooms.rows, rooms.branch, rooms.fresh, rules.length, rules.half, rules.tilt,
                rules.rate, dt, rules.allowed_overlap, rules.max_overlap)
            touching, large, too_large = touching + more, large + large_more, too_large + too_large_more
        if lists.wall_grain.shape[0] > 0:
            for w in range(planes.point.shape[0]):
                number = planes.number[w]
                barchan_measure_plane(lists.wall_grain, place, lists.wall_begin[number], lists.wall_begin[number + 1],
                                      planes.point[w], planes.normal[w], planes.normal[w], planes.velocity[w], planes.omega[w],
                                      planes.surface)
            if meshes is not None:
                barchan_measure_meshes(meshes, dt, lists.wall_grain, place, motion, lists.wall_begin, barchan_np.int64(n_pairs),
                                       barchan_np.int64(wall_column) + 1, slot, history, lists.changed, planes.surface)
            more, large_more, too_large_more = barchan_wall_forces(
                lists.wall_grain, planes.surface, place, motion, spin, bodies.material, lists.wall_material, rules.n_materials,
                rules.table, slot, history, out, lists.changed, rooms.fresh_at_walls, n_pairs, wall_column, dt,
                rules.allowed_overlap, rules.max_overlap)
            touching, large, too_large = touching + more, large + large_more, too_large + too_large_more
        barchan_order_incidence(rooms.grains, lists.changed, first, second, lists.ids, lists.wall_key, slot, lists.start,
                              lists.touched, lists.incidence, rooms.keys)
        not_finite = barchan_gather_forces(lists.start, lists.touched, lists.incidence, slot, out, place, bodies.mass,
                                           rules.gravity, force, torque){couples}
        if rules.local_damping > 0.0 or rules.viscous_damping > 0.0:
            barchan_damp(motion, spin, rules.local_damping, rules.viscous_damping, force, torque)
        ends = too_large > 0 or not_finite > 0 or (large > 0 and not rules.warned)
        total += large
        done += 1
    told[0], told[1], told[2], told[3], told[4] = done, begun, fastest, bad, time
    told[5], told[6], told[7], told[8], told[9], told[10] = approach, quickest, touching, total, too_large, not_finite
'''
