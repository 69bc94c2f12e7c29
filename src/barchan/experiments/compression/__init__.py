"""Compression of a sample under six stress-controlled walls: "A large-scale simulation" of Marketos et al. 2013.

Grains rain into a cuboid container and come to rest; what is above a height is removed and a wall put there; all six walls
are controlled so that the stress on each grows at a given rate.
"""

from barchan.experiments.compression.figures import figures
from barchan.experiments.compression.observe import instruments
from barchan.experiments.compression.parameters import Compression
from barchan.experiments.compression.results import results
from barchan.experiments.compression.setup import build, stages
from barchan.experiments.experiment import Experiment

COMPRESSION = Experiment(
    name="compression",
    title="Compression of a sample under six stress-controlled walls (Marketos et al. 2013)",
    scene=Compression,
    build=build,
    stages=stages,
    instruments=instruments,
    results=results,
    figures=figures,
    flags=("grains", "stress_rate", "end_stress", "dt", "controller", "gain", "seed"),
    checkpoint_every=20_000,
)
