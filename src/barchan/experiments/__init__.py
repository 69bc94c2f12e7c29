"""Ready scenes, each run by one command."""

from barchan.experiments.avalanche import AVALANCHE
from barchan.experiments.bond import BOND
from barchan.experiments.column import COLUMN
from barchan.experiments.compression import COMPRESSION
from barchan.experiments.oedometer import OEDOMETER
from barchan.experiments.repose import REPOSE
from barchan.experiments.rock import ROCK
from barchan.experiments.shear import SHEAR
from barchan.experiments.silo import SILO

#: All experiments by name.
EXPERIMENTS = {
    experiment.name: experiment for experiment in (AVALANCHE, BOND, COLUMN, COMPRESSION, OEDOMETER, REPOSE, ROCK, SHEAR, SILO)
}
