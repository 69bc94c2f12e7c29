"""A drum that turns about its level axis and keeps a slope of grains flowing.

Grains come to rest in a cylinder; it begins to turn; the angle of their surface, the depth of the layer that flows, how fast two
colours mix, torque and power are measured as they flow steadily.
"""

from barchan.experiments.drum.figures import figures
from barchan.experiments.drum.observe import instruments
from barchan.experiments.drum.parameters import Drum
from barchan.experiments.drum.results import results
from barchan.experiments.drum.setup import build, stages
from barchan.experiments.experiment import Experiment

DRUM = Experiment(
    name="drum",
    title="A slope of grains that flows in a turning drum",
    scene=Drum,
    build=build,
    stages=stages,
    instruments=instruments,
    results=results,
    figures=figures,
    flags=("grains", "drum_radius", "length", "ends", "rotation", "friction", "duration", "equilibrate", "seed"),
    checkpoint_every=20_000,
)
