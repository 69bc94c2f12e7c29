"""Two dimensions: discs or spheres in the plane z = 0, and what leads out of it is refused."""

from math import pi, sqrt

import numpy as np
import pytest
from scenes import simulation

import barchan as bc
from barchan.checkpoint import restore, save
from barchan.domain import Box
from barchan.errors import CheckpointError, LostGrainError, SceneError
from barchan.walls import Vibration


def plane(low=(0, 0), high=(6, 6), periodic=(False, False), **options):
    return simulation(bc.Box(low, high, periodic), **options)


# -- the box ------------------------------------------------------------------------------------------------------------------


def test_a_box_of_two_numbers_is_a_plane():
    box = Box((1, 2), (4, 8), (True, False))
    assert box.dimension == 2 and Box((0, 0, 0), (1, 1, 1)).dimension == 3
    assert box.low.tolist() == [1, 2, 0] and box.high.tolist() == [4, 8, 0] and box.periodic == (True, False, False)
    assert box.length.tolist() == [3, 6, 0] and box.span.tolist() == [3, 6, 1]
    with np.errstate(all="raise"):
        folded, image = box.wrap([[0.5, 3.0, 0.0]])
    assert folded.tolist() == [[3.5, 3.0, 0.0]] and image.tolist() == [[-1, 0, 0]]


@pytest.mark.parametrize(
    "corners",
    [((0, 0), (1, 1, 1)), ((0, 0), (1, 0)), ((0,), (1,)), ((0, 0, 0), (1, 1, 0)), ((0, 0), (1, 1), (True,) * 3), (0.0, 1.0)],
)
def test_other_corners_are_refused(corners):
    with pytest.raises(SceneError, match=r"box: .* two"):
        Box(*corners)


# -- mass and inertia -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("shape", "mass", "inertia"),
    [("sphere", 4.0 / 3.0 * pi * 0.125, 0.4), ("disc", pi * 0.25, 0.5)],
)
def test_mass_and_inertia_follow_from_the_shape(shape, mass, inertia):
    sim = plane(shape=shape)
    sim.add_grains([(1, 1, 0), (3, 3, 0)], 0.5)
    assert sim.grains.mass == pytest.approx(mass) and sim.grains.inertia == pytest.approx(inertia * mass * 0.25)
    sim.grains.mass *= 3.0
    sim.prepare()
    assert sim.grains.inertia == pytest.approx(inertia * 3.0 * mass * 0.25), "of grains whose mass was written"


def test_an_inlet_lets_in_discs_by_their_mass():
    sim = plane(shape="disc")
    feed = bc.Feed(0.5, rate=float("inf"), total=5.0 * pi * 0.25, by="mass")
    sim.actions.append(bc.Inlet("rain", ((1, 1, 0), (5, 5, 0)), feed, bc.At(1)))
    sim.run(2)
    assert sim.notes["inlets"]["rain"]["grains"] == 5 and sim.notes["inlets"]["rain"]["mass"] == pytest.approx(5.0 * pi * 0.25)
    assert not sim.grains.position[:, 2].any()


def test_the_time_step_of_discs_is_that_of_their_mass():
    stable = []
    for shape in ("sphere", "disc"):
        sim = plane(shape=shape)
        sim.add_grains([(1, 1, 0)], 0.5)
        sim.prepare()
        stable.append(sim.stable_dt)
    assert stable[1] / stable[0] == pytest.approx(sqrt(pi * 0.25 / (4.0 / 3.0 * pi * 0.125)))


# -- what leads out of the plane ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("field", "value", "told"),
    [
        ("position", (1, 1, 1e-9), r"grain 0 at .*1e-09\] lies outside the box"),
        ("velocity", (1, 0, -1e-9), r"grain 0: velocity = \[1.0, 0.0, -1e-09\] \[length/time\] must have no z component"),
        ("omega", (0, 1e-9, 1), r"grain 0: omega = .* \[1/time\] must have a z component only: the box has two dimensions"),
        ("omega", (1, 0, 0), "grain 0: omega"),
    ],
)
def test_grains_that_would_leave_the_plane_are_refused(field, value, told):
    sim = plane()
    sim.add_grains(**{"position": [(1, 1, 0)], "radius": 0.5, field: [value]})
    with pytest.raises(SceneError, match=told):
        sim.run(1)
    sim = plane()
    sim.add_grains([(1, 1, 0)], 0.5)
    sim.run(1)
    setattr(sim.grains, field, value)
    with pytest.raises(SceneError, match=told):
        sim.run(1)


def test_gravity_stays_in_the_plane():
    with pytest.raises(SceneError, match=r"gravity at t = 0: \(0, 0, -9.81\) .*no z component: the box has two dimensions"):
        plane(gravity=(0, 0, -9.81))
    sim = plane(gravity=lambda t: (0.0, 0.0, 0.0 if t < 0.0095 else 1.0))
    sim.add_grains([(1, 1, 0)], 0.5)
    with pytest.raises(SceneError, match=r"gravity at t = 0\.01: .*no z component"):
        sim.run(20)
    sim.gravity = (0.0, 0.0, 1.0)
    with pytest.raises(SceneError, match="no z component"):
        sim.present_gravity  # noqa: B018
    with pytest.raises(SceneError, match="no z component"):
        sim.run(1)


@pytest.mark.parametrize(
    ("wall", "told"),
    [
        (bc.Plane((0, 0, 0), (0, 1, 1e-9)), r"wall 0 \(plane\): its normal .* leans along z, where the box of two dimensions"),
        (bc.Plane((0, 0, 1), (0, 1, 0)), r"point = \[0.0, 0.0, 1.0\] \[length\] and velocity = .* must have no z component"),
        (bc.Plane((0, 0, 0), (0, 1, 0), velocity=(0, 0, 1)), r"velocity = \[0.0, 0.0, 1.0\] .* must have no z component"),
        (bc.Plane((0, 0, 0), (0, 1, 0), omega=(0, 1, 0)), r"omega = \[0.0, 1.0, 0.0\] \[1/time\] a z component only"),
        (bc.Cylinder((0, 0, 0), (0, 1, 0), 2.0), "it is round across z"),
        (bc.Sphere((0, 0, 0), 2.0), "it is round across z"),
        (bc.Cone((0, 0, 0), (0, 0, 1), 1.0, 2.0, 1.0), "it is round across z"),
    ],
)
def test_walls_that_are_not_across_the_plane_are_refused(wall, told):
    with pytest.raises(SceneError, match=told):
        plane().add_wall(wall)


def test_a_wall_that_is_turned_out_of_the_plane_is_refused():
    sim = plane()
    floor = sim.add_wall(bc.Plane((0, 0, 0), (1, 1, 0), omega=(0, 0, 1)))
    sim.add_wall(bc.Cylinder((3, 3, 0), (0, 0, -1), 3.0, omega=(0, 0, 2)))
    sim.run(1)
    floor.normal = (1, 1, 1)
    with pytest.raises(SceneError, match="leans along z"):
        sim.run(1)


def test_what_takes_grains_out_of_the_plane_ends_the_run():
    sim = plane()
    sim.add_wall(bc.Plane((0, 0.05, 0), (0, 1, 0))).control = Vibration((0, 0, 1.0), frequency=1.0)
    sim.add_grains([(1, 0.5, 0)], 0.5)
    with pytest.raises(LostGrainError, match=r"step 1: grain 0: force = .* must have no z component: .* two dimensions"):
        sim.run(50)


@pytest.mark.parametrize("what", ["a contact law", "a bond law"])
@pytest.mark.parametrize("stepped", [True, False], ids=["single steps", "many in one call"])
def test_what_turns_grains_out_of_the_plane_ends_the_run(what, stepped):
    if what == "a contact law":

        @bc.law(properties={"kn": "force/length"}, couple=True)
        def rolls(overlap, kn):
            return kn * overlap, (0.0, 0.0, 0.0), (1e-3, 0.0, 0.0)

        sim = bc.Simulation(bc.Box((0, 0), (6, 6)), rolls, bc.Material("soft", density=1.0, kn=10.0), 1e-3, threads=1)
    else:

        @bc.bond()
        def bends(stretch):
            return -100.0 * stretch, (0.0, 0.0, 0.0), (0.0, 1e-3, 0.0), 0

        sim = plane(bonds=bc.Bond(bends))
    sim.clock.by_phase = stepped
    sim.add_grains([(2, 3, 0), (2.99, 3, 0)], 0.5)
    if what == "a bond law":
        sim.install_bonds()
    with pytest.raises(LostGrainError, match=r"(omega|torque) = .* must have a z component only: the box has two dimensions"):
        sim.run(20)


def test_discs_need_two_dimensions_and_a_shape_a_name():
    with pytest.raises(SceneError, match=r"shape = 'disc' needs a box of two dimensions"):
        simulation(shape="disc")
    for shape in ("discs", None, 2):
        with pytest.raises(SceneError, match=r"shape = .* must be 'sphere' or 'disc'"):
            plane(shape=shape)
    with pytest.raises(SceneError, match="shape of a simulation cannot be replaced"):
        plane().shape = "disc"


def test_a_state_of_another_dimension_or_shape_is_refused(tmp_path):
    sim = plane(shape="disc")
    sim.add_grains([(1, 1, 0)], 0.5)
    sim.run(3)
    save(sim, tmp_path / "c.h5")
    restore(plane(shape="disc"), tmp_path / "c.h5")
    with pytest.raises(CheckpointError, match="another scene: shape is 'disc' there and 'sphere' here"):
        restore(plane(), tmp_path / "c.h5")
    save(plane(), tmp_path / "spheres.h5")
    with pytest.raises(CheckpointError, match="another scene: box dimension is 2 there and 3 here"):
        restore(simulation(bc.Box((0, 0, 0), (6, 6, 6))), tmp_path / "spheres.h5")
