"""What the study of the pin fit found, and its two pictures."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from carrierflex.fe.curve_mixes import convex_mix, least_squares_mix
from carrierflex.reduction.pin_fit import ExtremeCurves, PinFitFamily, PinFitRow

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Residuals of a :class:`carrierflex.reduction.pin_fit.PinFitRow` in words.
RESIDUALS = {
    "residual": "stiff and flexible, best shares",
    "residual_nonnegative": "same, shares of zero or more",
    "residual_convex": "same, shares that add up to one",
    "residual_clamped": "stiff and flexible, shaft face clamped",
    "residual_ends": "rigid and free fit, best shares",
}
#: Changes of the curve's character by name: peaks beyond one a planet, size of the paper's curve.
MORE_PEAKS, TABLE_4 = "more peaks than planets", "RMS of Table 4"
_COLOURS = ("#1f5fa8", "#c8501e", "#3a8f4d", "#7a4fa3", "#555555")
#: Stiffnesses whose curves are drawn over their mixes [N m/rad].
_DRAWN = (1e6, 1.4e7, 1e8, np.inf)


@dataclass(frozen=True, eq=False)
class PinFitStudy:
    """Curves, figures and conclusions of a sweep of the pin fit."""

    family: Annotated[PinFitFamily, "Curve by stiffness, the pins tied along x as in the paper"]
    extremes: Annotated[ExtremeCurves, "The paper's two extremes"]
    rows: Annotated[
        tuple[PinFitRow, ...], "By ascending stiffness, first with pins tied along x, then sliding"
    ]
    changes: Annotated[
        dict[str, float], "Interface stiffness at which the curve's character changes [N m/rad]"
    ]

    @cached_property
    def tied(self) -> tuple[PinFitRow, ...]:
        """Rows of pins tied along x."""
        return tuple(row for row in self.rows if row.axial == "tied")

    @cached_property
    def worst(self) -> dict[str, dict[str, dict[str, float]]]:
        """Largest residual over the sweep, and the stiffness where it stands.

        By axial fit and kind of mix.
        """
        largest: dict[str, dict[str, dict[str, float]]] = {}
        for axial in ("tied", "sliding"):
            rows = [row for row in self.rows if row.axial == axial]
            largest[axial] = {}
            for name in RESIDUALS:
                row = max(rows, key=lambda row: getattr(row, name))
                largest[axial][name] = {"residual": getattr(row, name), "stiffness": row.stiffness}
        return largest


def sweep_figure(study: PinFitStudy) -> "Figure":
    """Draw orders, RMS, shares and residuals over the interface stiffness, 0 and ∞ at the edges."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 10.5), layout="constrained")
    axes = figure.subplots(3, 1, sharex=True)
    x = _positions(study.tied)
    amplitudes = {
        f"order {order}": [row.orders[order] for row in study.tied]
        for order in study.tied[0].orders
    }
    amplitudes["RMS"] = [row.rms for row in study.tied]
    _draw(axes[0], x, amplitudes, scale=1e6)
    axes[0].set_ylabel("axial rim deflection [µm per kN m]")
    shares = {
        "rho_s": "ρ_s, stiff",
        "rho_f": "ρ_f, flexible",
        "rho_s_convex": "ρ_s where both add up to one",
    }
    _draw(axes[1], x, _columns(study.tied, shares))
    axes[1].set_ylabel("shares of the best mix")
    drawn = {name: text for name, text in RESIDUALS.items() if name != "residual_nonnegative"}
    _draw(axes[2], x, _columns(study.tied, drawn))
    axes[2].set_yscale("log")
    axes[2].set_ylim(1e-4, 1.0)
    axes[2].set_ylabel("RMS residual of the mix / RMS of the curve")
    for axis in axes:
        for name, colour, style in ((MORE_PEAKS, "black", "--"), (TABLE_4, "0.6", ":")):
            if name in study.changes:
                axis.axvline(study.changes[name], color=colour, lw=1.0, ls=style, zorder=0)
        axis.grid(alpha=0.25)
        axis.legend(loc="best", framealpha=1.0)
    axes[0].set_title(
        f"dashed: {study.family.n_planets} peaks left of it, more right of it; dotted: RMS of the "
        "paper's Table 4",
        loc="left",
    )
    axes[2].set_xlabel("bending stiffness of each pin interface [N m/rad]")
    ticks = [x[0], *10.0 ** np.arange(4, 13, 2), x[-1]]
    axes[2].set_xticks(ticks, ["0", *(f"1e{power}" for power in range(4, 13, 2)), "∞"])
    axes[2].minorticks_off()
    return figure


def _positions(rows: Sequence[PinFitRow]) -> np.ndarray:
    """Places of the stiffnesses on a logarithmic axis."""
    x = np.array([row.stiffness for row in rows])
    inside = x[(x > 0.0) & np.isfinite(x)]
    return np.where(x == 0.0, inside.min() / 10.0, np.where(np.isinf(x), inside.max() * 10.0, x))


def _columns(rows: Sequence[PinFitRow], texts: dict[str, str]) -> dict[str, list[float]]:
    """Values of the rows' fields by what the legend calls them."""
    return {text: [getattr(row, name) for row in rows] for name, text in texts.items()}


def _draw(axis: Any, x: np.ndarray, columns: dict[str, list[float]], *, scale: float = 1.0) -> None:
    for colour, (text, values) in zip(_COLOURS, columns.items(), strict=False):
        y = scale * np.array(values)
        axis.plot(x[1:-1], y[1:-1], color=colour, lw=1.6, label=text)
        axis.plot(x[[0, -1]], y[[0, -1]], "o", color=colour, ms=5)
    axis.set_xscale("log")


def mix_figure(study: PinFitStudy) -> "Figure":
    """Draw the curves of a few fits over their best and their convex mix.

    One pin's sector of the rim.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 7.0), layout="constrained")
    axes = figure.subplots(2, 2, sharex=True)
    stiff, flexible = study.extremes.stiff, study.extremes.flexible
    half = 180.0 / study.family.n_planets
    for axis, stiffness in zip(axes.ravel(), _DRAWN, strict=True):
        curve = study.family.curve(stiffness)
        best, convex = least_squares_mix(curve, stiff, flexible), convex_mix(curve, stiff, flexible)
        angle = np.linspace(-half, half, 361)
        drawn = (
            (curve, "joined carrier and pins", {"color": "black", "lw": 2.2}),
            (
                best.curve,
                f"best mix, {100.0 * best.residual:.1f} % left",
                {"color": _COLOURS[0], "ls": "--"},
            ),
            (
                convex.curve,
                f"shares add up to one, {100.0 * convex.residual:.1f} % left",
                {"color": _COLOURS[1], "ls": ":"},
            ),
        )
        for drawn_curve, text, style in drawn:
            axis.plot(angle, 1e6 * drawn_curve.axial_at(np.deg2rad(angle)), label=text, **style)
        rigid = "rigid" if np.isinf(stiffness) else f"{stiffness:.2g} N m/rad"
        axis.set_title(f"{rigid}: ρ_s {best.rho_s:.2f}, ρ_f {best.rho_f:.2f}", loc="left")
        axis.legend(fontsize="small", framealpha=1.0)
        axis.grid(alpha=0.25)
    for axis in axes[1]:
        axis.set_xlabel("carrier-frame angle from pin 1 [deg]")
        axis.set_xticks(np.linspace(-half, half, 5))
        axis.xaxis.set_major_formatter("{x:.3g}")
    for axis in axes[:, 0]:
        axis.set_ylabel("axial deflection [µm per kN m]")
    return figure
