"""Pictures of a wave in the sample, from the frames of its run."""

import numpy as np

from barchan.view.grains import draw_grains
from barchan.view.style import figure
from barchan.writers import frames, read_grain_frame

#: Thickness of the slice that is shown, in mean diameters; and pulses that are, the first of each kind.
SLICE, SHOWN = 3.0, 2

#: When, over the time in which a pulse is listened to.
MOMENTS = (0.15, 0.3, 0.45, 0.6)

#: For velocities, to both sides of 0: blue and red, that colour-blind readers can tell apart.
DIVERGING = "RdBu_r"

#: Share of the grains whose velocity lies within the colours.
WITHIN = 0.995


def moments(scene, shot):
    """Steps at which the sample is written down while a pulse runs through it."""
    return [shot.begin + max(round(share * (shot.end - shot.begin)), 1) for share in MOMENTS]


def wave_pictures(scene, directory, path):
    """Grains in a slice along the sample, coloured by their velocity along the motion of the layer that is shaken, at
    ``MOMENTS`` of the first pulses; returns the path, or None where no frame of them is left."""
    there = {frame.step: frame for frame in frames(directory / "frames", "grains")}
    shots = [(shot, [there[step] for step in moments(scene, shot) if step in there]) for shot in scene.shots[:SHOWN]]
    shots = [(shot, found) for shot, found in shots if found]
    rows = sum(len(found) for _, found in shots)
    if not rows:
        return None
    high = np.clip(8.0 * scene.across / scene.along, 0.5, 4.0)
    with figure(path, rows, 1, size=(9.0, 0.8 + (high + 0.35) * rows), sharex=True, squeeze=False) as (drawing, axes):
        left = list(axes[:, 0])
        for shot, found in shots:
            own, left = left[: len(found)], left[len(found) :]
            discs = _slices(scene, shot, found, own)
            drawing.colorbar(discs, ax=own, label=f"velocity along {'xyz'[shot.axis]} [mm/s]", extend="both", aspect=30)
        axes[-1, 0].set_xlabel("z, along the sample [mm]")
    return path


def _slices(scene, shot, found, axes):
    """One slice for each frame, all with the same colours; returns what a colour bar takes."""
    pictures = [read_grain_frame(frame.path) for frame in found]
    largest = 1e3 * max(np.quantile(np.abs(picture.fields["velocity"][:, shot.axis]), WITHIN) for picture in pictures)
    for axis, picture in zip(axes, pictures):
        place, radius = picture.fields["position"], picture.fields["radius"]
        near = np.abs(place[:, 1]) <= 0.5 * SLICE * scene.diameter
        speed = 1e3 * picture.fields["velocity"][near, shot.axis]
        discs = draw_grains(axis, place[near][:, (2, 1, 0)], radius[near], speed, (-largest, largest))
        discs.set_cmap(DIVERGING)
        ends = 1e3 * np.abs(place).max(axis=0)
        since = 1e6 * (picture.step - shot.begin) * scene.dt
        axis.set_title(f"{shot.name}, {since:.0f} µs after the pulse began", loc="left", fontsize=8, pad=4.0)
        axis.set(xlim=(-ends[2], ends[2]), ylim=(-ends[0], ends[0]), aspect="equal", ylabel="x [mm]")
        axis.grid(False)
    return discs
