import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.comparison.problem import GapCell
from carrierflex.diagnosis.gap.findings import GapMoment
from carrierflex.diagnosis.inference.results import GapReduction, SelectionStep
from carrierflex.diagnosis.report.figures import gap_in_time_figure
from carrierflex.diagnosis.report.gap_map_figure import (
    colour_limits,
    gap_grids,
    gap_map_figure,
    selection_figure,
)

NAN = float("nan")


def cell(pattern, order, run, square, *, p=1e-9, band=None):
    return GapCell(pattern, order, run, square, square, 0.1, (0.0, 0.2), p, band)


def test_patterns_are_rows_and_runs_are_averaged():
    before = [
        cell("m=2", 0, "A", 4.0),
        cell("m=2", 0, "B", 12.0),
        cell("m=0", 3, "A", 1.0),
        cell("s1", 1, "A", 2.0),
    ]
    after = [cell("m=2", 0, "A", 1.0, p=0.5)]
    grids = gap_grids(before, after)
    for grid in grids:
        assert (grid.row_name, grid.rows) == ("sensor pattern", ("m=0", "m=2", "s1"))
        assert_allclose(grid.edges, [-0.5, 0.5, 1.5, 2.5, 3.5])
        assert not grid.is_frequency
    assert_allclose(grids[0].rms[1, 0], np.sqrt(8.0))
    assert grids[0].is_significant[1, 0]
    assert np.isnan(grids[0].rms[0, 0])
    assert_allclose(grids[1].rms[1, 0], np.sqrt(0.5))
    assert not grids[1].is_significant.any()


def test_one_channel_gives_runs_as_rows_and_bands_as_columns():
    bands = [(0.0, 1.0), (1.0, 2.0), (2.0, 4.0), (4.0, 8.0)]
    cells = [
        cell("q", k, run, k + 1.0, band=band) for run in ("A", "B") for k, band in enumerate(bands)
    ]
    (grid,) = gap_grids(cells)
    assert (grid.row_name, grid.rows, grid.is_frequency) == ("run", ("A", "B"), True)
    assert_allclose(grid.edges, [0.5, 1.0, 2.0, 4.0, 8.0])
    assert_allclose(grid.rms**2, [[1, 2, 3, 4]] * 2)


def test_lines_are_joined_without_losing_any():
    cells = [cell("q", k, "A", 1.0, band=(0.5 * k, 0.5 * k)) for k in range(0, 401)]
    (grid,) = gap_grids(cells)
    assert grid.rms.shape[1] <= 30
    assert_allclose(np.sum(grid.rms**2), 401.0)
    assert (np.diff(grid.edges) > 0.0).all()
    assert np.isfinite(grid.rms).all()
    (few,) = gap_grids(cells[:6])
    assert_allclose(few.edges, [0.25, 0.75, 1.25, 1.75, 2.25, 2.75])


def test_several_channels_are_rows():
    (grid,) = gap_grids(
        [cell(name, 3.0, run, 1.0) for name in ("ssx", "sbx") for run in ("A", "B")]
    )
    assert (grid.row_name, grid.rows) == ("motion or sensor", ("sbx", "ssx"))


def test_no_cells_no_grid():
    assert gap_grids((), ()) == ()


def test_only_what_is_significant_is_coloured():
    grids = gap_grids([cell("m=0", 0, "A", 4e-12), cell("m=0", 1, "A", 1e-12, p=0.3)])
    limits = colour_limits(*grids)
    assert_allclose(limits, (2e-7, 2e-6))
    figure = gap_map_figure(grids[0], limits, "m")
    coloured = figure.axes[0].collections[1].get_array()
    assert_allclose(coloured.compressed(), [2.0])
    assert figure.axes[1].get_xlabel() == "RMS of the gap [µm]"


@pytest.mark.parametrize(("rho", "scale"), [(0.03, "log"), (0.6, "linear")])
def test_selection_shows_each_step_with_its_interval_and_the_lines(rho, scale):
    steps = (
        SelectionStep("baseline", 1.0, 1.0, (NAN, NAN)),
        SelectionStep("carrier_tilt", rho, rho, (0.9 * rho, 1.2 * rho)),
    )
    reduction = GapReduction(
        1.0,
        rho,
        0.5 * rho,
        rho,
        (0.0, 1.0),
        0.9,
        (0.8, 1.0),
        3.0,
        NAN,
        steps,
        (),
        (),
        (),
    )
    panel = selection_figure(reduction).axes[0]
    assert panel.get_xscale() == scale
    points, (_, _), (bars,) = panel.containers[0]
    assert_allclose(points.get_xdata(), [1.0, rho])
    ends = np.sort([segment[:, 0] for segment in bars.get_segments()])
    assert_allclose(ends, [[1.0, 1.0], [0.9 * rho, 1.2 * rho]])
    labels = [line.get_label() for line in panel.lines]
    assert [label for label in labels if not label.startswith("_")] == [
        f"noise floor: {0.5 * rho:.3f}"
    ]


def test_gap_in_time_draws_the_runs_with_the_largest_gap_in_one_unit():
    moments = [
        GapMoment(f"R{k}", t, (k + 1) * 1e-6 * (1.0 + t)) for k in range(8) for t in (0.0, 0.5)
    ]
    panel = gap_in_time_figure(moments, "m").axes[0]
    assert [line.get_label() for line in panel.lines] == ["R2", "R3", "R4", "R5", "R6", "R7"]
    assert_allclose(panel.lines[-1].get_xydata(), [[0.0, 8.0], [0.5, 12.0]])
    assert (panel.get_xlabel(), panel.get_ylabel()) == ("time [s]", "RMS of the gap [µm]")
