"""What is measured, and written, while a sample is compressed."""

from barchan.experiments.cell import Cell
from barchan.experiments.cell.observe import load_row, watching


def instruments(scene, directory):
    """The writers that watch a compression test.

    Args:
        scene: a ``Compression``.
        directory: of the run.
    """
    return watching(scene, directory, _row)


def _row(sim, scene):
    return load_row(sim, scene, float(Cell.of(sim).closing_rates().max()))
