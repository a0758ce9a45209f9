"""Figures of the diagnosis: the gap map before and after, and the ladder of added effects. Matplotlib late."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from diagnosis.gap_map import GapMap
from diagnosis.order_map import PATTERNS
from diagnosis.shrinkage import RevolutionLadder

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Smallest amplitude of the colour scale [µm]; cells below it have the same colour.
_FAINTEST_UM = 0.1


def gap_map_figure(before: GapMap, after: GapMap) -> "Figure":
    """RMS of the gap over order and sensor pattern, before and after effects are added; RMS over the runs.

    Parameters
    ----------
    before, after : GapMap
        Maps of the same runs.

    Returns
    -------
    matplotlib.figure.Figure
        Two heat maps with one logarithmic colour scale [µm].
    """
    from matplotlib.colors import LogNorm
    from matplotlib.figure import Figure

    cells = [cell_rms_um(gap) for gap in (before, after)]
    largest = max(float(cells[0].max()), 10.0 * _FAINTEST_UM)
    scale = LogNorm(vmin=_FAINTEST_UM, vmax=largest)
    figure = Figure(figsize=(9.0, 6.2), layout="constrained")
    panels = figure.subplots(2, 1, sharex=True)
    for panel, gap, values, title in zip(panels, (before, after), cells, ("before", "after"), strict=True):
        image = panel.imshow(np.maximum(values.T, _FAINTEST_UM), norm=scale, cmap="viridis", aspect="auto")
        for (order, column), value in np.ndenumerate(values):
            if value >= 1.0:
                dark = value < 0.1 * largest
                panel.text(
                    order, column, f"{value:.0f}", ha="center", va="center", color="white" if dark else "black", size=9
                )
        panel.set_yticks(range(len(PATTERNS)), [f"m = {'+' if m == 1 else ''}{m}" for m in PATTERNS])
        panel.set_xticks(gap.orders)
        panel.tick_params(labelbottom=True)
        panel.set_title(f"{title}: {gap.model}", fontsize=10)
        panel.set_ylabel("sensor pattern")
    panels[-1].set_xlabel("order of carrier rotation")
    figure.colorbar(image, ax=panels, label="RMS of the gap over the runs [µm]")
    return figure


def cell_rms_um(gap: GapMap) -> NDArray[np.float64]:
    """RMS of every cell over the runs [µm], shape (n_orders, 4)."""
    return 1e6 * np.sqrt(gap.mean_square.mean(axis=0))


def ladder_figure(result: RevolutionLadder) -> "Figure":
    """Held-out RMS as effects are added in turn, by run, with the noise floor.

    Parameters
    ----------
    result : RevolutionLadder
        The ladder.

    Returns
    -------
    matplotlib.figure.Figure
        RMS [µm], logarithmic, over the added effects.
    """
    from matplotlib.figure import Figure

    steps = ["baseline", *(f"+ {effect}" for effect in result.effects)]
    figure = Figure(figsize=(8.5, 5.0), layout="constrained")
    panel = figure.subplots()
    for k, run in enumerate(result.runs):
        panel.plot(steps, 1e6 * result.rms_by_run[:, k], "o-", linewidth=1.2, markersize=4, label=run)
    panel.plot(steps, 1e6 * result.rms, "k-", linewidth=2.2, label="all runs")
    panel.axhline(1e6 * result.noise_floor, color="0.4", linestyle="--", label="noise floor")
    panel.set_yscale("log")
    panel.set_ylabel("RMS on held-out revolutions [µm]")
    panel.set_title(
        f"RMS after / before: {result.rho[-1]:.3f}; with a placebo instead: {result.placebo_rho:.3f}", fontsize=10
    )
    panel.grid(which="both", alpha=0.3)
    figure.legend(loc="outside lower center", ncols=len(result.runs) + 2)
    return figure
