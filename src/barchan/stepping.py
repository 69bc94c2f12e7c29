"""Many steps of a small scene in one call of compiled code: how many can be, and the call. It changes no bit."""

from math import inf

import numpy as np

from barchan.kernels.steps import OF_GHOSTS, Bodies, Planes, Rules, Then
from barchan.report import ProgressLine
from barchan.triggers import At, Every
from barchan.walls import Mesh, Plane
from barchan.walls.mesh import in_steps

#: Grains times steps in one call: 40 to 80 ms, after which Python looks whether somebody wants to stop.
MOST_WORK = 1_000_000

#: Grains that take about as long as the messages of a step between ranks that have to share a core.
GRAINS_PER_MESSAGE = 1000


def steps_ahead(sim, end):
    """Number of steps, up to step ``end``, in which this rank does nothing but move grains, flat walls and meshes, and compute
    forces."""
    if sim.staleness.also_when is not None:
        return 0
    steady = min((wall.steady_steps(sim.step_number) for wall in sim.walls), default=inf)
    due = min((_next_due(one, sim.step_number) for one in (*sim.actions, *sim.writers)), default=inf)
    work = max(sim.grains.n, GRAINS_PER_MESSAGE if sim.comm.size > 1 else 1)
    return int(min(end - sim.step_number, steady, due - 1 - sim.step_number, MOST_WORK // work))


def _next_due(one, step):
    """The step after ``step`` at which an action or a writer is due; the very next one unless it can tell. A user's own
    trigger, also one made from ours, has to be asked in every step."""
    if type(one.due) in (Every, At):
        return one.due.after(step)
    return one.next_due(step) if isinstance(one, ProgressLine) else step + 1


def advance(sim, most, loops, setting, forces, skin, walls_then, told):
    """At most ``most`` steps of ``sim``. Grains, contacts and walls are modified, counters are not.

    Args:
        loops: compiled ``Loops`` of the law.
        setting: a ``Setting``.
        forces: gravity, three numbers [length/time^2], and a ``Damping``.
        skin: of the list [length].
        walls_then: places of the walls at the rebuild.
        told: becomes what ``Progress`` reads, whatever interrupts this.
    """
    gravity, damping = forces
    grains, watch, frame = sim.grains, sim.staleness, setting.frame
    flat, meshes = ([wall for wall in sim.walls if isinstance(wall, kind)] for kind in (Plane, Mesh))
    bodies = Bodies(*(grains.block(name, ghosts=name in OF_GHOSTS) for name in Bodies._fields))
    point, normal, velocity, omega = (
        np.array([getattr(wall, name) for wall in flat]).reshape(-1, 3) for name in ("point", "normal", "velocity", "omega")
    )
    rules = Rules(
        np.uint32(setting.n_materials),
        setting.table,
        frame.low,
        frame.length,
        frame.half,
        frame.tilt,
        frame.rate,
        np.array(gravity),
        *map(float, damping),
        *(float(number) for number in (setting.dt, setting.allowed_overlap, setting.max_overlap)),
        float(max((wall.speed for wall in sim.walls), default=0.0)),
        watch.allowed(skin),
        sim.faults.large_overlaps > 0,
    )
    planes = Planes(
        np.array([wall.number for wall in flat], dtype=np.int64), point, normal, velocity, omega, sim.contacts.surface
    )
    then = Then(sim.contacts.seen, np.array([walls_then[wall.number][0] for wall in flat]).reshape(-1, 3))
    triangles = in_steps(meshes, walls_then) if meshes else None
    begin = (most, float(sim.time), float(watch.approach))
    try:
        sim.contacts.advance(loops, begin, bodies, (planes, triangles, then), rules, sim.ghosts.wire, told)
    finally:
        for wall, moved in zip(flat, point):
            wall.move_to(moved)
        for wall, moved in zip(meshes, triangles.poses if meshes else ()):
            wall.move_to(moved.copy(), setting.dt)
