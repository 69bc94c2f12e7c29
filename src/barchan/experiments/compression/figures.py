"""Pictures of a compression test, from the tables and frames of its run."""

from barchan.experiments.cell import WALLS
from barchan.experiments.cell.figures import sample
from barchan.experiments.cell.results import load_series
from barchan.view.style import COLOURS, figure
from barchan.writers import frames


def figures(scene, directory):
    """Draw all figures of the run in ``directory``; yields their paths."""
    out, load = directory / "figures", load_series(scene, directory)
    if load is None:
        return
    yield stress(scene, load, out / "stress.png")
    yield strain(scene, load, out / "strain.png")
    yield structure(scene, load, out / "structure.png")
    shown = frames(directory / "frames", "grains")
    if len(shown) > 1:
        yield sample(scene, [shown[0], shown[-1]], out / "sample.png")


def _since(scene, load):
    """Time since the loading began [ms]."""
    return 1e3 * scene.dt * (load["step"] - scene.ends[1])


def stress(scene, load, path):
    """Stress on the walls, with its target, against time: Figure 7a of Marketos et al. (2013), and Figure 8 with a bad gain."""
    time = _since(scene, load)
    with figure(path, 2, 1, size=(5.6, 5.4), sharex=True, height_ratios=(2, 1)) as (_, (above, below)):
        target = load["target stress [Pa]"]
        for name, colour in zip(WALLS, COLOURS):
            above.plot(time, 1e-3 * load[f"stress {name} [Pa]"], color=colour, linewidth=0.9, label=name)
            below.plot(time, 100.0 * (load[f"stress {name} [Pa]"] / target - 1.0), color=colour, linewidth=0.9)
        above.plot(time, 1e-3 * target, "--", color="black", linewidth=1.0, label="target")
        above.set(ylabel="stress on the walls [kPa]", ylim=(0.0, 1.4e-3 * target.max()))
        above.legend(ncols=2)
        below.set(xlabel="time since the loading began [ms]", ylabel="error [%]", ylim=(-6.0, 6.0))
    return path


def strain(scene, load, path):
    """Mean stress against volumetric strain: Figure 7b of Marketos et al. (2013)."""
    rows = load["step"] >= scene.ends[1]
    with figure(path, size=(4.6, 3.6)) as (_, axis):
        axis.plot(1e-3 * load["mean stress [Pa]"][rows], 100.0 * load["volumetric strain [1]"][rows], label="walls")
        axis.plot(
            1e-3 * load["mean stress of grains [Pa]"][rows], 100.0 * load["volumetric strain [1]"][rows], ":", label="grains"
        )
        axis.set(xlabel="mean stress [kPa]", ylabel="volumetric strain [%]")
        axis.invert_yaxis()
        axis.legend()
    return path


def structure(scene, load, path):
    """Void ratio and coordination against mean stress, on which they depend more than on time."""
    rows = load["step"] >= scene.ends[1]
    mean = 1e-3 * load["mean stress [Pa]"][rows]
    with figure(path, 1, 2, size=(7.2, 3.2)) as (_, (left, right)):
        left.plot(mean, load["void ratio [1]"][rows])
        left.set(xlabel="mean stress [kPa]", ylabel="void ratio [1]")
        right.plot(mean, load["coordination"][rows], label="all grains")
        right.plot(mean, load["mechanical coordination"][rows], "--", label="without rattlers")
        right.set(xlabel="mean stress [kPa]", ylabel="coordination number [1]")
        right.legend()
    return path
