"""Ready scenes, each run by one command."""

from barchan.experiments.avalanche import AVALANCHE
from barchan.experiments.bender import BENDER
from barchan.experiments.bond import BOND
from barchan.experiments.column import COLUMN
from barchan.experiments.compression import COMPRESSION
from barchan.experiments.drum import DRUM
from barchan.experiments.oedometer import OEDOMETER
from barchan.experiments.repose import REPOSE
from barchan.experiments.rock import ROCK
from barchan.experiments.shear import SHEAR
from barchan.experiments.silo import SILO

#: All experiments by name.
EXPERIMENTS = {
    experiment.name: experiment
    for experiment in (AVALANCHE, BENDER, BOND, COLUMN, COMPRESSION, DRUM, OEDOMETER, REPOSE, ROCK, SHEAR, SILO)
}
