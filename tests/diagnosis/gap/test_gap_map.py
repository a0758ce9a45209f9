"""Gap map on tables made by hand."""

from dataclasses import replace

import numpy as np
from numpy.testing import assert_allclose

from carrierflex.diagnosis.gap.findings import cell_validations
from carrierflex.diagnosis.gap.gap_map import (
    N_DRAWS,
    CellTable,
    _adjusted,
    gap_cells,
    largest_cells,
    significant,
)
from carrierflex.identification.estimation.resampling import multinomial_counts


def table(run, coherent, *, p_value=1e-6, spread=0.0):
    """Two patterns by two orders; draws scatter about the coherent part."""
    coherent = np.array(coherent, dtype=float)[None]
    drawn = coherent * (1.0 + spread * np.random.default_rng(0).standard_normal((N_DRAWS, 1, 2, 2)))
    return CellTable(
        runs=(run,),
        patterns=("m=0", "m=2"),
        orders=np.array([0.0, 3.0]),
        mean_square=coherent + 1.0,
        coherent=coherent,
        p_value=np.full(coherent.shape, p_value),
        draws=lambda: drawn,
    )


def test_shares_of_all_tables_add_up_and_the_largest_cell_is_first():
    cells = gap_cells([table("A", [[1.0, 2.0], [3.0, 4.0]]), table("B", [[5.0, 0.0], [0.0, 5.0]])])
    assert_allclose(sum(cell.share for cell in cells), 1.0)
    assert cells[0].coherent == 5.0
    by_position = {(c.run, c.channel_pattern, c.order): c.share for c in cells}
    assert_allclose(by_position["A", "m=2", 3.0], 4.0 / 20.0)


def test_an_interval_is_a_point_without_scatter_and_holds_the_share_with_it():
    (cell, *_) = gap_cells([table("A", [[1.0, 2.0], [3.0, 4.0]])])
    assert_allclose(cell.share_ci95, (0.4, 0.4))
    (cell, *_) = gap_cells([table("A", [[1.0, 2.0], [3.0, 4.0]], spread=0.1)])
    low, high = cell.share_ci95
    # d share = sqrt((1 - s)^2 (0.1 s)^2 + s^2 0.1^2 sum of the others' squares) = 0.028.
    assert_allclose(high - low, 2.0 * 1.96 * 0.028, rtol=0.25)
    assert low < cell.share < high


def test_where_one_table_is_drawn_the_others_stay():
    steady = table("B", [[90.0, 0.0], [0.0, 0.0]])
    cells = gap_cells([table("A", [[1.0, 2.0], [3.0, 4.0]], spread=0.1), steady])
    of_steady = next(cell for cell in cells if cell.run == "B")
    assert_allclose(of_steady.share_ci95, (0.9, 0.9))


def test_cells_that_do_not_exist_are_left_out_and_count_in_no_p_value():
    full = table("A", [[1.0, 2.0], [3.0, 4.0]], p_value=0.004)
    partly_used = replace(full, used=np.array([[True, False], [False, False]]))
    assert len(gap_cells([partly_used])) == 1
    assert_allclose(gap_cells([partly_used])[0].p_value, 0.004)
    # Four equal p-values by Benjamini and Yekutieli: times 1 + 1/2 + 1/3 + 1/4.
    assert_allclose([c.p_value for c in gap_cells([full])], 0.004 * 25.0 / 12.0)
    assert significant(gap_cells([replace(full, p_value=full.p_value * 3)])) == []
    assert _adjusted([]).size == 0
    assert gap_cells([]) == ()


def test_without_a_gap_shares_are_unknown_and_nothing_is_significant():
    cells = gap_cells([table("A", np.zeros((2, 2)))])
    assert np.isnan([cell.share for cell in cells]).all()
    assert significant(cells) == []
    assert largest_cells([]) == []
    # Nor below the floor, whatever one cell holds.
    cells = gap_cells([table("A", [[3.0, 0.1], [-4.0, -1.0]], spread=0.1)])
    assert np.isnan([cell.share for cell in cells]).all()
    assert significant(cells) == []


def test_the_cells_that_stand_for_the_place_hold_four_fifths_of_the_gap():
    cells = gap_cells([table("A", [[5.0, 3.0], [1.5, 0.5]])])
    assert [cell.coherent for cell in largest_cells(significant(cells))] == [5.0, 3.0]


def test_every_draw_holds_as_many_repetitions_as_there_are():
    counts = multinomial_counts(7, N_DRAWS, seed=1)
    assert counts.shape == (N_DRAWS, 7)
    assert (counts.sum(axis=1) == 7.0).all()
    assert_allclose(counts.mean(axis=0), 1.0, atol=0.3)


def test_comparison_errors_of_many_cells_are_the_largest_thousand_with_those_of_the_other_map():
    rng = np.random.default_rng(5)
    before, after = (
        gap_cells([table(f"R{k}", 1.0 + rng.random((2, 2))) for k in range(400)]) for _ in range(2)
    )
    result = cell_validations(before, after, 0.0)
    by_place = {(c.run, c.channel_pattern, c.order): c for c in after}
    largest = sorted(significant(before), key=lambda c: -c.mean_square)[: len(result)]
    assert len(result) == 1000
    for row, cell in zip(result, largest, strict=True):
        position = (row.run, row.channel_pattern, row.order)
        assert position == (cell.run, cell.channel_pattern, cell.order)
        assert row.error_before == np.sqrt(cell.mean_square)
        assert row.error_after == np.sqrt(by_place[position].mean_square)
