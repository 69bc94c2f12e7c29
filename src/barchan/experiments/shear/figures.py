"""Pictures of sheared grains, from the tables and frames of their run."""

import numpy as np

from barchan.experiments.shear.results import NEEDED, heights, laws_of, read, steady_stages
from barchan.experiments.shear.rheology import GLASS_BEADS
from barchan.view.grains import draw_grains
from barchan.view.style import COLOURS, figure
from barchan.writers import frames, read_grain_frame


def figures(scene, directory):
    """Draw all figures of the run in ``directory``; yields their paths."""
    out, time, found = directory / "figures", read(directory, "time"), steady_stages(scene, directory)
    if not found:
        return
    yield rheology(found, out / "rheology.png")
    yield profiles(found, out / "profiles.png")
    yield strain(scene, time, out / "strain.png")
    shown = [frame for frame in frames(directory / "frames", "grains") if frame.step in scene.ends]
    if shown:
        yield sample(scene, shown[0], out / "sample.png")


def rheology(found, path):
    """Friction and solid fraction over the inertial number, with laws through them and that of glass beads."""
    inertial = np.array([one.inertial for one in found])
    between = np.geomspace(0.7 * inertial.min(), 1.4 * inertial.max(), 100)
    with figure(path, 1, 2, size=(8.0, 3.4)) as (_, axes):
        for axis, name in zip(axes, ("mu", "solid")):
            values, errors = ([getattr(one, f"{name}{end}") for one in found] for end in ("", "_error"))
            axis.errorbar(inertial, values, 2.0 * np.array(errors), fmt="o", markersize=4, capsize=2, label="sheared")
        if len(found) >= NEEDED:
            friction, filling = laws_of(found)
            label = f"$\\mu_s$ = {friction.mu_s:.3f} $\\pm$ {friction.errors[0]:.3f}"
            if friction.determined:
                label += f", $\\mu_2$ = {friction.mu_2:.3f}, $I_0$ = {friction.i_0:.2f}"
            axes[0].plot(between, friction.at(between), color=COLOURS[6], linewidth=1.0, zorder=1, label=label)
            label = f"$\\phi_c$ = {filling.phi_c:.3f}, $a$ = {filling.slope:.3f}"
            axes[1].plot(between, filling.at(between), color=COLOURS[6], linewidth=1.0, zorder=1, label=label)
        axes[0].plot(between, GLASS_BEADS.at(between), "--", color=COLOURS[1], zorder=1, label="glass beads, Jop et al. 2006")
        axes[0].set(xlabel="inertial number $I$ [1]", ylabel=r"friction $\mu = \tau / \sigma_{zz}$ [1]", xscale="log")
        axes[1].set(xlabel="inertial number $I$ [1]", ylabel=r"solid fraction $\phi$ [1]", xlim=(0.0, None))
        for axis in axes:
            axis.legend()
    return path


def profiles(found, path):
    """Velocity, solid fraction and shear stress over the height, each stage a line."""
    with figure(path, 1, 3, size=(8.6, 3.4), sharey=True) as (_, axes):
        for number, one in enumerate(found):
            style = {"color": COLOURS[number % len(COLOURS)], "markersize": 3}
            height = heights(one.velocity)
            axes[0].plot(one.velocity, height, "o", label=f"$I$ = {one.inertial:.3g}", **style)
            axes[1].plot(one.filling * one.solid, height, "o-", **style)
            axes[2].plot(one.shear * one.mu, height, "o-", **style)
        axes[0].plot([-0.5, 0.5], [0.0, 1.0], color=COLOURS[6], linewidth=0.8, zorder=1)
        axes[0].set(xlabel="velocity over its difference\nbetween the faces [1]", ylabel="height over that of the box [1]")
        axes[1].set(xlabel="solid fraction [1]", ylim=(0.0, 1.0))
        axes[2].set(xlabel="shear stress over normal stress [1]", xlim=(0.0, None))
        axes[0].legend()
    return path


def strain(scene, time, path):
    """Friction and solid fraction against the strain; what is averaged is shaded."""
    grown = np.interp(time["step"], *strains(scene))
    with figure(path, 2, 1, size=(8.0, 4.4), sharex=True) as (_, axes):
        ratio = time["shear stress [Pa]"] / time["normal stress z [Pa]"]
        axes[0].plot(grown, ratio, linewidth=0.7)
        axes[1].plot(grown, time["solid fraction [1]"])
        for axis in axes:
            for begin, end in zip(scene.begins, scene.ends):
                axis.axvspan(*np.interp((begin, end), *strains(scene)), color=COLOURS[5], alpha=0.15, linewidth=0.0)
        settled = ratio[time["step"] > scene.begins[0]]
        axes[0].set(ylabel="shear over normal stress [1]", ylim=(0.0, 1.2 * settled.max(initial=0.1)))
        axes[1].set(xlabel="shear strain [1]", ylabel="solid fraction [1]", xlim=(0.0, grown[-1]))
    return path


def strains(scene):
    """Steps between which the rate is constant, and the strains at them."""
    steps = np.array([0, *scene.ends])
    return steps, np.concatenate([[0.0], np.cumsum(np.diff(steps) * scene.dt * scene.shear_rates)])


def sample(scene, shown, path):
    """The grains at the end of the first stage, by their velocity in space."""
    frame = read_grain_frame(shown.path)
    place, radius = frame.fields["position"], frame.fields["radius"]
    stage = scene.stage(shown.step - 1)
    low, high = place[:, 2].min(), place[:, 2].max()
    across = float(scene.shear_rates[stage]) * (high - low)
    velocity = frame.fields["velocity"][:, 0] + across * ((place[:, 2] - low) / (high - low) - 0.5)
    with figure(path, size=(5.4, 4.4)) as (drawing, axis):
        discs = draw_grains(axis, place, radius, velocity, (-0.6 * across, 0.6 * across))
        (left, _, bottom), (right, _, top) = (1e3 * face(place, axis=0) for face in (np.min, np.max))
        axis.set(xlim=(left, right), ylim=(bottom, top), aspect="equal", xlabel="x, the flow [mm]", ylabel="z, the gradient [mm]")
        axis.set_title(f"I = {scene.inertial_numbers[stage]:.3g}", fontsize=9)
        axis.grid(False)
        drawing.colorbar(discs, ax=axis, label="velocity along x [m/s]", shrink=0.8)
    return path
