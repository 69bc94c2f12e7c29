"""Two bonded grains, of which one is pulled, sheared or spun: the verification of the bond by Cheung 2010 and Marketos 2013.

Three pairs stand in one scene. One grain of each is at rest, the other moves as told. Forces, moments and stresses are compared
with closed forms, step by step, and so is the step in which each bond breaks.
"""

from barchan.experiments.bond.figures import figures
from barchan.experiments.bond.observe import instruments
from barchan.experiments.bond.parameters import BondTest
from barchan.experiments.bond.results import results
from barchan.experiments.bond.setup import build, stages
from barchan.experiments.experiment import Experiment

BOND = Experiment(
    name="bond",
    title="Two bonded grains, pulled, sheared and spun until the bond breaks (Marketos et al. 2013)",
    scene=BondTest,
    build=build,
    stages=stages,
    instruments=instruments,
    results=results,
    figures=figures,
    flags=("radius", "radius_factor", "tensile_strength", "shear_strength", "increment", "steps"),
    checkpoint_every=5000,
)
