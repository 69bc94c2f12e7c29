"""The avalanche of Walther & Sbalzarini 2009 as a script: the scene of avalanche.toml, step by step."""

from barchan.experiments.avalanche import Avalanche, build, stages
from barchan.measure import KineticEnergy

scene = Avalanche.make({"coarse_graining": 10, "radius_max": "1.12 mm", "angle": "31.2 deg", "equilibrate": 0.1, "duration": 0.2})
sim = build(scene)
for stage in stages(scene):
    stage.begin(sim)
    sim.run(stage.end - sim.step_number)
    print(f"{stage.name}: t = {sim.time:.3f} s, kinetic energy {KineticEnergy().compute(sim).total:.3g} J")
front = 1e3 * sim.grains.position[sim.grains.part == 0, 0].max()
print(f"foremost grain at x = {front:.0f} mm after {scene.duration} s of flow")
