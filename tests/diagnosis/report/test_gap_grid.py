import numpy as np
from numpy.testing import assert_allclose

from carrierflex.diagnosis.comparison.problem import GapCell
from carrierflex.diagnosis.report.figures import (
    colour_limits,
    gap_grids,
    gap_map_figure,
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
