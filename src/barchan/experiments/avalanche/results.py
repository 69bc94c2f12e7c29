"""What an avalanche has shown, from the tables of its run."""

import numpy as np

from barchan import record
from barchan.experiments.avalanche.observe import STATIONS, stations
from barchan.experiments.avalanche.parameters import PAPER, Outline
from barchan.experiments.experiment import Check, Results
from barchan.experiments.stored import stored
from barchan.packing.lattice import mean_volume
from barchan.units import readable

#: Mean kinetic energy of a grain at rest, relative to m g h with the height h of the block: what flows later is of that order.
AT_REST = 1e-3

#: Share of all contacts that may overlap by more than 5 %.
DEEP_SHARE = 1e-4

#: Time over which the speed of the front is taken [s]: some grains pass in it.
SPEED_WINDOW = 0.06

#: Time after the release at which the moving layer is quoted [s].
QUOTED = 0.3


def results(scene, directory):
    """Values, differences from the paper, and checks of the run in ``directory``.

    Raises:
        SceneError: a table is missing or damaged.
    """
    series = time_series(directory)
    if series is None:
        return Results([("results", "none: the run is shorter than table_every")], _differences(scene), [])
    flow = {name: column[series["since release [s]"] > 0.0] for name, column in series.items()}
    values = [("grains", f"{Outline.of(scene).flowing:,} flow at the start; time step {readable(scene.simulated.dt, 's')}")]
    if len(flow["step"]):
        values += [*_front(scene, flow), *_layers(scene, flow), *_jet(flow), *_energies(flow)]
    else:
        values.append(("flow", "the table has no row after the release yet"))
    return Results(values, _differences(scene), _checks(scene, series, flow, record.sittings(directory / "record.json")))


def time_series(directory):
    """The table ``time.csv``, or None if the run was too short to have one."""
    return stored(directory, ("time",))[0]


def arrival(scene, flow):
    """Time after the release at which the front comes within a diameter of the end wall [s]; None if it does not."""
    outline = Outline.of(scene)
    near = (outline.floor - outline.length) * outline.edge - 2.0 * scene.simulated.radius_max
    there = np.flatnonzero(flow["front [m]"] >= near)
    return float(flow["since release [s]"][there[0]]) if len(there) else None


def front_speed(flow):
    """Speed of the front [m/s], (k,): slope of the straight line through its positions within ``SPEED_WINDOW``."""
    time, front = flow["since release [s]"], flow["front [m]"]
    slopes = np.zeros(len(time))
    for row, now in enumerate(time):
        near = np.abs(time - now) <= 0.5 * SPEED_WINDOW
        offset = time[near] - time[near].mean()
        if near.sum() > 2:
            slopes[row] = (offset * front[near]).sum() / (offset**2).sum()
    return slopes


def _front(scene, flow):
    came = arrival(scene, flow)
    running = flow["since release [s]"] < (came - 0.5 * SPEED_WINDOW if came else np.inf)
    fastest = float(front_speed(flow)[running].max()) if running.any() else 0.0
    yield "front", f"at {_mm(flow['front [m]'][-1])} from the right wall at the end; fastest {fastest:.2f} m/s"
    yield "end wall", f"reached {came:.3f} s after the release" if came else "not reached by the front"
    yield (
        "run-out",
        f"99 % of the grains within {_mm(flow['99 % of grains [m]'][-1])}, foremost at {_mm(flow['foremost grain [m]'].max())}",
    )


def _layers(scene, flow):
    row = int(np.argmin(np.abs(flow["since release [s]"] - QUOTED)))
    layers = [f"{_mm(flow[f'moving layer {name} [m]'][row])} at x = {_mm(x)}" for name, x in zip(STATIONS, stations(scene))]
    yield "moving layer", f"{', '.join(layers)} ({flow['since release [s]'][row]:.2f} s after the release)"


def _jet(flow):
    height, volume = flow["jet height [m]"], flow["jet volume [m^3]"]
    if not volume.any():
        yield "jet", "no grain has reached the end wall"
        return
    first, highest = int(np.flatnonzero(volume)[0]), int(np.argmax(height))
    time = flow["since release [s]"]
    yield (
        "jet",
        f"first grain at the end wall at {time[first]:.3f} s; highest {_mm(height[highest])} at {time[highest]:.3f} s; upward at "
        f"most {flow['jet speed [m/s]'].max():.2f} m/s",
    )


def _energies(flow):
    released, dissipated = (
        flow[f"{name} energy [J]"][-1] - flow[f"{name} energy [J]"][0] for name in ("potential", "dissipated")
    )
    moving = flow["kinetic energy [J]"][-1] + flow["rotational energy [J]"][-1]
    yield "energy", f"{-released:.3g} J released, {dissipated:.3g} J dissipated; {moving:.3g} J in motion at the end"
    yield "coordination", f"{flow['coordination'][-1]:.2f} contacts a grain at the end"


def _mm(metres):
    return f"{1e3 * metres:.0f} mm"


def _differences(scene):
    """Parameters whose simulated value is not the paper's."""
    here = scene.model_dump() | scene.simulated._asdict()
    outline = Outline.of(scene)
    rows = [
        (name, scene.rounded(name, here[name]), scene.rounded(name, value))
        for name, value in PAPER.items()
        if here[name] != value
    ]
    return [("grains", f"{outline.flowing:,}", "120,000"), *rows, ("floor", scene.rounded("floor", scene.floor), "not stated")]


def _checks(scene, series, flow, sittings):
    grain = scene.simulated
    rest = series["since release [s]"] <= 0.0
    checks = []
    if series["since release [s]"][-1] >= 0.0:  # a run that was stopped before has not come to rest yet
        energy = (series["kinetic energy [J]"] + series["rotational energy [J]"])[rest][-1]
        mass = scene.density * mean_volume(grain.radius_min, grain.radius_max)
        ratio = energy / series["grains"][rest][-1] / (mass * scene.gravity * scene.height)
        checks.append(Check("at rest before the release", f"{ratio:.1e} of m g h a grain", f"{AT_REST:g}", ratio <= AT_REST))
    stable = max((s.stable_dt or 0.0 for s in sittings), default=0.0)
    if stable:  # a run that is under way, or was killed, has no record yet
        checks.append(Check("time step", readable(grain.dt, "s"), f"{readable(stable, 's')}, the stable one", grain.dt <= stable))
    checks.append(_overlap_check(series, sittings))
    if len(flow["step"]):
        checks.append(_energy_check(scene, flow))
    lost = Outline.of(scene).flowing - int(series["grains"][-1]) - int(series["left through outlets"][-1])
    checks.append(Check("lost grains", f"{lost}", "0", lost == 0))
    return checks


def _energy_check(scene, flow):
    """What is missing in the budget was dissipated; but the stiffness of tangential springs follows the overlap, and as it grows
    under a held displacement they gain energy that nobody gave.

    With F_n = f k_n delta and F_t = f k_t u <= mu F_n, these hold at most 5/4 mu^2 k_n/k_t times the energy of the normal
    ones. So at any later time at least what is missing now, less what they can hold now, must be missing.
    """
    missing = flow["dissipated energy [J]"]
    rounding = 1e-9 * float(np.abs(flow["potential energy [J]"]).max())
    held = 1.25 * scene.friction**2 * scene.kn / scene.kt * flow["elastic energy [J]"] + rounding
    fall = float((np.maximum.accumulate(missing) - missing).max())
    excess = float((np.maximum.accumulate(missing - held) - missing).max())
    most = f"{float(held.max()):.1e} J, what tangential springs can hold at the time"
    return Check("energy never grows", f"{fall:.1e} J came back", f"at most {most}", excess <= 0.0)


def _overlap_check(series, sittings):
    contacts = float(series["contacts"].mean()) * max(float(series["step"][-1]), 1.0)
    share = (sittings[-1].large_overlaps if sittings else 0) / max(contacts, 1.0)
    largest = 100.0 * float(series["largest overlap [1]"].max())
    return Check(
        "overlap",
        f"largest seen {largest:.2f} % of a diameter; above 5 %: {share:.1e} of all contacts",
        f"20 %; {DEEP_SHARE:g} of them",
        share <= DEEP_SHARE,
    )
