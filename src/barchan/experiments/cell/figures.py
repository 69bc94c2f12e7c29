"""Pictures of the grains of a loaded sample."""

import numpy as np

from barchan.view.grains import draw_grains
from barchan.view.style import figure
from barchan.writers import read_grain_frame


def sample(scene, shown, path):
    """The grains at the first frame, raining, and at the last, under load."""
    pictures = [read_grain_frame(frame.path).fields for frame in shown]
    top = 1e3 * max(float((fields["position"][:, 2] + fields["radius"]).max()) for fields in pictures)
    width = 1e3 * scene.width
    with figure(path, 1, 2, size=(5.4, 0.6 + 2.5 * top / width), sharey=True) as (_, axes):
        for axis, fields, frame in zip(axes, pictures, shown):
            radius = fields["radius"]
            colours = draw_grains(
                axis, fields["position"], radius, 1e3 * radius, (1e3 * scene.radius_min, 1e3 * scene.radius_max)
            )
            axis.set(xlim=(-0.05 * width, 1.05 * width), ylim=(-0.05 * width, 1.05 * top), aspect="equal", xlabel="x [mm]")
            axis.set_title(f"t = {1e3 * frame.time:.0f} ms")
            axis.grid(False)
        axes[0].set_ylabel("z [mm]")
        axes[0].figure.colorbar(colours, ax=np.array(axes), label="radius [mm]", shrink=0.6)
    return path
