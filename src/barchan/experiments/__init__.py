"""Ready scenes, each run by one command."""

from barchan.experiments.avalanche import AVALANCHE
from barchan.experiments.compression import COMPRESSION
from barchan.experiments.oedometer import OEDOMETER
from barchan.experiments.repose import REPOSE

#: All experiments by name.
EXPERIMENTS = {experiment.name: experiment for experiment in (AVALANCHE, COMPRESSION, OEDOMETER, REPOSE)}
