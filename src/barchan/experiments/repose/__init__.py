"""The angle of repose: a cylinder around grains, or a plate at their side, is lifted, and they run out into a pile.

Grains come to rest on a floor, in a hollow cylinder or between a wall and a plate; it is pulled up at a constant speed; when the
pile is at rest, a straight line through the profile of its surface gives the angle.
"""

from barchan.experiments.experiment import Experiment
from barchan.experiments.repose.figures import figures
from barchan.experiments.repose.observe import instruments
from barchan.experiments.repose.parameters import Repose
from barchan.experiments.repose.results import results
from barchan.experiments.repose.setup import build, stages

REPOSE = Experiment(
    name="repose",
    title="The angle of repose, by lifting a cylinder or a plate",
    scene=Repose,
    build=build,
    stages=stages,
    instruments=instruments,
    results=results,
    figures=figures,
    flags=("method", "grains", "friction", "lift_speed", "duration", "equilibrate", "seed"),
    checkpoint_every=5000,
)
