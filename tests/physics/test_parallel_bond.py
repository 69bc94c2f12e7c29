"""The parallel bond between two grains that move as told: loads, Newton's third law, symmetry, breaks."""

import numpy as np
import pytest
from bonded import HEAVY, NOTHING, Reference, dots, glued, norms, random_directions, sized

import barchan as bc
from barchan.bonds import cracks
from barchan.laws.parallel_bond import MODES, mode_of_break
from barchan.measure import bond_table

KINDS, EACH, LOT = ("pull", "push", "shear", "twist", "bend", "all"), 10, 4.0
KN, KS, FACTOR, DT = 3e4, 1e4, 0.7, 1e-3

#: Steps in which each set of velocities holds, and how often they change.
STEPS, CHANGES = 40, 4


class Pairs:
    """Bonded pairs with random orientations and unequal radii that nearly touch, each in its lot."""

    def __init__(self, count, seed):
        self.rng = np.random.default_rng(seed)
        self.count, self.radius = count, self.rng.uniform(0.3, 0.6, (count, 2))
        self.normal = random_directions(self.rng, count)  # from the second to the first
        gap = self.rng.uniform(0.0, 0.02, (count, 1))
        number, side = np.arange(count), int(np.ceil(count ** (1.0 / 3.0)))
        lots = LOT * np.stack([number % side, number // side % side, number // side**2], axis=1)
        branch = (self.radius.sum(axis=1, keepdims=True) + gap) * self.normal
        self.position = np.stack([lots + 0.5 * branch, lots - 0.5 * branch], axis=1)
        self.box = bc.Box((-LOT,) * 3, (LOT * side,) * 3)

    def simulation(self, strength=1.0, contact=None, **properties):
        """The pairs in barchan, bonded."""
        sim = glued(self.box, DT, contact, **({"kn": KN, "ks": KS, "radius_factor": FACTOR} | properties))
        sim.add_grains(self.position.reshape(-1, 3), self.radius.ravel(), mass=HEAVY)
        assert sim.install_bonds(overlap=-0.05, strength=strength) == self.count
        return sim

    def motions(self, kind):
        """Velocities and angular velocities (2, count, 2, 3) of one kind of motion: of the order of 1e-4 of a radius a step."""
        along, across = self.normal[:, None], np.cross(self.normal, random_directions(self.rng, self.count))[:, None]
        size = self.rng.uniform(0.02, 0.06, (self.count, 2, 1))
        none, split = np.zeros((self.count, 2, 3)), np.array([[[1.0], [-1.0]]])
        return {
            "pull": (size * split * along, none),
            "push": (-size * split * along, none),
            "shear": (size * split * across, none),
            "twist": (none, size * split * along),
            "bend": (none, size * split * across),
            "all": tuple(self.rng.uniform(-0.05, 0.05, (2, self.count, 2, 3))),
        }[kind]


def move(sim, velocity, omega, steps):
    """Run with velocities (k, 2, 3) of the grains in the order of their ids."""
    rows = sim.grains.row_of(np.arange(sim.grains.n))
    sim.grains.velocity[rows], sim.grains.omega[rows] = velocity.reshape(-1, 3), omega.reshape(-1, 3)
    sim.run(steps)


def by_pairs(sim, name):
    """A field of the grains, (k, 2, 3)."""
    return sim.grains.view(name)[sim.grains.row_of(np.arange(sim.grains.n))].reshape(-1, 2, 3)


@pytest.fixture(scope="module")
def moved():
    """What pairs carry that move in all kinds of ways, in barchan and in the reference: (kind, table, reference, simulation)."""
    found = []
    for number, kind in enumerate(KINDS):
        pairs = Pairs(EACH, seed=number)
        sim = pairs.simulation()
        reference = Reference(pairs.position, pairs.radius, KN, KS, FACTOR)
        for _ in range(CHANGES):
            velocity, omega = pairs.motions(kind)
            move(sim, velocity, omega, STEPS)
            for _ in range(STEPS):
                reference.step(velocity, omega, DT)
        found.append((kind, bond_table(sim), reference, sim))
    return found


def test_loads_and_memory_equal_those_of_a_plain_integration(moved):
    """To 1e-9 of the largest of their kind, or of the load where that is next to nothing."""
    for kind, table, reference, sim in moved:
        forces, torques = by_pairs(sim, "force"), by_pairs(sim, "torque")
        assert (table["first"] == 2 * np.arange(EACH)).all()
        pairs = {
            "force": (table["force"], reference.force),
            "force on the second": (forces[:, 1], -reference.force),
            "torque_first": (torques[:, 0], reference.torque_first),
            "torque_second": (torques[:, 1], reference.torque_second),
            "pressing": (table["bond_normal_force"][:, None], reference.pressing),
            "shear": (table["bond_shear_force"], reference.shear),
            "twisting": (table["twisting_moment"][:, None], reference.twisting),
            "bending": (table["bending_moment"], reference.bending),
        }
        load = max(np.abs(reference.force).max(), np.abs(reference.torque_first).max())
        for name, (ours, theirs) in pairs.items():
            largest = np.abs(theirs).max()
            assert np.abs(ours - theirs).max() < 1e-9 * (largest if largest > 0.1 * load else load), (kind, name)


def test_each_kind_of_motion_makes_its_own_load(moved):
    """So that the test above means something."""
    for kind, table, _, _ in moved:
        loads = {
            "pull": -table["bond_normal_force"].max(),
            "push": table["bond_normal_force"].min(),
            "shear": norms(table["bond_shear_force"]).min(),
            "twist": np.abs(table["twisting_moment"]).min(),
            "bend": norms(table["bending_moment"]).min(),
        }
        for name, load in loads.items():
            assert load > (0.1 if name in ("bend", "twist") else 1.0) or name != kind, (kind, name, load)


def test_forces_are_opposite_and_turn_the_pair_as_a_whole_by_nothing(moved):
    """Newton's third law: also for angular momentum, the torques and the branch times the force."""
    for kind, table, _, sim in moved:
        force, torque, place = (by_pairs(sim, name) for name in ("force", "torque", "position"))
        assert (force[:, 0] == -force[:, 1]).all() and (force[:, 0] == table["force"]).all(), kind
        branch = place[:, 0] - place[:, 1]
        scale = (norms(branch) * norms(force[:, 0])).max() + np.abs(torque).max()
        assert np.abs(torque.sum(axis=1) + np.cross(branch, force[:, 0])).max() < 1e-15 * scale, kind


def test_loads_of_a_single_motion_in_closed_form():
    """kn A s, ks J theta, kn I theta; sheared by s: ks A d asinh(s / d) and kn A (sqrt(d^2 + s^2) - d), of which the force on the
    grains that do not turn makes moments by the shares of the distance."""
    steps, speed = 400, 0.02
    for kind in ("pull", "shear", "twist", "bend"):
        pairs = Pairs(EACH, seed=7)
        sim, none = pairs.simulation(), np.zeros((EACH, 2, 3))
        across = np.cross(pairs.normal, random_directions(pairs.rng, EACH))
        across /= norms(across)
        velocity, omega = none.copy(), none.copy()
        if kind in ("pull", "shear"):
            velocity[:, 0] = speed * (pairs.normal if kind == "pull" else across)
        elif kind == "twist":
            omega[:, 0] = speed * pairs.normal
        else:  # so that the ends stay together: opposite spins, by the radii
            omega[:, 0], omega[:, 1] = (sign * speed * across / pairs.radius[:, [side]] for side, sign in ((0, 1.0), (1, -1.0)))
        move(sim, velocity, omega, steps)
        table, way = bond_table(sim), speed * steps * DT
        _, area, inertia, polar = sized(*pairs.radius.T, FACTOR)
        distance = norms(pairs.position[:, 0] - pairs.position[:, 1])[:, 0]
        loads = {
            "pull": -table["bond_normal_force"],
            "shear": norms(table["bond_shear_force"])[:, 0],
            "twist": -table["twisting_moment"],
            "bend": norms(table["bending_moment"])[:, 0],
        }
        exact = {
            "pull": KN * area * way,
            "shear": KS * area * distance * np.arcsinh(way / distance),
            "twist": KS * polar * way,
            "bend": KN * inertia * way * (1.0 / pairs.radius).sum(axis=1),
        }
        assert loads[kind] == pytest.approx(exact[kind], rel=1e-9), kind
        along = KN * area * (np.hypot(distance, way) - distance)
        others = {name: load for name, load in loads.items() if name != kind}
        if kind == "shear":
            assert others.pop("pull") == pytest.approx(along, rel=1e-9)
            arms = np.hypot(distance, way) * pairs.radius.T / pairs.radius.sum(axis=1)
            for torque, arm in zip((table["torque_first"], table["torque_second"]), arms):
                assert norms(torque)[:, 0] == pytest.approx(arm * exact["shear"], rel=1e-9)
        for name, load in others.items():
            assert np.abs(load).max() < 1e-11 * exact[kind].max(), (kind, name)


def far_apart(seed, swap, shift, periodic):
    """A table of bonds of pairs, perhaps with swapped ids, and shifted through the faces of a periodic box."""
    pairs = Pairs(EACH, seed)
    velocity, omega = pairs.motions("all")
    if swap:
        pairs.position, pairs.radius = pairs.position[:, ::-1], pairs.radius[:, ::-1]
        velocity, omega = velocity[:, ::-1], omega[:, ::-1]
    pairs.position = pairs.position + shift
    if periodic:
        pairs.box = bc.Box((-LOT,) * 3, (3.0 * LOT,) * 3, periodic=(True, True, True))
    sim = pairs.simulation()
    move(sim, velocity, omega, 100)
    return bond_table(sim)


def test_swapped_ids_swap_everything():
    plain, swapped = (far_apart(3, swap, 0.0, False) for swap in (False, True))
    for name in ("force", "bond_shear_force", "bending_moment", "normal"):
        assert np.abs(plain[name] + swapped[name]).max() < 1e-12 * np.abs(plain[name]).max(), name
    for name in ("bond_normal_force", "twisting_moment", "energy"):
        assert plain[name] == pytest.approx(swapped[name], rel=1e-12), name
    for one, other in (("torque_first", "torque_second"), ("torque_second", "torque_first")):
        assert np.abs(plain[one] - swapped[other]).max() < 1e-12 * np.abs(plain[one]).max()


@pytest.mark.parametrize("shift", [(4.0, 0.0, 0.0), (4.1, 3.9, 0.0), (4.0, 4.0, 4.0), (-3.9, 4.1, -4.2)])
def test_bonds_reach_through_periodic_faces(shift):
    """The faces cut through pairs; their loads are those of pairs in the open."""
    plain, wrapped = far_apart(4, False, 0.0, False), far_apart(4, False, np.array(shift), True)
    for name in ("force", "torque_first", "torque_second", "bond_shear_force", "twisting_moment", "bending_moment", "normal"):
        assert np.abs(plain[name] - wrapped[name]).max() < 1e-11 * np.abs(plain[name]).max(), name
    assert np.abs(plain["point"] - wrapped["point"]).max() > LOT


# -- breaks --------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("compressive", [True, False])
def test_bonds_break_in_the_step_and_mode_in_which_the_stress_reaches_their_strength(compressive):
    """200 random draws: motion, orientation, radii, and a strength between two increments. Without a strength in compression
    those that are pushed never break. What a break frees is half of load times way."""
    count, steps, speed = 200, 300, 1e-4
    pairs = Pairs(count, seed=11)
    kinds = np.array(["pull", "push", "shear", "twist", "bend"])[pairs.rng.integers(0, 5, count)]
    wanted = pairs.rng.integers(2, steps, count)
    radius, area, inertia, polar = sized(*pairs.radius.T, FACTOR)
    across = np.cross(pairs.normal, random_directions(pairs.rng, count))
    across /= norms(across)
    velocity, omega = np.zeros((count, 2, 3)), np.zeros((count, 2, 3))
    for kind, sign, direction in (("pull", 1, pairs.normal), ("push", -1, pairs.normal), ("shear", 1, across)):
        velocity[kinds == kind, 0] = sign * speed * direction[kinds == kind]
    omega[kinds == "twist", 0] = (speed * pairs.normal)[kinds == "twist"]
    for side, sign in ((0, 1.0), (1, -1.0)):
        omega[kinds == "bend", side] = (sign * speed * across / pairs.radius[:, [side]])[kinds == "bend"]
    bent = (1.0 / pairs.radius).sum(axis=1)
    a_step = (
        DT
        * speed
        * np.select(  # stress that a step adds at the edge
            [np.isin(kinds, ["pull", "push"]), kinds == "shear", kinds == "twist"], [KN, KS, KS * radius], KN * bent * radius
        )
    )
    strength = (wanted - 0.5) * a_step
    limits = {"tensile_strength": 1.0, "shear_strength": 1.0, "compressive_strength": 1.0 if compressive else 0.0}
    sim = pairs.simulation(lambda first, second: strength[first // 2], **limits)
    move(sim, velocity, omega, steps)
    found = cracks.table(sim)
    number = (found["first"] // 2).astype(int)
    breaks = np.ones(count, dtype=bool) if compressive else kinds != "push"
    assert sorted(number) == np.flatnonzero(breaks).tolist()
    assert (found["step"] == wanted[number]).all()
    modes = {"pull": ["tension"], "push": ["compression"], "shear": ["shear"], "twist": ["torsion"]}
    modes["bend"] = ["tension", "compression"] if compressive else ["tension"]  # both edges feel the same
    assert all(MODES[int(mode) - 1] in modes[kinds[k]] for k, mode in zip(number, found["mode"]))
    way, stiffness = (
        wanted * DT * speed,
        np.select(
            [np.isin(kinds, ["pull", "push"]), kinds == "shear", kinds == "twist"],
            [KN * area, KS * area, KS * polar],
            KN * inertia * bent**2,
        ),
    )
    assert found["energy"] == pytest.approx((0.5 * stiffness * way**2)[number], rel=1e-7)  # in shear the bond turns a little


def test_the_largest_excess_gives_the_mode():
    """The rule of the law's documentation, drawn at random and written once more."""
    rng = np.random.default_rng(5)
    seen = set()
    for _ in range(2000):
        tension, compression, shear, torsion = rng.uniform(-1.0, 1.0, 2).tolist() + rng.uniform(0.0, 0.7, 2).tolist()
        strengths = rng.uniform(0.5, 1.0, 3)
        strengths[1] *= rng.random() < 0.7
        excess = {"tension": tension / strengths[0], "in shear": (shear + torsion) / strengths[2]}
        if strengths[1] > 0.0:
            excess["compression"] = compression / strengths[1]
        name = max(excess, key=excess.get)
        expected = "none" if excess[name] < 1.0 else name
        if expected == "in shear":
            expected = "shear" if shear >= torsion else "torsion"
        mode = mode_of_break((tension, compression, shear, torsion), *strengths, 1.0)
        assert (("none", *MODES)[mode]) == expected
        seen.add(expected)
    assert seen == {"none", *MODES}


def test_where_the_strength_is_reached_exactly_it_breaks():
    for place, mode in ((0, 1), (1, 2), (2, 3), (3, 4)):
        stresses = [0.0, 0.0, 0.0, 0.0]
        stresses[place] = 2.0
        assert mode_of_break(stresses, 2.0, 2.0, 2.0, 1.0) == mode
        stresses[place] = np.nextafter(2.0, 0.0)
        assert mode_of_break(stresses, 2.0, 2.0, 2.0, 1.0) == 0


def test_all_loads_together_break_by_their_sums():
    """Bending adds to tension, the twisting moment to the shear force: the stresses of the reference, up to the step before."""
    pairs = Pairs(EACH, seed=21)
    reference = Reference(pairs.position, pairs.radius, KN, KS, FACTOR)
    velocity, omega = pairs.motions("all")
    radius, area, inertia, polar = (a[:, None] for a in sized(*pairs.radius.T, FACTOR))
    stresses = []
    for _ in range(100):
        reference.step(velocity, omega, DT)
        bent, pressed = norms(reference.bending) * radius / inertia, reference.pressing / area
        sheared = norms(reference.shear) / area + np.abs(reference.twisting) * radius / polar
        stresses.append(np.maximum(np.maximum(bent - pressed, bent + pressed) / 3.0, sheared / 2.0)[:, 0])
    stresses = np.maximum.accumulate(stresses)
    wanted = pairs.rng.integers(10, 100, EACH)
    strength = 0.5 * (stresses[wanted - 1, np.arange(EACH)] + stresses[wanted - 2, np.arange(EACH)])
    assert (stresses[wanted - 1, np.arange(EACH)] > stresses[wanted - 2, np.arange(EACH)]).all()
    limits = {"tensile_strength": 3.0, "compressive_strength": 3.0, "shear_strength": 2.0}
    sim = pairs.simulation(lambda first, second: strength[first // 2], **limits)
    move(sim, velocity, omega, 100)
    found = cracks.table(sim)
    assert found["step"][np.argsort(found["first"])].tolist() == wanted.tolist()
    assert len(set(found["mode"])) > 1


def test_after_the_break_the_contact_law_is_left_as_if_there_had_been_no_bond():
    """To the last bit, with the friction it has gathered meanwhile; a broken bond carries nothing and is gone from the table."""
    contact = NOTHING | {"kn": 1e4, "kt": 5e3, "friction": 0.4}
    states = []
    for strength in (1e-3, 1e9):
        pairs = Pairs(EACH, seed=31)
        pairs.position[:, 0] -= 0.03 * pairs.normal  # so that most overlap
        sim = pairs.simulation(strength, contact, tensile_strength=1.0, shear_strength=1.0)
        if strength > 1.0:
            sim.bonds.clear()
        sim.max_overlap = 1.0
        velocity, omega = pairs.motions("all")
        move(sim, velocity, omega, 50)
        states.append((by_pairs(sim, "force"), by_pairs(sim, "torque")))
        assert len(bond_table(sim)["first"]) == 0
    assert len(cracks.table(sim)["step"]) == 0
    for broken, never in zip(*states):
        assert (broken == never).all() and (norms(broken[:, 0]) > 0.0).sum() > EACH // 2


def test_what_a_bond_stores_is_what_its_loads_say(moved):
    for kind, table, reference, _ in moved:
        _, area, inertia, polar = sized(reference.radius[:, 0], reference.radius[:, 1], FACTOR)
        stored = reference.pressing**2 / (2 * KN * area) + dots(reference.shear, reference.shear) / (2 * KS * area)
        stored += reference.twisting**2 / (2 * KS * polar) + dots(reference.bending, reference.bending) / (2 * KN * inertia)
        assert table["energy"] == pytest.approx(stored[:, 0], rel=1e-9), kind
