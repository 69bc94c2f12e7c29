"""Simple shear of grains in a periodic box, at a constant normal stress: friction and solid fraction over the inertial number.

The box is sheared after Lees and Edwards, without walls, at one rate after another, each half of the one before; its height is
what the normal stress makes it.
"""

from barchan.experiments.experiment import Experiment
from barchan.experiments.shear.figures import figures
from barchan.experiments.shear.observe import instruments
from barchan.experiments.shear.parameters import Shear
from barchan.experiments.shear.results import results
from barchan.experiments.shear.setup import build, stages

SHEAR = Experiment(
    name="shear",
    title="Simple shear in a periodic box: friction and solid fraction over the inertial number",
    scene=Shear,
    build=build,
    stages=stages,
    instruments=instruments,
    results=results,
    figures=figures,
    flags=("grains", "pressure", "friction", "restitution", "inertial_number", "rates", "strain", "seed"),
    checkpoint_every=20_000,
)
