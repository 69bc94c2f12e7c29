"""Run by ``yade -n -x yade_script.py FOLDER``: grains that move as told, and what YADE's Mindlin law makes of their contacts.

Reads ``given.npz``; writes the forces on all grains after each of the steps asked for as ``found.npz``.
"""

import sys
from math import atan
from pathlib import Path

import numpy as np
from yade import O, utils, wrapper

folder = Path(sys.argv[1])
given = dict(np.load(folder / "given.npz"))
properties = {"young": float(given["youngs_modulus"]), "poisson": float(given["poisson_ratio"])}
O.materials.append(wrapper.FrictMat(density=1000.0, frictionAngle=atan(float(given["friction"])), **properties))
for position, radius, velocity in zip(given["position"], given["radius"], given["velocity"]):
    body = utils.sphere(position, radius, dynamic=False)
    body.state.vel = velocity
    O.bodies.append(body)

cohesion = float(given["work_of_adhesion"])
physics = wrapper.Ip2_FrictMat_FrictMat_MindlinPhys(gamma=0.5 * cohesion)  # its pull is 4 pi R* gamma
law = wrapper.Law2_ScGeom_MindlinPhys_Mindlin(includeAdhesion=cohesion > 0.0)
shape = wrapper.Ig2_Sphere_Sphere_ScGeom(avoidGranularRatcheting=False)  # which would scale up the slip by the overlap
loop = wrapper.InteractionLoop([shape], [physics], [law])
collider = wrapper.InsertionSortCollider([wrapper.Bo1_Sphere_Aabb()], verletDist=0.1)
O.engines = [wrapper.ForceResetter(), collider, loop, wrapper.NewtonIntegrator(damping=0.0)]
O.dt, found = 1e-12 * float(given["dt"]), []
O.step()  # contacts of the start, and no slip
O.dt = float(given["dt"])
for body in O.bodies:
    body.state.pos += O.dt * body.state.vel  # in each step below YADE finds forces first, and then moves
for _ in range(int(given["steps"])):
    O.step()
    found.append([list(O.forces.f(number)) for number in range(len(O.bodies))])
np.savez(folder / "found.npz", force=np.array(found))
