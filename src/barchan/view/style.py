"""One look for all figures."""

from contextlib import contextmanager

import matplotlib
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from barchan import atomic

#: Okabe & Ito 2008: colours that colour-blind readers can tell apart.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")

#: For quantities: even in lightness and safe for colour-blind readers.
COLOUR_MAP = "viridis"

_LOOK = {
    "font.size": 9,
    "axes.prop_cycle": matplotlib.cycler(color=COLOURS),
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.alpha": 0.25,
    "lines.linewidth": 1.4,
    "legend.frameon": False,
    "savefig.dpi": 160,
}


@contextmanager
def figure(path, rows=1, columns=1, size=(6.4, 3.6), **subplots):
    """A figure that is written to ``path`` (PNG) when the block ends well; yields (figure, axes).

    It needs no display, and leaves the matplotlib settings of the program as they are.
    """
    with matplotlib.rc_context(_LOOK):
        drawing = Figure(figsize=size, layout="constrained")
        FigureCanvasAgg(drawing)
        yield drawing, drawing.subplots(rows, columns, **subplots)
        path.parent.mkdir(parents=True, exist_ok=True)
        with atomic.writing(path) as partial:
            drawing.savefig(partial, format="png")
