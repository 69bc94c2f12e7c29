"""A sand avalanche down an inclined plane: the main experiment of Walther & Sbalzarini 2009.

Grains on a lattice in a box with a floor and walls of two layers of immobile grains, periodic across; they come to rest in
the horizontal position; the box is tilted and its right wall removed; they flow down the floor until a wall at its lower end.
"""

from barchan.experiments.avalanche.figures import figures
from barchan.experiments.avalanche.observe import instruments
from barchan.experiments.avalanche.parameters import Avalanche
from barchan.experiments.avalanche.results import results
from barchan.experiments.avalanche.setup import build, stages
from barchan.experiments.experiment import Experiment

AVALANCHE = Experiment(
    name="avalanche",
    title="A sand avalanche down an inclined plane (Walther & Sbalzarini 2009)",
    scene=Avalanche,
    build=build,
    stages=stages,
    instruments=instruments,
    results=results,
    figures=figures,
)
