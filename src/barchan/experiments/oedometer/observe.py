"""What is measured, and written, while a sample is in the oedometer."""

from barchan.experiments.cell import Cell
from barchan.experiments.cell.observe import load_row, watching


def instruments(scene, directory):
    """The writers that watch an oedometer test.

    Args:
        scene: an ``Oedometer``.
        directory: of the run.
    """
    return watching(scene, directory, _row)


def _row(sim, scene):
    cell = Cell.of(sim)
    upward = float(sum(wall.force[2] for wall in cell))  # with friction, the sides carry a part of what presses on the top
    return load_row(sim, scene, abs(float(cell.closing_rates()[2]))) | {"vertical force on all walls [N]": upward}
