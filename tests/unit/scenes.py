"""Small scenes for unit tests. They use one law with one material, so that a single loop is compiled for all."""

import numpy as np

import barchan as bc

SOFT = {"kn": 1000.0, "kt": 300.0, "gamma_n": 5.0, "gamma_t": 2.0, "friction": 0.4}

#: So soft that grains fly on as if there were no contacts.
NOTHING = {"kn": 1e-9, "kt": 1e-9, "friction": 0.0}


def simulation(box=None, dt=1e-3, gravity=(0.0, 0.0, 0.0), properties=SOFT, **options):
    """An empty simulation with the linear law, in a box of edge 20."""
    return bc.Simulation(
        box or bc.Box((0, 0, 0), (20, 20, 20)),
        bc.laws.linear,
        bc.Material("a", density=1.0, **properties),
        dt,
        gravity,
        **options,
    )


def pile(count=40, periodic=(True, True, False), **options):
    """Random grains on a floor, some overlapping a little, moving: things happen within 50 steps."""
    rng = np.random.default_rng(11)
    sim = simulation(bc.Box((0, 0, 0), (6, 6, 6), periodic), gravity=(1.0, 0.0, -5.0), **options)
    sim.add_wall(bc.Plane((0, 0, 0), (0, 0, 1)))
    site = rng.permutation(125)[:count]
    place = np.stack([site % 5, site // 5 % 5, site // 25], axis=1) * 1.0 + 0.5 + rng.uniform(-0.02, 0.02, (count, 3))
    sim.add_grains(
        place, rng.uniform(0.4, 0.52, count), velocity=rng.normal(scale=1.0, size=(count, 3)), omega=rng.normal(size=(count, 3))
    )
    sim.skin = 0.1
    return sim


def state_of(sim):
    """All fields of a simulation on one rank as bytes, in the order of ids."""
    return {field.name: sim.grains.sorted_by_id(field.name).tobytes() for field in sim.grains.table}


def fingerprint(sim):
    """The state and the contacts of a simulation, comparable by ``==`` to the last bit."""
    if not sim.is_listed:  # contacts of a scene that has not begun, or was changed, are not there to be measured
        sim.prepare()
    table = bc.measure.contact_table(sim)
    return state_of(sim), {name: column.tobytes() for name, column in table.items()}
