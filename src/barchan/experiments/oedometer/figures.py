"""Pictures of an oedometer test, from the tables and frames of its run."""

from matplotlib.ticker import LogLocator, NullLocator, StrMethodFormatter

from barchan.experiments.cell.figures import sample
from barchan.experiments.oedometer.modulus import Moduli
from barchan.experiments.oedometer.results import branches, series
from barchan.view.style import COLOURS, figure
from barchan.writers import frames


def figures(scene, directory):
    """Draw all figures of the run in ``directory``; yields their paths."""
    out, load = directory / "figures", series(scene, directory)
    if load is None:
        return
    yield void_ratio(scene, load, out / "void_ratio.png")
    yield strain(scene, load, out / "strain.png")
    yield k0(scene, load, out / "k0.png")
    shown = frames(directory / "frames", "grains")
    if len(shown) > 1:
        yield sample(scene, [shown[0], shown[-1]], out / "sample.png")


def void_ratio(scene, load, path):
    """Void ratio against the logarithm of vertical stress."""
    with figure(path, size=(4.6, 3.6)) as (_, axis):
        _draw(axis, scene, load, 1e-3 * load["vertical stress [Pa]"], load["void ratio [1]"])
        axis.set(xlabel="vertical stress [kPa]", ylabel="void ratio [1]", xscale="log")
        axis.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axis.xaxis.set_minor_locator(NullLocator())
        axis.legend()
    return path


def strain(scene, load, path):
    """Vertical stress against vertical strain, and the modulus between them."""
    moduli = Moduli.of(scene, load)
    with figure(path, 1, 2, size=(7.2, 3.2)) as (_, (left, right)):
        _draw(left, scene, load, 100.0 * load["volumetric strain [1]"], 1e-3 * load["vertical stress [Pa]"])
        left.set(xlabel="vertical strain [%]", ylabel="vertical stress [kPa]")
        left.legend()
        for values, colour in zip((moduli.loading, moduli.unloading), COLOURS):
            right.plot(1e-3 * moduli.stress, 1e-6 * values, "o-", color=colour, markersize=4)
        right.set(xlabel="vertical stress [kPa]", ylabel="constrained modulus [MPa]", ylim=(0.0, None))
    return path


def k0(scene, load, path):
    """Horizontal over vertical stress, against vertical stress."""
    with figure(path, size=(4.6, 3.6)) as (_, axis):
        _draw(axis, scene, load, 1e-3 * load["vertical stress [Pa]"], load["K0 [1]"])
        axis.set(xlabel="vertical stress [kPa]", ylabel="K0, horizontal over vertical stress [1]", ylim=(0.0, None))
        axis.legend()
    return path


def _draw(axis, scene, load, across, up):
    """One line for loading, one for unloading."""
    for rows, name, colour in zip(branches(scene, load), ("loading", "unloading"), COLOURS):
        axis.plot(across[rows], up[rows], color=colour, label=name)
