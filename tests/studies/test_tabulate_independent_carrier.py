"""Table of both codes' orders, from orders that lie on known lines."""

import numpy as np

from studies.tabulate_independent_carrier import FITS, comparison_table


def test_limits_and_their_difference_stand_in_the_table():
    sizes = (0.03, 0.025, 0.02), (0.06, 0.045, 0.03)
    n = 2 * (2 + len(FITS))
    limits = 1e-7 * np.arange(1, n + 1).reshape(2, -1)
    ours, theirs = (
        np.array([factor * limits - 1e-6 * size for size in mesh_sizes])
        for factor, mesh_sizes in zip((1.0, 1.02), sizes, strict=True)
    )
    lines = comparison_table(sizes, (ours, theirs))
    assert len(lines) == 2 + n
    for k, line in enumerate(lines[2:]):
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        assert len(cells) == 1 + 3 + 3 + 2 + 1
        assert cells[-1] == "2.0"
        # um per kN m; the finest mesh of each code stands before the limits.
        assert float(cells[3]) == np.round(1e6 * ours[2].ravel()[k], 4)
        assert float(cells[-3].partition(" ")[0]) == np.round(0.1 * (k + 1), 4)
    assert lines[2].startswith("| none, order 3 |")
    assert lines[2 + n // 2].startswith("| none, order 6 |")
