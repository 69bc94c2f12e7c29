"""Runs a case inside YADE: ``yade -n -x -j THREADS yade_engine.py FOLDER``, where only NumPy and ``barchan/bench`` are found.

YADE is periodic on all sides: where the case is not, its box is so wide that nothing reaches the other end. Its skin: all bounds
are widened by half of what the case asks for, or by less where its collider finds that enough (``targetInterv``).
"""

import sys
import time
from math import atan, pi, sqrt
from pathlib import Path

import numpy as np
from case import Case
from serving import serve
from yade import O, config, utils, wrapper

#: Half the width of the floor: grains that leave a periodic box are not put back into it, and shall not miss the floor.
WIDE = 1e6

#: Mass of what cannot be moved.
IMMOVABLE = 1e30

#: Overlap at which the damping of Hertz' law is that of the case, relative to the mean diameter: about the mean of a dense flow.
DAMPED_OVERLAP = 0.03


class Engine:
    """See ``serving``."""

    rank, version = 0, f"YADE {config.version}"

    def set_up(self, case, skin):
        """Start anew."""
        O.reset()
        self.grains = []  # the memory of one simulation, not of two
        O.periodic = True
        self.low = np.array(case.low)
        O.cell.setBox(*np.subtract(case.high, case.low, dtype=float))
        pair = {"hooke": hooke, "hertz": hertz}[case.law](case)
        self.grains = add_grains(case, self.low)
        if case.floor is not None:
            add_floor(case, self.low)
        bounds = [wrapper.Bo1_Sphere_Aabb(), wrapper.Bo1_Box_Aabb()]
        # sorted along z, as the floor is all there is along x and y; and it is larger than a period
        wide = {"verletDist": 0.5 * skin * case.diameter, "sortAxis": 2, "allowBiggerThanPeriod": True}
        self.collider = wrapper.InsertionSortCollider(bounds, avoidSelfInteractionMask=2, **wide)
        self.newton = wrapper.NewtonIntegrator(damping=0.0, gravity=case.gravity)
        shapes = [wrapper.Ig2_Sphere_Sphere_ScGeom(), wrapper.Ig2_Box_Sphere_ScGeom()]
        loop = wrapper.InteractionLoop(shapes, *([functor] for functor in pair))
        O.engines = [wrapper.ForceResetter(), self.collider, loop, self.newton]
        self.step_by_hand(case.dt)

    def step_by_hand(self, dt):
        """The first step: YADE knows velocities at half steps only, and the case gives them at the full one."""
        self.newton.dead, O.dt = True, 1e-9 * dt  # forces alone, and no slip
        O.step()
        self.newton.dead, O.dt, self.done = False, dt, 1  # of the steps of the next run
        for grain, kick, twist in self.kicks():
            grain.vel += kick
            grain.angVel += twist
            grain.pos += dt * grain.vel

    def kicks(self):
        """(state, velocity, angular velocity) of all that half a step adds by the present forces, grain by grain."""
        for body in self.grains:
            state, half = body.state, 0.5 * O.dt * body.dynamic
            acceleration = O.forces.f(body.id) / state.mass + self.newton.gravity
            yield state, half * acceleration, half / state.inertia[0] * O.forces.t(body.id)

    def run(self, steps, forced):
        """Advance; returns (seconds, rebuilds). Step by step: who waits for ``O.run`` looks every 40 ms whether it has ended."""
        before, began = self.collider.numAction, time.perf_counter()
        for _ in range(steps - self.done):
            if forced:
                self.newton.maxVelocitySq = 1.0  # "some grain has gone as far as its bounds"
            O.step()
        self.done = 0
        return time.perf_counter() - began, self.collider.numAction - before

    def observe(self):
        """The present state; velocities at the full step by the forces of the last one."""
        rows = [(state.pos, state.vel + kick, state.angVel + twist) for state, kick, twist in self.kicks()]
        position, velocity, omega = np.array(rows).transpose(1, 0, 2)
        return {"position": position + self.low, "velocity": velocity, "omega": omega}


def add_grains(case, low):
    """The grains of a case, as bodies; their materials are known by number. Frozen ones do not meet each other."""
    grains = case.grains
    kinds, kind = np.unique(kinds_of(case), axis=0, return_inverse=True)
    materials = [O.materials.append(material(case, *row)) for row in kinds]
    bodies = []
    for k, (number, frozen) in enumerate(zip(kind.ravel(), grains.frozen)):
        body = utils.sphere(grains.position[k] - low, grains.radius[k], material=materials[number], fixed=bool(frozen))
        body.state.vel, body.state.angVel, body.mask = grains.velocity[k], grains.omega[k], 3 if frozen else 1
        bodies.append(body)
    O.bodies.append(bodies)
    return bodies


def kinds_of(case):
    """(density, mass) that each grain's material must know, (n, 2); Hertz' law asks the grains for their mass."""
    grains = case.grains
    mass = 4.0 / 3.0 * pi * grains.radius**3 * grains.density if case.law == "hooke" else np.ones(case.count)
    return np.column_stack([grains.density, np.where(grains.frozen, IMMOVABLE, mass)])


def add_floor(case, low):
    """A box whose upper face is the floor. For Hertz' law YADE takes its radius as that of the grain, and not as infinite: with
    a material stiffer by this factor the contact is as stiff."""
    height = case.floor - case.low[2]
    middle = (0.5 * O.cell.size[0], 0.5 * O.cell.size[1], 0.75 * height)
    stiff = 1.0 + sqrt(2.0) if case.law == "hertz" else 1.0
    number = O.materials.append(material(case, 1.0, IMMOVABLE, stiff))
    O.bodies.append(utils.box(middle, (WIDE, WIDE, 0.25 * height), material=number, fixed=True))


def material(case, density, mass, stiff=1.0):
    """YADE makes the constants of a contact from those of two materials, by rules that are undone here. Two springs act one after
    the other, and so do two dampings: proportional to the masses, they make the effective mass."""
    c, common = case.constants, {"density": density, "frictionAngle": atan(case.constants.friction)}
    if case.law == "hooke":
        damping = {"cn": c.gamma_n * mass, "cs": c.gamma_t * mass}
        return wrapper.ViscElMat(kn=2.0 * c.kn, ks=2.0 * c.kt, **damping, **common)
    poisson = (3.0 - 2.0 * c.kt / c.kn) / (3.0 - c.kt / c.kn)
    return wrapper.FrictMat(young=stiff * 1.5 * c.kn * (1.0 - poisson**2), poisson=poisson, **common)


def hooke(case):
    """What makes a contact, and its law."""
    return wrapper.Ip2_ViscElMat_ViscElMat_ViscElPhys(), wrapper.Law2_ScGeom_ViscElPhys_Basic()


def hertz(case):
    """The same; damping is given relative to the critical one, for two mean grains at ``DAMPED_OVERLAP``."""
    c, radius = case.constants, case.grains.radius.mean()
    mass = 4.0 / 3.0 * pi * radius**3 * case.grains.density.mean()
    scale = 0.5 * sqrt(0.5 * mass * sqrt(DAMPED_OVERLAP) * radius)  # effective mass, contact radius
    betan, betas = scale * c.gamma_n / sqrt(1.5 * c.kn), scale * c.gamma_t / sqrt(c.kt)
    return wrapper.Ip2_FrictMat_FrictMat_MindlinPhys(betan=betan, betas=betas), wrapper.Law2_ScGeom_MindlinPhys_Mindlin()


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    serve(Engine(), folder, lambda: Case.load(folder.parent))
