"""Walls that follow a path or a force: closed forms, signs, what is refused, and the same bits on ranks and after a resume."""

import json
import warnings

import numpy as np
import pytest
from fuzzing import write_state
from scenes import fingerprint, simulation

import barchan as bc
from barchan.checkpoint import collect, read_state, restore, save
from barchan.compare import differences
from barchan.errors import CheckpointError, SceneError
from barchan.parallel import virtual_ranks
from barchan.walls import Control, Massive, Path, Proportional, Servo, Vibration, between

pytestmark = pytest.mark.filterwarnings("ignore:step .* overlap by more than")


def test_a_wall_follows_a_path_exactly():
    """Where the function says, for any time, whatever the step; the velocity is that of the step."""
    sim = simulation(dt=1e-3)
    wall = sim.add_wall(bc.Plane((0, 0, 1), (0, 0, 1)))
    wall.control = Path(lambda time: (np.sin(time), time**2, 0.1 * np.cos(3 * time)))
    sim.add_grains([(5, 5, 15)], 0.5)
    for _ in range(5):
        sim.run(400)
        expected = (np.sin(sim.time), sim.time**2, 1.0 + 0.1 * (np.cos(3 * sim.time) - 1.0))
        assert wall.point == pytest.approx(expected, abs=1e-13)


def test_a_wall_vibrates():
    sim = simulation(dt=1e-3)
    wall = sim.add_wall(bc.Plane((0, 0, 1), (0, 0, 1)))
    wall.control = Vibration((0, 0, 0.2), frequency=2.5)
    sim.add_grains([(5, 5, 15)], 0.5)
    sim.run(100)  # a quarter of a period
    assert wall.point == pytest.approx([0, 0, 1.2], abs=1e-13)
    assert wall.velocity[2] == pytest.approx(0.0, abs=0.03)


def lid(control, overlap=0.02, **options):
    """A frozen grain under a lid that comes from above: the force is kn times the overlap, whatever moves."""
    sim = simulation(properties={"kn": 1000.0, "kt": 300.0, "gamma_n": 20.0, "friction": 0.0}, **{"dt": 1e-4, **options})
    sim.add_wall(bc.Plane((0, 0, 0), (0, 0, 1)))
    wall = sim.add_wall(bc.Plane((5, 5, 2.0 - overlap), (0, 0, -1)))
    sim.add_grains([(5, 5, 1.0)], 0.999)
    wall.control = control
    return sim, wall


@pytest.mark.nojit
def test_the_proportional_controller_is_that_of_the_paper():
    """v = G (F_target - F_actual): in the first step of the wall, and its sign: a wall that is pressed too little moves on."""
    sim, wall = lid(Proportional(gain=0.01, force=30.0))
    sim.prepare()
    pressed = wall.pressing
    assert pressed == pytest.approx(1000.0 * (0.999 - 0.98), rel=1e-9)
    assert wall.force == pytest.approx([0, 0, pressed]), "grains push it up"
    sim.run(1)
    assert wall.velocity == pytest.approx([0, 0, -0.01 * (30.0 - pressed)], rel=1e-12)
    assert wall.point[2] == pytest.approx(1.98 - 1e-4 * 0.01 * (30.0 - pressed), rel=1e-14)


def test_rigid_wall_example_2_of_the_paper():
    """variable targetstress equal 1000.0*step*dt
    variable targetFz equal -${targetstress}*(f_yright[2]-f_yleft[1])*(f_xright[2]-f_xleft[1])
    fix wallname all wall/gran ... zplane NULL 0.1 stresscontrol v_targetFz ${gain}

    The target is the force of the wall on the grains, along z: less than nothing for a wall above. That of ``Proportional`` is
    the force with which grains press on it: the same number without the sign."""
    sim = simulation(bc.Box((-1, -1, -1), (2, 2, 2)), dt=1e-4)
    xleft, xright = (sim.add_wall(bc.Plane((x, 0, 0), (n, 0, 0))) for x, n in ((0.0, 1), (0.3, -1)))
    yleft, yright = (sim.add_wall(bc.Plane((0, y, 0), (0, n, 0))) for y, n in ((0.0, 1), (0.2, -1)))
    sim.add_wall(bc.Plane((0, 0, 0), (0, 0, 1)))
    top = sim.add_wall(bc.Plane((0, 0, 0.1), (0, 0, -1)))
    gain = 0.002

    def target_fz(sim):
        targetstress = 1000.0 * sim.step_number * sim.dt
        return -targetstress * (yright.point[1] - yleft.point[1]) * (xright.point[0] - xleft.point[0])

    top.control = Proportional(gain, force=lambda sim: -target_fz(sim))
    yright.velocity = (0, 0.5, 0)
    sim.add_grains([(0.1, 0.1, 0.049)], 0.0495)
    place, yplace = 0.1, 0.2
    for _ in range(50):
        sim.prepare()
        force_on_grains = -top.force[2]
        velocity = gain * (target_fz(sim) - force_on_grains)  # of the paper, along z
        place, yplace = place + 1e-4 * velocity, yplace + 1e-4 * 0.5
        sim.run(1)
        assert top.velocity[2] == pytest.approx(velocity, rel=1e-12) and top.point[2] == pytest.approx(place, rel=1e-14)
        assert yright.point[1] == pytest.approx(yplace, rel=1e-14)
    assert target_fz(sim) == pytest.approx(-1000.0 * 50e-4 * yplace * 0.3)


@pytest.mark.nojit
def test_stress_is_force_over_the_area_between_walls():
    sim = simulation()
    walls = [
        sim.add_wall(bc.Plane(p, n))
        for p, n in (((1, 0, 0), (1, 0, 0)), ((4, 9, 9), (-1, 0, 0)), ((0, 2, 0), (0, 1, 0)), ((0, 9, 0), (0, -1, 0)))
    ]
    assert between(*walls[:2])(sim) == 3.0 and between(*walls)(sim) == 21.0
    assert Servo(1.0, stress=lambda sim: 5.0 + sim.time, area=between(*walls)).target(sim) == 105.0
    assert Servo(1.0, stress=2.0, area=3.0).target(sim) == 6.0


@pytest.mark.parametrize("overlap", [-0.5, 0.001, 0.1])
def test_the_servo_finds_a_force_from_afar_from_below_and_from_above(overlap):
    sim, wall = lid(Servo(max_speed=2.0, force=30.0), overlap, dt=1e-3)
    sim.run(20_000)
    assert wall.pressing == pytest.approx(30.0, rel=1e-3) and abs(wall.velocity[2]) < 1e-3


@pytest.mark.nojit
def test_the_servo_knows_stiffness_and_viscosity_of_what_it_touches():
    """Of a linear spring and dashpot they are kn and gamma_n m; of Hertz without dashpot the slope 2 E* sqrt(R overlap)."""
    sim, wall = lid(None)
    sim.materials.set_pair("a", "a", gamma_n=7.0)
    sim.prepare()
    mass = sim.grains.mass[0]
    assert wall.response.stiffness == pytest.approx(1000.0, rel=1e-9) and wall.response.viscosity == pytest.approx(
        7.0 * mass, rel=1e-9
    )
    glass = bc.Material("g", density=1.0, youngs_modulus=1e5, poisson_ratio=0.25, friction=0.0)
    sim = bc.Simulation(bc.Box((0, 0, 0), (20, 20, 20)), bc.laws.hertz_mindlin, glass, dt=1e-5)
    wall = sim.add_wall(bc.Plane((0, 0, 1), (0, 0, 1)))
    sim.add_grains([(5, 5, 1.48)], 0.5)
    sim.prepare()
    modulus = 1e5 / (2.0 * (1.0 - 0.25**2))
    assert (
        wall.response.stiffness == pytest.approx(2.0 * modulus * (0.5 * 0.02) ** 0.5, rel=1e-3) and wall.response.viscosity == 0.0
    )


def test_a_wall_is_no_faster_than_allowed():
    sim, wall = lid(Proportional(gain=100.0, force=1e6, max_speed=0.25), overlap=-3.0)
    sim.run(10)
    assert wall.velocity[2] == -0.25


def test_a_wall_with_mass_falls_and_reaches_its_terminal_speed():
    """x = F t^2 / 2 m + O(dt); with damping v = F / c (1 - exp(-c t / m))."""
    sim, wall = lid(Massive(mass=2.0, force=6.0), overlap=-9.0, dt=1e-3)
    sim.run(1000)
    assert 11.0 - wall.point[2] == pytest.approx(0.5 * 3.0 * 1.0, rel=2e-3) and wall.velocity[2] == pytest.approx(-3.0, rel=1e-9)
    sim, wall = lid(Massive(mass=2.0, damping=4.0, force=6.0), overlap=-9.0, dt=1e-3)
    sim.run(1000)
    assert wall.velocity[2] == pytest.approx(-1.5 * (1.0 - np.exp(-2.0)), rel=1e-5)


@pytest.mark.parametrize("inside", [True, False])
def test_a_cylinder_is_controlled_by_its_radius(inside):
    """Four grains in or around it, each frozen by symmetry between it and another cylinder."""
    sim = simulation(properties={"kn": 1000.0, "kt": 300.0, "friction": 0.0, "gamma_n": 5.0}, dt=1e-4)
    inner, outer = (sim.add_wall(bc.Cylinder((10, 10, 10), (0, 0, 1), r, i)) for r, i in ((3.0, False), (5.0, True)))
    wall = outer if inside else inner
    wall.control = Servo(max_speed=1.0, force=100.0)
    sim.add_grains([(14, 10, 10), (6, 10, 10), (10, 14, 10), (10, 6, 10)], 1.0)
    sim.run(20_000)
    assert wall.pressing == pytest.approx(100.0, rel=1e-3) and outer.radius - inner.radius == pytest.approx(2.0 - 0.05, rel=1e-4)
    assert abs(wall.force).max() < 1e-9 and wall.contacts == 4


def test_a_sheared_wall_keeps_its_slip_under_control():
    sim, wall = lid(Servo(max_speed=1.0, force=30.0))
    wall.velocity = (0.25, 0.5, -9.0)
    sim.run(50)
    assert wall.velocity[:2].tolist() == [0.25, 0.5] and wall.point[:2] == pytest.approx([5 + 50e-4 * 0.25, 5 + 50e-4 * 0.5])


def cell(**options):
    """Grains in a cell of which every wall moves in another way."""
    sim = simulation(bc.Box((-2, -2, -2), (9, 9, 9)), dt=3e-4, gravity=(0, 0, -3.0), **options)
    sim.max_overlap = 1.0
    random = np.random.default_rng(5)
    cells = np.stack(np.meshgrid(*3 * [np.arange(4)], indexing="ij"), axis=-1).reshape(-1, 3)
    sim.add_grains(cells + 1.0 + random.uniform(-0.05, 0.05, cells.shape), random.uniform(0.4, 0.5, len(cells)))
    side = sim.add_wall(bc.Cylinder((2.5, 2.5, 0), (0, 0, 1), 2.55, omega=(0, 0, 2.0)))
    floor = sim.add_wall(bc.Plane((0, 0, 0.55), (0, 0, 1), omega=(0.1, 0, 0)))
    top = sim.add_wall(bc.Plane((0, 0, 4.45), (0, 0, -1)))
    ball = sim.add_wall(bc.Sphere((2.4, 2.6, 2.5), 0.3, inside=False))
    cone = sim.add_wall(bc.Cone((2.5, 2.5, 1.2), (0, 0, 1), 1.0, 2.0, 1.0))
    side.control = Servo(max_speed=2.0, stress=lambda sim: 10.0 + 100.0 * sim.time, area=lambda sim: 20.0 * side.radius)
    top.control = Massive(mass=5.0, damping=1.0, force=20.0)
    floor.control = Vibration((0.05, 0, 0.02), 5.0)
    ball.control = Proportional(1e-3, force=5.0, max_speed=3.0)
    cone.control = Path(lambda time: (0, 0, 0.1 * time))
    return sim


def cell_after(path, *steps):
    sim = cell()
    for number, count in enumerate(steps):
        if number:
            sim = cell_restored(path)
        sim.run(count)
        save(sim, path)
    return collect(sim), [json.dumps([wall.state(), wall.load]) for wall in sim.walls]


def cell_restored(path):
    sim = cell()
    sim.remove(sim.grains.id.copy())
    restore(sim, path)
    return sim


@pytest.mark.parametrize("ranks", [1, 2, 4])
def test_controlled_walls_have_the_same_bits_on_any_ranks_and_after_a_resume(ranks, tmp_path):
    whole = cell_after(tmp_path / "whole.h5", 120)
    parts = virtual_ranks(ranks, cell_after, tmp_path / "parts.h5", 50, 70)
    assert (tmp_path / "whole.h5").read_bytes() == (tmp_path / "parts.h5").read_bytes()
    assert all(walls == whole[1] for _, walls in parts)
    assert all(json.loads(one)[1][-1] > 0 for one in whole[1]), "grains touch them"
    if ranks == 1:
        assert differences(parts[0][0], whole[0]) == []


def test_a_controlled_cell_never_misses_a_contact():
    seldom, always = cell(), cell()
    always.staleness.also_when = lambda step: True
    for sim in (seldom, always):
        sim.run(150)
    assert fingerprint(seldom) == fingerprint(always)


def test_a_checkpoint_of_another_control_is_refused(tmp_path):
    save(cell(), tmp_path / "c.h5")
    sim = cell()
    sim.remove(sim.grains.id.copy())
    sim.walls[3].control = Proportional(2e-3, force=5.0, max_speed=3.0)
    with pytest.raises(CheckpointError, match=r"wall 3 is .* 'Proportional', .*0.001.* there and .*0.002"):
        restore(sim, tmp_path / "c.h5")
    sim.walls[3].control = Proportional(1e-3, force=lambda sim: 5.0, max_speed=3.0)
    with pytest.raises(CheckpointError, match="wall 3 is"):
        restore(sim, tmp_path / "c.h5")


class Nudge(Control):
    """A user's own: one length a step for some steps, counted."""

    memory = ("left",)

    def __init__(self, left):
        self.left = left

    def steer(self, wall, sim):
        """Push as long as there is something left."""
        wall.push(1.0 if self.left > 0 else 0.0)
        self.left -= 1


@pytest.mark.nojit
def test_a_control_of_ones_own_with_a_memory(tmp_path):
    def scene():
        sim, wall = lid(Nudge(30), overlap=-3.0)
        return sim, wall

    sim, wall = scene()
    sim.run(20)
    save(sim, tmp_path / "c.h5")
    sim.run(20)
    again, other = scene()
    again.remove(again.grains.id.copy())
    restore(again, tmp_path / "c.h5")
    again.run(20)
    assert other.point.tobytes() == wall.point.tobytes() and other.control.left == wall.control.left == -10
    assert wall.point[2] == pytest.approx(5.0 - 30e-4)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Servo(1.0), "Servo needs a target: either force .* or stress .* and area"),
        (lambda: Servo(1.0, force=1.0, stress=1.0, area=1.0), "needs a target"),
        (lambda: Servo(1.0, stress=1.0), "needs a target"),
        (lambda: Servo(-1.0, force=1.0), r"Servo: max_speed = -1.0 \[length/time\] must be a finite number > 0"),
        (lambda: Proportional(0.0, force=1.0), "Proportional: gain = 0.0"),
        (lambda: Massive(0.0, force=1.0), "Massive: mass = 0.0"),
        (lambda: Massive(1.0, -1.0, force=1.0), "Massive: damping = -1.0"),
        (lambda: Servo(1.0, force=np.nan), r"Servo: force = nan \[force\] must be a finite number"),
        (
            lambda: Servo(1.0, stress="100 kPa", area=1.0),
            r"Servo: stress = '100 kPa' \[force/length\^2\] must be a finite number",
        ),
        (lambda: Servo(1.0, stress=1.0, area=np.inf), "Servo: area = inf"),
        (lambda: Servo(1.0, force=1.0, start=-1), r"Servo: start = -1 \[steps\] must be a whole number >= 0"),
        (lambda: Servo(1.0, force=1.0, start=1.5), "Servo: start = 1.5"),
        (lambda: Path(3.0), "Path: offset = 3.0 must be a function of time"),
        (lambda: Vibration((0, 0), 1.0), "Vibration: amplitude"),
        (lambda: Vibration((0, 0, 1), -1.0), "Vibration: frequency = -1.0"),
        (lambda: setattr(bc.Plane((0, 0, 0), (0, 0, 1)), "control", 3.0), "plane: control = 3.0 must be an object"),
    ],
)
def test_what_is_no_control_is_refused(make, message):
    with pytest.raises(SceneError, match=message):
        make()


@pytest.mark.nojit
def test_a_target_that_is_no_number_stops_the_run_before_the_step_and_says_when():
    sim, _ = lid(Servo(1.0, force=lambda sim: np.nan if sim.step_number == 7 else 1.0))
    with pytest.raises(SceneError, match=r"Servo, t = 0.0007: force = .*nan.* \[force\] must be a finite number"):
        sim.run(20)
    assert sim.step_number == 7
    sim.walls[1].control = None
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # no step was broken off
        sim.run(1)


def test_a_control_with_a_memory_belongs_to_one_wall():
    sim, wall = lid(Servo(1.0, force=30.0))
    sim.walls[0].control = wall.control
    with pytest.raises(SceneError, match="walls 0 and 1 share one Servo, whose memory is that of one wall; give each its own"):
        sim.run(1)
    for one in sim.walls:
        one.control = Proportional(1e-3, force=30.0) if one is wall else wall.control
    sim.run(1)


def test_a_control_begins_at_its_first_step():
    """Before, many steps are made in one call where nothing else is due, and the wall moves on as it did."""
    sim, wall = lid(Servo(max_speed=2.0, force=30.0, start=40), overlap=-1.0)
    wall.velocity = (0.0, 0.0, -0.5)
    sim.run(40)
    assert wall.point[2] == pytest.approx(3.0 - 40e-4 * 0.5, rel=1e-14)
    sim.run(10)
    assert wall.point[2] == pytest.approx(3.0 - 40e-4 * 0.5 - 10e-4 * 2.0, rel=1e-14)


@pytest.mark.parametrize(
    ("number", "name", "value"), [(0, "radius", -3.0), (0, "radius", 0.0), (4, "length", -1.0), (4, "radius_low", -0.5)]
)
def test_a_checkpoint_with_a_wall_that_cannot_be_is_refused(number, name, value, tmp_path):
    save(cell(), tmp_path / "c.h5")
    state = read_state(tmp_path / "c.h5")
    state.about["walls"][number][name] = value
    write_state(state, tmp_path / "c.h5")
    sim = cell()
    sim.remove(sim.grains.id.copy())
    with pytest.raises(CheckpointError, match=f"wall {number}, a .*, has {name} = "):
        restore(sim, tmp_path / "c.h5")
