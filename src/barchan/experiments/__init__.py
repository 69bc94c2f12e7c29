"""Ready scenes, each run by one command."""

from barchan.experiments.avalanche import AVALANCHE

#: All experiments by name.
EXPERIMENTS = {experiment.name: experiment for experiment in (AVALANCHE,)}
