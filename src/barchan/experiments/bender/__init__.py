"""Waves through a sample under pressure, as bender elements send them in the laboratory.

Grains in a periodic box are pressed, or stand on a crystal; a thin layer of them, or a patch, is shaken by a pulse of one sine;
what grains at larger and larger distances then do gives the speeds of shear and compression waves, by several methods.
"""

from barchan.experiments.bender.figures import figures
from barchan.experiments.bender.observe import instruments
from barchan.experiments.bender.parameters import Bender
from barchan.experiments.bender.results import results
from barchan.experiments.bender.setup import build, stages
from barchan.experiments.experiment import Experiment

BENDER = Experiment(
    name="bender",
    title="Waves through a sample under pressure, as of bender elements (Marketos et al. 2013)",
    scene=Bender,
    build=build,
    stages=stages,
    instruments=instruments,
    results=results,
    figures=figures,
    flags=("packing", "across", "along", "pressure", "shear_frequency", "compression_frequency", "sweep", "patch", "seed"),
    checkpoint_every=5000,
)
