"""The table of derivatives beside remeshed differences."""

import numpy as np

from studies.tabulate_sensitivities import Comparison, comparison_lines


def test_scatter_is_pooled_over_the_dimensions_and_shown_over_each_span():
    """Root of the mean square of 3e-12 and 4e-12 m; 1 and 2 mm between the meshes."""
    one, other = (
        Comparison(
            name,
            span,
            on_one_mesh=np.array([2e-6, 1e-6]),
            remeshed=np.array([2e-6, 1e-6 + 5e-9]),
            scatter=np.array([scatter, scatter]),
        )
        for name, span, scatter in (("carrier.a", 1e-3, 3e-12), ("carrier.b", 2e-3, 4e-12))
    )
    pooled = 1e6 * np.sqrt((3e-12**2 + 4e-12**2) / 2.0)
    lines = comparison_lines([one, other])
    assert len(lines) == 2 + 4
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]
    assert [row[:2] for row in cells[:2]] == [["carrier.a", "N"], ["carrier.a", "2 N"]]
    assert cells[0][4] == f"{pooled / 1e-3:.3f}"
    assert cells[2][4] == f"{pooled / 2e-3:.3f}"
    assert (cells[0][5], cells[1][5]) == ("0.0", f"{5e-3 / (pooled / 1e-3):.1f}")
