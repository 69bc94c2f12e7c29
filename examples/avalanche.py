"""The avalanche of Walther & Sbalzarini 2009 as a script: the scene of avalanche.toml, stage by stage, to the same bits."""

from barchan.experiments.avalanche import Avalanche, build, stages
from barchan.measure import KineticEnergy

SCENE = {"coarse_graining": 12, "radius_max": "1.12 mm", "angle": "31.2 deg", "equilibrate": "50 ms", "duration": "0.1 s"}


def main():
    """Run it; returns the simulation at its end."""
    scene = Avalanche.make(SCENE)
    sim = build(scene)
    for stage in stages(scene):
        stage.begin(sim)
        sim.run(stage.end - sim.step_number)
        print(f"{stage.name}: t = {sim.time:.3f} s, kinetic energy {KineticEnergy().compute(sim).total:.3g} J")
    foremost = sim.grains.position[sim.grains.frozen == 0, 0].max()
    print(f"foremost grain at x = {1e3 * foremost:.0f} mm after {scene.duration:g} s of flow")
    return sim


if __name__ == "__main__":
    main()
