"""A small dense state for the tests of bits: every grain touches many others, some slide, contacts form and break."""

import numpy as np

import barchan as bc
from barchan.bonds import Weibull
from barchan.packing.lattice import lattice

VALUES = {
    "kn": 2e4,
    "kt": 6e3,
    "gamma_n": 20.0,
    "gamma_t": 10.0,
    "friction": 0.4,
    "youngs_modulus": 2e5,
    "poisson_ratio": 0.25,
    "restitution": 0.6,
    "work_of_adhesion": 1.0,
    "rolling_friction": 0.2,
    "twisting_friction": 0.1,
}


def materials(law, count=2):
    """Materials that differ, with all properties of ``law``."""

    values = VALUES | ({"work_of_adhesion": 100.0} if law.reach else {})  # contacts last over 1 % of a radius

    def scaled(k):
        return {name: value * (1.0 + 0.2 * k) for name, value in values.items() if name in law.properties}

    return [bc.Material(f"m{k}", density=1.0 + 0.5 * k, **scaled(k)) for k in range(count)]


def tilting(time):
    """Gravity that turns."""
    return 5.0 * time, 0.3, -1.0


#: While gravity turns, steps are made singly; while it does not, many of them in one call.
GRAVITY = {"turning": tilting, "steady": (0.4, 0.3, -1.0)}


def empty(law, **options):
    """The scene without its grains: a periodic box with a floor and a lid that moves."""
    box = bc.Box((0.0, 0.0, -0.5), (8.0, 6.0, 12.0), periodic=(True, True, False))
    sim = bc.Simulation(box, law, materials(law), dt=5e-4, gravity=tilting, **options)
    sim.add_field("label", width=2, default=0.0)
    sim.add_wall(bc.Plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), material="m1"))
    sim.add_wall(bc.Plane((0.0, 0.0, 7.4), (0.0, 0.0, -1.0), material="m0", velocity=(0.3, 0.0, -0.05)))
    return sim


def dense(law, **options):
    """About 580 grains on a compressed face-centred lattice: coordination above 6, polydisperse, sheared, two materials."""
    sim = empty(law, **options)
    points = lattice("fcc", 4.0 / 3.0, (0.0, 0.0, 0.45), (6, 5, 5)) * (1.0, 0.9, 1.0)
    random = np.random.default_rng(7)
    points = points + random.uniform(-0.01, 0.01, points.shape)
    radius = random.uniform(0.45, 0.5, len(points))
    velocity = random.normal(0.0, 0.4, points.shape) + np.outer(points[:, 2], (0.3, 0.0, 0.0))
    bottom = points[:, 2] < 1.2
    left = points[:, 0] < 4.0
    for frozen, chosen, material in ((True, bottom, "m0"), (False, ~bottom & left, "m0"), (False, ~bottom & ~left, "m1")):
        ids = sim.add_grains(
            points[chosen],
            radius[chosen],
            material,
            velocity=0.0 if frozen else velocity[chosen],
            omega=0.0 if frozen else random.normal(0.0, 0.5, (chosen.sum(), 3)),
            frozen=frozen,
        )
        own = np.isin(sim.grains.id, ids)
        sim.grains.label[own] = np.stack([sim.grains.id[own], -sim.grains.id[own]], axis=1)
    return sim


#: Two kinds; the brittle one breaks in every mode while the scene runs, the tough one never.
KINDS = [
    bc.Bond(
        bc.laws.parallel_bond,
        name,
        kn=4e4,
        ks=2e4,
        tensile_strength=600.0 * factor,
        compressive_strength=800.0 * factor,
        shear_strength=400.0 * factor,
        radius_factor=0.8,
    )
    for name, factor in (("brittle", 1.0), ("tough", 1e6))
]


def bonded(**options):
    """The dense state: half of the grains are glued to all that they touch, others to what is near."""
    sim = dense(bc.laws.linear, bonds=KINDS, **options)
    sim.install_bonds(among=np.arange(0, 290), strength=Weibull(4.0, seed=3))
    sim.install_bonds(overlap=-0.06, among=np.arange(250, 500), kind="tough")
    return sim


def tilting_in_plane(time):
    """Gravity that turns in the plane."""
    return 50.0 * time, -20.0, 0.0


def flow(shape="disc", with_grains=True, **options):
    """Large and small grains, one of them immobile, on a floor that slides, periodic along x: all overlap a little and move."""
    edge, small_radius = 8.0, 0.158
    grain = bc.Material("grain", density=1.0, kn=4e3, kt=1e3, gamma_n=200.0, gamma_t=50.0, friction=0.5)
    sim = bc.Simulation(
        bc.Box((0, 0), (edge, edge), (True, False)), bc.laws.linear, grain, 5e-4, tilting_in_plane, shape=shape, **options
    )
    sim.check_dt = False
    sim.add_wall(bc.Plane((0, 0, 0), (0, 1, 0), velocity=(0.3, 0, 0)))
    if not with_grains:
        return sim
    rng = np.random.default_rng(3)
    large = np.array([(1.0, 1.0, 0.0), (4.0, 0.99, 0.0), (7.0, 1.0, 0.0), (2.5, 2.9, 0.0)])
    columns = np.stack(np.meshgrid(np.arange(26), np.arange(16), [-0.5]), axis=-1).reshape(-1, 3)
    small = (columns + 0.5) * edge / 26
    small[:, :2] += rng.uniform(-0.01, 0.01, (len(small), 2))
    gap = np.linalg.norm(sim.box.difference(small[:, None], large[None]), axis=2) - 1.0 - small_radius
    small = small[(gap > -0.02).all(axis=1)]
    place, radius = np.concatenate([small, large]), np.repeat([small_radius, 1.0], [len(small), len(large)])
    order, velocity, omega = rng.permutation(len(radius)), 0.3 * rng.normal(size=place.shape), rng.normal(size=place.shape)
    frozen = radius[order] > 0.5
    frozen[np.flatnonzero(frozen)[1:]] = False
    moving = ~frozen[:, None]
    sim.add_grains(
        place[order], radius[order], velocity=velocity * (1, 1, 0) * moving, omega=omega * (0, 0, 1) * moving, frozen=frozen
    )
    return sim


def sheared(with_grains=True, **options):
    """Grains that are kept under a stress and sheared until the images are set back by a period; without grains to restore."""
    rough = bc.Material("rough", density=1.0, kn=1e4, kt=4e3, gamma_n=3.0, gamma_t=1.0, friction=0.5)
    sim = bc.Simulation(bc.Box((0, 0, 0), (8, 6, 7), (True,) * 3), bc.laws.linear, rough, 1e-3, **options)
    sim.max_overlap, sim.deformation = np.inf, bc.Deformation(y=-0.1, z=bc.StressServo(100.0, max_rate=0.5), xz=6.0)
    if with_grains:
        random = np.random.default_rng(9)
        cells = np.stack(np.meshgrid(*map(np.arange, (8, 6, 7)), indexing="ij"), axis=-1).reshape(-1, 3) + 0.5
        sim.add_grains(cells, random.uniform(0.44, 0.5, len(cells)), velocity=random.normal(0.0, 1.0, cells.shape))
    return sim


def named(name, with_grains=True):
    """The dense state of a law by its name, "bonded" or "sheared"; without grains it is one to restore."""
    if name == "sheared":
        return sheared(with_grains)
    if name == "bonded":
        return bonded() if with_grains else empty(bc.laws.linear, bonds=KINDS)
    return (dense if with_grains else empty)(bc.laws.SHIPPED[name])
