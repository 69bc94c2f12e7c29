"""What users do wrong, or nobody thought of: a clear error, or it works."""

import warnings

import numpy as np
import pytest

import barchan as bc
from barchan.actions import Change, Feed, Inlet, mark_places, remove_where
from barchan.checkpoint import collect, restore, save
from barchan.compare import differences
from barchan.errors import CheckpointError, LawError, SceneError
from barchan.experiments.compression.parameters import Compression
from barchan.experiments.repose.parameters import Repose
from barchan.experiments.repose.setup import build
from barchan.measure import EnergyAccount, strain
from barchan.packing import Preparation, compact, press
from barchan.parallel import virtual_ranks
from barchan.walls import Control, Massive, Room, Servo

STICKY = {"youngs_modulus": 1e5, "poisson_ratio": 0.3, "restitution": 0.5, "friction": 0.4, "work_of_adhesion": 1.0}
SAND = {"kn": 1e4, "kt": 3e3, "gamma_n": 10.0, "friction": 0.5}


def cell(grains=True, law=bc.laws.linear, **properties):
    """Eight grains between six walls."""
    stuff = bc.Material("sand", density=1000.0, **(properties or SAND))
    sim = bc.Simulation(bc.Box((-1, -1, -1), (2, 2, 2)), law, stuff, dt=1e-5, threads=1)
    for axis in range(3):
        for place, side in ((0.0, 1.0), (1.0, -1.0)):
            sim.add_wall(bc.Plane(np.where(np.arange(3) == axis, place, 0.5), side * np.eye(3)[axis]))
    if grains:
        places = np.stack(np.meshgrid(*3 * [[0.3, 0.7]]), axis=-1).reshape(-1, 3)
        sim.add_grains(places, 0.1, velocity=np.random.default_rng(1).normal(size=places.shape))
    return sim


def test_a_law_that_reaches_beyond_touching_may_begin_without_grains_and_end_without():
    sim = cell(False, bc.laws.jkr, **STICKY)
    sim.actions.append(Inlet("rain", ((0.3, 0.3, 0.3), (0.7, 0.7, 0.7)), Feed(0.05, 1e5, 3), bc.Every(5)))
    sim.run(20)
    assert sim.grains.n > 0
    sim.actions.clear()
    remove_where(sim, lambda p: p[:, 2] > -1.0)
    sim.run(20)


def made(reach=None, energy=None):
    @bc.law(properties={"kn": "force/length"}, history={"m": 1}, reach=reach, energy=energy)
    def spring(overlap, kn, m):
        return kn * overlap, (0.0, 0.0, 0.0), m

    return spring


def fails(kn):
    return 0.1 / (kn - 1e4)


def falls(radius_eff):
    return 0.1 / radius_eff


def starred(*kn):
    return 0.1


def one_number(overlap, kn):
    return 0.5 * kn * overlap * overlap


def infinite(overlap):
    return overlap / (overlap - overlap), 0.0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"reach": fails}, r"its reach\(\) fails .*ZeroDivisionError"),
        ({"reach": falls}, r"its reach\(\) falls from .* as radius_eff grows"),
        ({"reach": starred}, r"argument\(s\) \['\*kn'\] of its reach\(\) must be plain names"),
        ({"reach": lambda kn: 0.1}, "'<lambda>' must be a plain function"),
        ({"energy": one_number}, r"its energy\(\) must return two finite numbers"),
        ({"energy": infinite}, r"its energy\(\) must return two finite numbers"),
    ],
)
def test_a_reach_or_an_energy_that_cannot_be_is_refused_before_the_run(options, message):
    with pytest.raises(LawError, match=message):
        cell(law=made(**options), kn=1e4).run(1)


class Pushes(Control):
    """A user's."""

    def __init__(self, speed):
        self.speed = speed

    def steer(self, wall, sim):
        wall.push(self.speed) if np.ndim(self.speed) == 0 else wall.drive(self.speed)


@pytest.mark.parametrize("speed", [np.nan, np.inf, "1 m/s", (0.0, np.nan, 0.0), (0.0, 0.0)], ids=str)
@pytest.mark.parametrize("wall", [lambda: bc.Plane((0, 0, -0.5), (0, 0, 1)), lambda: bc.Sphere((0.5, 0.5, 0.5), 1.0)])
def test_a_control_that_gives_no_velocity_stops_the_run(speed, wall):
    sim = cell()
    sim.add_wall(wall()).control = Pushes(speed)
    with pytest.raises(SceneError, match=r"(push|drive).*\[length/time\]"):
        sim.run(5)
    assert sim.step_number == 0


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Servo(None, force=1.0), "Servo: max_speed = None"),
        (lambda: Servo(1.0, stress=1.0, area=-1.0), r"Servo: area = -1.0 .* > 0"),
        (lambda: setattr(cell().walls[0], "control", Servo), "must be an object with a method steer"),
    ],
)
def test_what_is_no_control_is_refused(make, message):
    with pytest.raises(SceneError, match=message):
        make()


def test_a_target_that_fails_once_leaves_no_trace():
    def final(fails):
        sim, failed = cell(), []

        def target(sim):
            if fails and sim.step_number == 5 and not failed:
                failed.append(True)
                raise ValueError("once")
            return 5.0

        sim.walls[4].control, sim.walls[5].control = Massive(1.0, force=3.0), Massive(1.0, force=target)
        try:
            sim.run(10)
        except ValueError:
            sim.run(10 - sim.step_number)
        return [wall.control.moving for wall in sim.walls[4:]], collect(sim).fields["position"].tolist()

    assert final(True) == final(False)


class RunsAgain:
    due = bc.At(2)

    def apply(self, sim):
        sim.run(1)


def test_an_action_cannot_run_the_simulation():
    sim = cell()
    sim.actions.append(RunsAgain())
    with pytest.raises(SceneError, match="step 2: an action cannot call run"):
        sim.run(5)


def test_law_box_and_materials_are_there_to_stay():
    for name, value in (("law", bc.laws.silbert), ("box", bc.Box((0, 0, 0), (1, 1, 1))), ("materials", None)):
        with pytest.raises(SceneError, match=f"{name} of a simulation cannot be replaced"):
            setattr(cell(), name, value)


def test_two_changes_of_one_name_are_refused():
    sim = cell()
    sim.actions += [Change("soften", bc.At(k), lambda sim: None) for k in (2, 4)]
    with pytest.raises(SceneError, match=r"change .soften.: two changes in sim\.actions have this name"):
        sim.run(5)


def test_a_checkpoint_with_changes_of_no_name_is_refused(tmp_path):
    sim = cell()
    sim.notes["changes"] = [["x"]]
    save(sim, tmp_path / "c.h5")
    with pytest.raises(CheckpointError, match="are no list of names"):
        restore(cell(False), tmp_path / "c.h5")


def turning():
    sim = cell()
    sim.walls[4].omega = (0.1, 0.0, 0.0)
    return sim


def crossed():
    sim = cell()
    sim.walls[4].point = (0.5, 0.5, 1.5)
    return sim


def begun(begin):
    sim = cell()
    with pytest.raises(bc.BarchanError, match="not at rest"):
        begin(sim)
    return sim


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Room(turning()), r"Room: the plane at z = 0 \[length\] turns with omega"),
        (lambda: Room(crossed()), "Room: the planes across z, at 1.5 and 1 .* no room between them"),
        (lambda: press(cell(), 1.0, Preparation(look=100, most=50)), "press: look = 100 .* at most most = 50"),
        (lambda: press(cell(), 1.0, Preparation(resume=5)), "press: resume = 5 must be the path of a checkpoint"),
    ],
)
def test_rooms_and_preparations_that_cannot_be_are_refused(make, message):
    with pytest.raises(SceneError, match=message):
        make()


@pytest.mark.parametrize(
    "other", [lambda sim: press(sim, 2.0), lambda sim: compact(sim, 0.2, "growth"), lambda sim: compact(sim, 0.2, "walls")]
)
def test_only_the_preparation_that_was_begun_goes_on(other):
    sim = begun(lambda sim: press(sim, 1.0, Preparation(look=50, most=50)))
    for wall in sim.walls:
        wall.control = None
    with pytest.raises(SceneError, match=r"since step 0 another sample is being prepared: press 1\.0"):
        other(sim)


@pytest.mark.parametrize("of", [remove_where, lambda sim, region: mark_places(sim, "here", region)])
def test_a_region_is_asked_by_ranks_with_grains_only_and_must_be_a_function(of):
    def program():
        sim = cell()
        sim.remove(sim.grains.id[sim.grains.position[:, 0] > 0.5])
        of(sim, lambda places: [bool(np.vectorize(lambda x: x > 0.0)(place[0])) for place in places])
        with pytest.raises(SceneError, match="= 5 must be a function of positions"):
            of(sim, 5)

    virtual_ranks(2, program)


def test_a_field_of_the_users_is_no_reference():
    sim = cell()
    sim.add_field("colour", 4, default=1.0)
    with pytest.raises(SceneError, match="'colour' is that of another field"):
        mark_places(sim, "colour")
    with pytest.raises(SceneError, match="no places were marked under the name 'colour'"):
        strain(sim, "colour")


def test_an_account_of_a_restored_state_needs_its_contacts(tmp_path):
    sim = cell()
    sim.writers.append(EnergyAccount())
    sim.run(3)
    save(sim, tmp_path / "c.h5")
    again = cell(False)
    restore(again, tmp_path / "c.h5")
    with pytest.raises(SceneError, match="call prepare"):
        EnergyAccount().compute(again)


@pytest.mark.parametrize("law", [bc.laws.jkr, bc.laws.linear], ids=lambda law: law.name)
def test_what_a_change_of_materials_gives_to_contacts_counts_as_if_it_had_been_there(law):
    """Neither parting nor the residual takes it up."""
    values = SAND | {"kn": 1e3, "kt": 3e2} if law is bc.laws.linear else STICKY | {"work_of_adhesion": 50.0}
    changed = {"kn": 2e3} if law is bc.laws.linear else {"work_of_adhesion": 5.0}
    sim = bc.Simulation(bc.Box((0, 0, 0), (4, 4, 4)), law, bc.Material("a", density=1000.0, **values), dt=1e-5, threads=1)
    sim.add_grains([(1.51, 2, 2), (2.49, 2, 2)], 0.5)
    sim.writers.append(EnergyAccount())
    sim.actions.append(Change("other", bc.At(51), lambda sim: sim.materials.set_pair("a", "a", **changed)))
    sim.run(50)
    before = sim.writers[0].compute(sim).elastic
    sim.run(100)
    account = sim.writers[0].compute(sim)
    assert abs(account.elastic - before) > 0.1 * abs(before)
    assert abs(account.residual) < 1e-4 * account.largest
    assert abs(account.parting) < 1e-4 * account.largest


def far(kn):
    return 0.1


@pytest.mark.parametrize("at_wall", [False, True])
def test_the_normal_force_of_a_contact_that_outlasts_touching_is_integrated_where_the_law_tells_no_energy(at_wall):
    sim = bc.Simulation(
        bc.Box((0, 0, 0), (4, 4, 4)), made(reach=far), bc.Material("a", density=1.0, kn=100.0), dt=1e-3, threads=1
    )
    if at_wall:
        sim.add_wall(bc.Plane((1.01, 0, 0), (1, 0, 0)))
        sim.add_grains([(1.5, 2, 2)], 0.5, velocity=(0.3, 0, 0))
    else:
        sim.add_grains([(1.5, 2, 2), (2.49, 2, 2)], 0.5, velocity=[(-0.2, 0, 0), (0.2, 0, 0)])
    account = EnergyAccount()
    sim.writers.append(account)
    sim.run(60)
    place = sim.grains.sorted_by_id("position")[:, 0]
    overlap = 1.51 - place[0] if at_wall else 1.0 - (place[1] - place[0])
    assert overlap < -0.005
    account.compute(sim)
    assert account.elastic == pytest.approx(50.0 * overlap * overlap, rel=1e-9)
    assert abs(account.parting) < 1e-3 * account.largest


@pytest.mark.parametrize("scene", [lambda: Compression(stress_rate=1e-300), lambda: Repose(lift_speed=5e-324)])
def test_a_rate_so_low_that_no_number_counts_its_steps_is_refused(scene):
    with pytest.raises(ValueError, match="greater than or equal to"):
        scene()


def test_a_floor_of_too_many_grains_is_refused():
    with pytest.raises(SceneError, match="this machine has"):
        build(Repose(floor=1e4))


def test_the_same_bits_after_a_preparation_is_refused_and_goes_on():
    def final(meddle):
        sim, how = cell(), Preparation(look=50, most=100)
        for most in (100, 200):
            with warnings.catch_warnings(), pytest.raises(bc.BarchanError, match="not at rest"):
                warnings.simplefilter("ignore")
                press(sim, 1.0, how._replace(most=most))
            if meddle:
                with pytest.raises(SceneError, match="another sample"):
                    press(sim, 2.0, how)
        return collect(sim)

    assert differences(final(False), final(True)) == []
