"""The slope in a turning drum beside LAMMPS' own, from the same start: another code's walls, friction and time step.

A flow forgets where each grain was, so that angles and torques are compared as means of a steady flow. LAMMPS has no constant
resistance to rolling; both go without.
"""

from types import SimpleNamespace

import numpy as np
import pytest
from lammps_peer import run_lammps

from barchan.experiments.drum import Drum, build, instruments, observe, stages
from barchan.experiments.drum.results import ENDS, INNER, Surface, Tables, steady, surface_of, torques
from barchan.experiments.drum.setup import start
from barchan.parallel import Serial

#: The default without resistance to rolling, for a shorter time.
SCENE = Drum.make({"rolling_friction": 0.0, "duration": "3.2 s"})

#: LAMMPS' time step.
DT = 4e-5

FRAMES = 17


def script(place):
    """What LAMMPS does."""
    radius, length, law = SCENE.drum_radius, SCENE.length, f"hertz/material {SCENE.youngs_modulus} {SCENE.restitution} "
    law += f"{SCENE.poisson_ratio} damping tsuji tangential mindlin NULL 1.0 {SCENE.friction}"
    drum = f"cylinder y 0 {radius} {radius} 0 {length} side in"
    atoms = "\n".join("create_atoms 1 single {:.17g} {:.17g} {:.17g}".format(*point) for point in place)
    frames = "\n".join(f"run {round(0.1 / DT)}\nsnapshot {number}" for number in range(FRAMES))
    return f"""
units si
atom_style sphere
newton off
atom_modify map array
comm_modify vel yes
region box block {-radius - 0.01} {radius + 0.01} -0.01 {length + 0.01} -0.01 {2.0 * radius + 0.01}
create_box 1 box
{atoms}
set group all diameter {SCENE.diameter} density {SCENE.density}
neighbor 0.0015 bin
neigh_modify delay 0 every 1 check yes
pair_style granular
pair_coeff * * {law}
fix weight all gravity {SCENE.gravity} vector 0 0 -1
fix move all nve/sphere
timestep {DT}
region standing {drum}
fix wall all wall/gran/region granular {law} region standing
run {round(SCENE.equilibrate / DT)}
unfix wall
reset_timestep 0
variable turn equal {SCENE.rotation}*step*dt
region turning {drum} rotate v_turn 0 0 {radius} 0 1 0
fix wall all wall/gran/region granular {law} region turning
run {round(SCENE.develop / DT)}
{frames}
"""


def seen(position):
    """The ``Profile`` of grains at these places."""
    radius, frozen = np.full(len(position), SCENE.radius_max), np.zeros(len(position), np.uint8)
    fields = {"position": position, "radius": radius, "frozen": frozen}
    return observe.profile(SimpleNamespace(grains=SimpleNamespace(view=fields.get), comm=Serial()), SCENE)


@pytest.mark.validate
def test_angle_and_torque_are_those_of_lammps(tmp_path):
    taken = run_lammps(script(start(SCENE)), tmp_path)
    places = [taken[str(number)]["x"] for number in range(FRAMES)]
    profiles = [seen(place) for place in places]
    height, points = (np.array([getattr(one, name) for one in profiles]) for name in ("height", "points"))
    theirs = Surface(np.arange(FRAMES), profiles[0].distance - SCENE.drum_radius, height, points)

    sim = build(SCENE, threads=1)
    sim.writers = instruments(SCENE, tmp_path)
    for stage in stages(SCENE):
        stage.begin(sim)
        sim.run(stage.end - sim.step_number)
    tables = Tables.of(tmp_path)
    ours = surface_of(tables)
    for parts in (ENDS, INNER):
        angle = theirs.line(SCENE, np.full(FRAMES, True), parts).angle
        assert ours.line(SCENE, steady(SCENE, ours.steps), parts).angle == pytest.approx(angle, abs=1.0)
    mass = SCENE.density * 4.0 / 3.0 * np.pi * SCENE.radius_max**3
    torque = -SCENE.gravity * mass * np.mean([place[:, 0].sum() for place in places])
    assert torques(SCENE, tables.time)[0] == pytest.approx(torque, rel=0.02)
