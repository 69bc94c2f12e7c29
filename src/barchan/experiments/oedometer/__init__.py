"""One-dimensional compression with unloading, in an oedometer.

Grains rain into a cuboid cell and come to rest; what is above a height is removed and the top put there; its stress grows at a
given rate to a maximum, is held, and taken back at the same rate. The floor and the side walls stay where they are.
"""

from barchan.experiments.experiment import Experiment
from barchan.experiments.oedometer.figures import figures
from barchan.experiments.oedometer.observe import instruments
from barchan.experiments.oedometer.parameters import Oedometer
from barchan.experiments.oedometer.results import results
from barchan.experiments.oedometer.setup import build, stages

OEDOMETER = Experiment(
    name="oedometer",
    title="One-dimensional compression in an oedometer, with unloading",
    scene=Oedometer,
    build=build,
    stages=stages,
    instruments=instruments,
    results=results,
    figures=figures,
    flags=("grains", "stress_rate", "max_stress", "end_stress", "wall_friction", "dt", "seed"),
    checkpoint_every=20_000,
)
