"""A bonded rock in unconfined compression, in direct tension, and as a Brazilian disc.

From one block of grains that touch nobody three specimens are cut; neighbours are bonded, and each is loaded until it has failed:
side by side, in one simulation.
"""

from barchan.experiments.experiment import Experiment
from barchan.experiments.rock.figures import figures
from barchan.experiments.rock.observe import instruments
from barchan.experiments.rock.parameters import Rock
from barchan.experiments.rock.results import results
from barchan.experiments.rock.setup import build, stages

ROCK = Experiment(
    name="rock",
    title="A bonded rock in compression, in tension and as a Brazilian disc",
    scene=Rock,
    build=build,
    stages=stages,
    instruments=instruments,
    results=results,
    figures=figures,
    flags=("test", "grains", "modulus", "tensile_strength", "shear_strength", "duration", "seed"),
    checkpoint_every=5000,
)
