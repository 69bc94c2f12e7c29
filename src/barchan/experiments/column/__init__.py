"""The collapse of columns of grains that differ in their aspect ratios.

Grains come to rest in cylinders side by side on a rough floor; the cylinders are taken away at once; run-out and height of the
deposits are beside published scalings.
"""

from barchan.experiments.column.figures import figures
from barchan.experiments.column.observe import instruments
from barchan.experiments.column.parameters import Column
from barchan.experiments.column.results import results
from barchan.experiments.column.setup import build, stages
from barchan.experiments.experiment import Experiment

COLUMN = Experiment(
    name="column",
    title="The collapse of columns of several aspect ratios (Lube et al. 2004)",
    scene=Column,
    build=build,
    stages=stages,
    instruments=instruments,
    results=results,
    figures=figures,
    flags=("columns", "aspect_min", "aspect_max", "column_radius", "friction", "duration", "equilibrate", "seed"),
    checkpoint_every=5000,
)
