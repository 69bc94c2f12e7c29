"""Checks that piles, silos and columns of sand share."""

from barchan.experiments.experiment import Check
from barchan.packing.lattice import mean_volume
from barchan.units import readable

#: Mean kinetic energy of a grain at rest, relative to m g d: what it takes to climb over another one.
AT_REST = 1e-4


def at_rest(scene, energy, grains, name):
    """Energy of motion [J] against the energy to lift each grain by its diameter."""
    mass = scene.density * mean_volume(scene.radius_min, scene.radius_max)
    ratio = float(energy) / max(float(grains), 1.0) / (mass * scene.gravity * scene.diameter)
    return Check(name, f"{ratio:.1e} of m g d a grain", f"{AT_REST:g}", ratio <= AT_REST)


def time_step(scene, sittings):
    """The time step against the stable one; nothing of a run that is under way, or was killed: it has no record yet."""
    stable = max((s.stable_dt or 0.0 for s in sittings), default=0.0)
    if stable:
        yield Check("time step", readable(scene.dt, "s"), f"{readable(stable, 's')}, the stable one", scene.dt <= stable)


def overlap(largest, allowed):
    """The largest overlap that was seen, relative to the smaller diameter."""
    return Check("overlap", f"largest seen {100 * largest:.2f} % of a diameter", f"{100 * allowed:g} %", largest <= allowed)
