"""A periodic box that is stretched or sheared: what moves with it, what flies freely in it, what contacts feel, and what work it
does."""

import warnings

import numpy as np
import pytest

import barchan as bc
from barchan.errors import SceneError
from barchan.measure import EnergyAccount, EnergyBudget, stress
from barchan.packing import scatter
from barchan.packing.lattice import lattice

EDGE = 4.0
CUBE = ((0.0,) * 3, (EDGE,) * 3, (True,) * 3)
SOFT = bc.Material("soft", density=1.0, kn=1e3, kt=4e2, gamma_n=0.0, gamma_t=0.0, friction=0.5)
DAMPED = bc.Material("damped", density=1.0, kn=1e3, kt=4e2, gamma_n=3.0, gamma_t=1.0, friction=0.5)


def box(material=SOFT, dt=1e-3, **options):
    sim = bc.Simulation(bc.Box(*CUBE), bc.laws.linear, material, dt, threads=1, **options)
    sim.max_overlap = np.inf
    return sim


def gas():
    """Grains too small to meet."""
    sim, random = box(), np.random.default_rng(2)
    sim.add_grains(random.uniform(0.5, 3.5, (20, 3)), 1e-4, mass=1.0, velocity=random.uniform(-1.0, 1.0, (20, 3)))
    return sim


def from_outside(sim):
    """Places at the full step, folded out, from the centre of the box on, by id."""
    return sim.box.unwrapped(sim.grains.sorted_by_id("position"), sim.grains.sorted_by_id("image")) - 0.5 * EDGE


def test_edges_grow_as_told_about_the_centre():
    sim = gas()
    sim.deformation = bc.Deformation(x=0.2, z=lambda sim: -0.1 * sim.time)
    sim.run(1000)
    expected = EDGE * np.array([1.0002**1000, 1.0, np.prod(1.0 - 1e-4 * 1e-3 * np.arange(1000))])
    np.testing.assert_allclose(sim.box.length, expected, rtol=1e-12)
    np.testing.assert_allclose(sim.box.low + sim.box.high, EDGE, rtol=1e-14)


def test_what_is_at_rest_in_the_box_keeps_its_share_of_it():
    sim, random = box(), np.random.default_rng(3)
    sim.add_grains(random.uniform(0.1, 3.9, (20, 3)), 1e-4, mass=1.0, frozen=[True] * 5 + [False] * 15)
    share = from_outside(sim) / EDGE
    sim.deformation = bc.Deformation(-0.3, 0.1, 0.2)
    sim.run(500)
    np.testing.assert_allclose(from_outside(sim) / sim.box.length, share, rtol=0.0, atol=1e-13)
    assert not sim.grains.velocity.any() and not sim.grains.image.any()


def test_free_grains_fly_straight_on_in_space():
    """In a box whose edges grow or shrink steadily, seen from outside, through periodic faces; where the logarithm of the edge
    grows steadily the space of the box pulls them along: u'' = rate^2 u."""
    sim = gas()
    start, velocity = from_outside(sim), sim.grains.sorted_by_id("velocity")
    steady = -0.4
    sim.deformation = bc.Deformation(x=lambda sim: steady / sim.box.length[0], z=0.2)
    rate = np.array([steady / EDGE, 0.0, 0.2])
    sim.run(2000)
    t = 2000 * sim.dt
    speed = velocity + rate * start  # of the half step -1/2, to the first order
    there = from_outside(sim)
    assert sim.grains.image.any()
    np.testing.assert_allclose(there[:, 0], start[:, 0] + speed[:, 0] * t, atol=5e-4)
    np.testing.assert_allclose(there[:, 1], start[:, 1] + speed[:, 1] * t, atol=1e-12)
    np.testing.assert_allclose(there[:, 2], start[:, 2] * np.cosh(0.2 * t) + speed[:, 2] / 0.2 * np.sinh(0.2 * t), atol=5e-4)


@pytest.mark.parametrize(("name", "flow", "along"), [("xy", 0, 1), ("xz", 0, 2), ("yz", 1, 2)])
def test_what_is_at_rest_in_a_sheared_box_moves_with_the_flow(name, flow, along):
    """Through several periods, of which the images are set back; immobile grains, too."""
    sim, random = box(), np.random.default_rng(3)
    sim.add_grains(random.uniform(0.1, 3.9, (20, 3)), 1e-4, mass=1.0, frozen=[True] * 5 + [False] * 15)
    start = from_outside(sim)
    sim.deformation = bc.Deformation(**{name: 3.0})
    sim.run(1200)
    expected = start.copy()
    expected[:, flow] += 3.6 * start[:, along]
    np.testing.assert_allclose(from_outside(sim), expected, rtol=0.0, atol=1e-11)
    assert not sim.grains.velocity.any() and abs(sim.box.tilt).max() == pytest.approx(0.4 * EDGE)
    assert sim.grains.image[:, flow].any() and not sim.box.outside(sim.grains.position).any()


def test_free_grains_fly_straight_on_through_a_sheared_box():
    """To rounding, over its faces; and as it stands still again, tilted."""
    sim = gas()
    start, velocity = from_outside(sim), sim.grains.sorted_by_id("velocity")
    sim.deformation = bc.Deformation(xz=1.5)
    sim.run(1)
    speed = (from_outside(sim) - start) / sim.dt
    np.testing.assert_allclose(speed[:, 0], velocity[:, 0] + 1.5 * start[:, 2], atol=1e-9)
    sim.run(1999)
    np.testing.assert_allclose(from_outside(sim), start + 2000 * sim.dt * speed, atol=1e-9)
    assert np.abs(sim.grains.image).min(axis=0).max() == 0 and (np.abs(sim.grains.image) > 0).any(axis=0).all()
    sim.deformation = bc.Deformation()
    sim.run(1)
    there, velocity = from_outside(sim), sim.grains.sorted_by_id("velocity")
    tilt = sim.box.tilt[1]
    sim.run(1000)
    assert sim.box.tilt[1] == tilt != 0.0
    np.testing.assert_allclose(from_outside(sim), there + 1000 * sim.dt * velocity, atol=1e-9)


def test_grains_that_only_the_box_brings_together_are_found():
    """At rest in it, they are not listed as pairs at the start, and never move by themselves."""
    sim = box(dt=1e-3)
    sim.add_grains(lattice("sc", 1.0, (0.5,) * 3, (4,) * 3), 0.4, mass=1e6)
    sim.skin, sim.deformation = 0.02, bc.Deformation(-0.3, -0.3, -0.2)
    sim.run(200)
    assert sim.contacts.n_pairs == 0
    while sim.box.length[0] > 0.79 * EDGE:
        sim.run(20)
    assert sim.touching == 64 * 2 and sim.staleness.rebuilds > 5, "along x and y, z is longer"


def test_layers_that_only_a_shear_brings_together_are_found():
    """At rest in the box, on gaps of the layers below, until they lie on their grains."""
    sim, third = box(dt=1e-3), EDGE / 3.0
    for layer in range(4):
        sim.add_grains(
            [(third * (i + 0.25 + 0.5 * (layer % 2)), third * (j + 0.5), layer + 0.5) for i in range(3) for j in range(3)],
            0.55,
            mass=1e6,
        )
    sim.skin, sim.deformation = 0.02, bc.Deformation(xz=1.0)
    sim.run(100)
    assert sim.contacts.n_pairs == 0
    sim.run(600)
    assert sim.touching == 36 and sim.staleness.rebuilds > 5


def test_a_box_that_becomes_too_short_ends_the_run_as_it_was():
    sim = gas()
    sim.skin, sim.deformation = 0.9, bc.Deformation(x=-0.5)
    with pytest.raises(SceneError, match=r"box: its period along x is 1\.799\d* \[length\]; it must be at least two cut-offs"):
        sim.run(10_000)
    assert sim.box.length[0] >= 2.0 * 0.9
    sim = gas()
    sim.deformation = bc.Deformation(x=-1e4)
    with pytest.raises(SceneError, match=r"box: its period along x is -36 \[length\]"):
        sim.run(1)
    assert sim.box.length.tolist() == [EDGE] * 3 and sim.step_number == 0


def test_a_gas_that_is_compressed_heats_up():
    """Each velocity is inverse to the edge along it, to rounding: m v^2 L^2 is kept."""
    sim = gas()
    velocity = sim.grains.sorted_by_id("velocity")
    sim.deformation = bc.Deformation(-0.3, -0.3, 0.1)
    sim.run(1000)
    np.testing.assert_allclose(sim.grains.sorted_by_id("velocity") * sim.box.middle, velocity * EDGE, rtol=1e-11)
    sim.deformation = bc.Deformation()
    sim.run(1)
    edge = sim.box.length
    sim.run(10)
    assert np.array_equal(sim.box.length, edge) and not sim.box.moves
    np.testing.assert_allclose(sim.grains.sorted_by_id("velocity") * edge, velocity * EDGE, rtol=1e-11)


def crowd(material=DAMPED, shift=0.0, **options):
    sim, random = box(material, **options), np.random.default_rng(5)
    sim.add_grains((random.uniform(0.0, 4.0, (300, 3)) + shift) % EDGE, random.uniform(0.25, 0.35, 300))
    return sim


@pytest.fixture(autouse=True)
def deep_overlaps_are_meant():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


@pytest.mark.parametrize("shear", [{}, {"xy": 2.0}, {"xz": -4.0}, {"yz": 1.0}], ids=["stretched", "xy", "xz", "yz"])
def test_no_place_in_the_box_is_special(shear):
    """The same grains elsewhere, so that others meet across its faces, do the same: with friction, dashpots and memory."""
    here, there = crowd(), crowd(shift=np.array([1.7, 0.9, 2.3]))
    for sim in (here, there):
        sim.deformation = bc.Deformation(-0.5, 0.3, -0.2, **shear)
        sim.run(400)
    for field in ("velocity", "omega", "force"):
        one, other = (sim.grains.sorted_by_id(field) for sim in (here, there))
        np.testing.assert_allclose(one, other, rtol=0.0, atol=1e-7 * np.abs(one).max())


@pytest.mark.parametrize("shear", [0.0, 2.0], ids=["stretched", "sheared"])
def test_the_box_does_the_work_that_stress_and_rate_say(shear):
    """Without dissipation what the grains have gained is the sum of - V stress : rate dt, with the error of the step."""
    errors = []
    for step in (1e-3, 5e-4):
        sim, random = box(bc.Material("smooth", density=1.0, kn=1e3, kt=1.0, friction=0.0), dt=step), np.random.default_rng(5)
        radius = random.uniform(0.25, 0.35, 300)
        sim.add_grains(scatter(sim.box, radius, seed=1).position, radius, velocity=random.normal(size=(300, 3)))
        rate = np.diag([0.0, 0.3, -0.2]) if shear else np.diag([-0.5, 0.3, -0.2])
        rate[0, 2] = shear
        sim.deformation = bc.Deformation(*np.diag(rate), xz=shear or None)
        sim.run(1)
        begin, work, powers = EnergyBudget().compute(sim).total, 0.0, []
        for _ in range(round(0.2 / step)):
            powers.append(-np.prod(sim.box.length) * (stress(sim).total * rate).sum())
            sim.run(1)
        powers.append(-np.prod(sim.box.length) * (stress(sim).total * rate).sum())
        work = step * (np.sum(powers) - 0.5 * (powers[0] + powers[-1]))
        gained = EnergyBudget().compute(sim).total - begin
        assert abs(work) > 0.02 * begin
        errors.append(abs(gained - work) / abs(work))
    assert errors[1] < 0.01 and errors[1] < 0.7 * errors[0], errors


@pytest.mark.parametrize(("law", "shear"), [("linear", None), ("linear", 2.0), ("hertz_mindlin", None)])
def test_the_energy_account_knows_the_work_of_the_box(law, shear):
    """With friction, dashpots and bonds: what is left over is small, and falls with the step."""
    left = []
    for step in (4e-4, 2e-4):
        values = {"linear": {"kn": 1e3, "kt": 4e2, "gamma_n": 3.0, "gamma_t": 1.0}}.get(
            law, {"youngs_modulus": 3e3, "poisson_ratio": 0.25, "restitution": 0.7}
        )
        glue = bc.Bond(bc.laws.parallel_bond, kn=1e3, ks=5e2, tensile_strength=1e9, shear_strength=1e9)
        sim = bc.Simulation(bc.Box(*CUBE), bc.laws.SHIPPED[law], bc.Material("m", density=1.0, friction=0.5, **values), step,
                            threads=1, bonds=glue)  # fmt: skip
        sim.max_overlap = np.inf
        random = np.random.default_rng(5)
        radius = random.uniform(0.25, 0.35, 300)
        sim.add_grains(scatter(sim.box, radius, seed=1).position, radius)
        sim.install_bonds(-0.02, among=np.arange(100))
        sim.deformation = bc.Deformation(-0.5, 0.3, -0.8, xz=shear)
        account = EnergyAccount()
        sim.writers.append(account)
        sim.run(round(0.3 / step))
        account.compute(sim)
        assert abs(account.box) > 0.3 * account.largest and account.friction > 0.01 * account.largest
        assert account.bonded > 0.01 * account.largest and abs(account.breaking) < 0.02 * account.largest
        left.append(abs(account.residual) / account.largest)
    assert left[0] < 0.01 and left[1] < 0.65 * left[0], left


def crystal(material=DAMPED, **options):
    """A simple cubic lattice that just touches: 4 x 4 x 4 grains."""
    sim = box(material, **options)
    sim.add_grains(lattice("sc", 1.0, (0.5,) * 3, (4,) * 3), 0.5)
    return sim


def test_the_stress_of_a_crystal_is_that_of_its_springs():
    """kn overlap over the face of a cell, along each axis by itself."""
    sim = crystal(SOFT)
    sim.deformation = bc.Deformation(-0.04, -0.02, -0.01)
    sim.run(1000)
    cell = sim.box.length / 4.0
    expected = 1e3 * (1.0 - cell) * cell / cell.prod()
    np.testing.assert_allclose(np.diag(stress(sim).contact), expected, rtol=1e-10)


def test_dashpots_feel_how_fast_the_box_brings_grains_together():
    """Across its faces, too: to the force of the springs comes gamma_n m_eff times the rate and the distance."""
    sim, rates = crystal(DAMPED), np.array([-0.04, -0.02, -0.01])
    sim.deformation = bc.Deformation(*rates)
    sim.run(1000)
    cell, mass = sim.box.length / 4.0, sim.grains.mass[0]
    force = 1e3 * (1.0 - cell) - 3.0 * 0.5 * mass * sim.box.frame.rate[:3] * cell
    np.testing.assert_allclose(sim.box.frame.rate[:3], rates, rtol=1e-4)
    np.testing.assert_allclose(np.diag(stress(sim).contact), force * cell / cell.prod(), rtol=1e-10)


@pytest.mark.parametrize("axes", ["all alike", "each by itself"])
def test_a_servo_holds_a_stress(axes):
    """Of a crystal, to what its springs need; of a crowd, within 1 %, while it is pulled along the other axis."""
    sim = crystal()
    sim.damping = bc.Damping(local=0.5)
    one = bc.StressServo(20.0, max_rate=0.5)
    if axes == "all alike":
        sim.deformation = bc.Deformation(one, one, one)
    else:
        sim.deformation = bc.Deformation(*(bc.StressServo(s, max_rate=0.5) for s in (20.0, 30.0, 10.0)))
    sim.run(6000)
    wanted = [20.0] * 3 if axes == "all alike" else [20.0, 30.0, 10.0]
    np.testing.assert_allclose(np.diag(stress(sim).total), wanted, rtol=0.005)


def test_one_servo_remembers_each_simulation_by_itself():
    """Two that take turns, in runs of a few steps, do what each does alone in one run."""

    def pressed(servo):
        sim = crystal()
        sim.damping, sim.deformation = bc.Damping(local=0.5), bc.Deformation(servo, servo, servo)
        return sim

    alone, one = pressed(bc.StressServo(20.0, max_rate=0.5)), bc.StressServo(20.0, max_rate=0.5)
    pair = pressed(one), pressed(one)
    pair[1].dt *= 0.5
    for _ in range(20):
        for sim in pair:
            sim.run(10)
    alone.run(200)
    np.testing.assert_array_equal(pair[0].grains.position, alone.grains.position)


def test_the_shear_stress_of_a_crystal_is_that_of_its_springs():
    """Simple cubic, grains free to spin: those in a layer touch those above, and slide on them, by the springs kt: the modulus is
    kt / 2 over the diameter, less the pressure, since normals lean."""
    material = bc.Material("rough", density=1.0, kn=1e3, kt=4e2, gamma_n=3.0, gamma_t=3.0, friction=1e3)
    sim = crystal(material)
    sim.deformation, sim.damping = bc.Deformation(-0.02, -0.02, -0.02), bc.Damping(local=0.5)
    sim.run(1000)
    strain, cell = 2e-4, sim.box.length[0] / 4.0
    sim.deformation = bc.Deformation(xz=strain)
    sim.run(1000)
    sim.deformation = bc.Deformation()
    sim.run(3000)
    found = stress(sim).total
    pressure = 1e3 * (1.0 - cell) / cell**2
    np.testing.assert_allclose(np.diag(found), pressure, rtol=1e-4)
    assert -found[0, 2] / strain == pytest.approx(0.5 * 4e2 / cell - pressure, rel=1e-3)


def test_a_servo_holds_a_shear_stress():
    """Of a crystal whose grains stick, and of one that is pulled the other way."""
    for target in (2.0, -1.0):
        sim = crystal(bc.Material("rough", density=1.0, kn=1e3, kt=4e2, gamma_n=3.0, gamma_t=3.0, friction=1e3))
        sim.damping = bc.Damping(local=0.5)
        sim.deformation = bc.Deformation(z=bc.StressServo(20.0, max_rate=0.5), xz=bc.StressServo(target, max_rate=0.2))
        sim.run(6000)
        found = stress(sim).total
        assert (found[2, 2], -found[0, 2]) == (pytest.approx(20.0, rel=0.005), pytest.approx(target, rel=0.01))


def test_what_cannot_be_stretched_is_refused():
    sim = bc.Simulation(bc.Box((0, 0, 0), (4, 4, 4), (True, True, False)), bc.laws.linear, SOFT, 1e-3)
    sim.add_grains([(2, 2, 2)], 0.4)
    sim.deformation = bc.Deformation(z=0.1)
    with pytest.raises(SceneError, match=r"deformation: z = 0\.1, but the box is not periodic along z"):
        sim.run(1)
    for wrong in ("fast", np.nan, True, 1j):
        sim.deformation = bc.Deformation(x=wrong)
        with pytest.raises(SceneError, match=r"deformation: x = .* \[1/time\] must be a finite number"):
            sim.run(1)
    sim.deformation = bc.Deformation(x=lambda sim: np.inf)
    with pytest.raises(SceneError, match=r"deformation, t = 0: x = inf"):
        sim.run(1)
    sim.deformation = 0.1
    with pytest.raises(SceneError, match=r"deformation = 0.1 must be a barchan.Deformation"):
        sim.run(1)
    sim.deformation = bc.Deformation(xz=1.0)
    with pytest.raises(SceneError, match=r"deformation: xz = 1\.0, but the box is not periodic along z"):
        sim.run(1)
    sim.deformation = bc.Deformation(xy=1.0)
    sim.add_wall(bc.Mesh([(0.5, 0.5, 3.5), (1.5, 0.5, 3.5), (0.5, 1.5, 3.5)], [(0, 1, 2)]))
    with pytest.raises(SceneError, match=r"wall 0 \(mesh\) would have to be sheared with the box; only planes"):
        sim.run(1)
    sim.deformation = bc.Deformation(x=-0.1)
    with pytest.raises(SceneError, match=r"x = -0\.1, but wall 0 \(mesh\) cannot be stretched .* Deform the box before add_wall"):
        sim.run(1)


def test_shears_that_cannot_be_are_refused():
    sim, servo = gas(), bc.StressServo(1.0, max_rate=1.0)
    for deformation, message in (
        (bc.Deformation(xy=1.0, yz=0.0), "xy and yz are both given; a box is sheared in one way at a time"),
        (bc.Deformation(z=servo, xz=servo), "one StressServo stands for xz and for an edge; give each its own"),
        (bc.Deformation(xz="fast"), r"deformation: xz = .* \[1/time\] must be a finite number"),
    ):
        sim.deformation = deformation
        with pytest.raises(SceneError, match=message):
            sim.run(1)
    sim = gas()
    sim.deformation = bc.Deformation(xz=1e4)
    with pytest.raises(SceneError, match=r"t = 0: xz = 10000 .* is a shear by 10 in a step, of at most 0\.01; lower"):
        sim.run(1)
    sim.deformation = bc.Deformation(xz=1.0)
    sim.run(2)
    sim.deformation = bc.Deformation(xy=1.0)
    with pytest.raises(SceneError, match=r"xy = 1\.0, but the box tilts by \[0\.0, 0\.008, 0\.0\]"):
        sim.run(1)
    sim = gas()
    sim.skin, sim.deformation = 1.9, bc.Deformation(xz=0.1)
    with pytest.raises(SceneError, match=r"at least two cut-offs, .* times 1\.281 as it is sheared"):
        sim.run(1)
    assert sim.step_number == 0
