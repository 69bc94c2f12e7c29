"""Published scalings, and what is read from the tables of a column."""

import numpy as np
import pytest

from barchan.experiments.column import Column, scaling
from barchan.experiments.column.results import Tables, collapses


def test_scalings_are_those_of_the_papers_and_do_not_jump():
    assert scaling.run_out([1.0, 4.0]) == pytest.approx([1.24, 3.2])
    assert scaling.height([0.5, 64.0]) == pytest.approx([0.5, 1.76])
    assert scaling.saturated_height([0.5, 2.0]) == pytest.approx([0.5, 0.74])
    below, above = scaling.TALL * (1.0 - 1e-9), scaling.TALL * (1.0 + 1e-9)
    assert scaling.run_out(above) == pytest.approx(scaling.run_out(below), rel=0.02)
    assert scaling.height(above) == pytest.approx(scaling.height(below), rel=1e-6)


def test_a_collapse_is_read_from_the_release_to_the_end():
    scene = Column(columns=1, aspect_min=1.0, aspect_max=1.0, column_radius=0.04)
    times = np.linspace(-0.1, 0.4, 51)
    front = np.where(times < 0.0, 9.0, 0.04 + 0.05 * np.minimum(np.maximum(times, 0.0) / 0.2, 1.0))
    table = {
        "step": scene.release_step + np.round(times / scene.dt),
        "column": np.zeros(51),
        "since release [s]": times,
        "mean height [m]": np.where(times < -1e-9, 9.0, 0.02 + 0.5 * scene.diameter),
        "height [m]": np.linspace(0.04, 0.03, 51) + 0.5 * scene.diameter,
        "front [m]": front,
    }
    (one,) = collapses(scene, Tables(None, table, None))
    assert one.aspect == pytest.approx(1.0) and one.height == pytest.approx(0.03)
    assert one.run_out(scene.column_radius) == pytest.approx(1.25)
    assert one.time == pytest.approx(0.19, abs=0.011)
