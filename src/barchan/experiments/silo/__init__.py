"""The discharge of silos: cylinders with flat floors, and outlets of several diameters.

Grains come to rest in silos side by side; their outlets are opened at once; the mass flows out of them give Beverloo's law, and
the pressure on the wall before is beside Janssen's.
"""

from barchan.experiments.experiment import Experiment
from barchan.experiments.silo.figures import figures
from barchan.experiments.silo.observe import instruments
from barchan.experiments.silo.parameters import Silo
from barchan.experiments.silo.results import results
from barchan.experiments.silo.setup import build, stages

SILO = Experiment(
    name="silo",
    title="The discharge of silos through outlets of several diameters (Beverloo et al. 1961)",
    scene=Silo,
    build=build,
    stages=stages,
    instruments=instruments,
    results=results,
    figures=figures,
    flags=("grains", "outlets", "outlet_min", "outlet_max", "silo_diameter", "friction", "duration", "equilibrate", "seed"),
    checkpoint_every=5000,
)
