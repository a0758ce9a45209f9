"""The bushing models and how they are identified: 2011 paper, figures 4 and 8."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch, Polygon
from numpy.typing import NDArray

from carrierflex.simulation.element.kernels import element_values, no_law, restoring_force
from carrierflex.simulation.mounting.table_3 import TABLE_3
from carrierflex.workflows.figures.mounting_figures import COLOURS
from carrierflex.workflows.figures.shared_runs import LABELS, SharedRuns
from carrierflex.workflows.figures.sketching import (
    INK,
    Point,
    arrow,
    box,
    damper,
    ground,
    line,
    prepare,
    spring,
    words,
)

#: Motion under which the laws are drawn: amplitude [m] and frequency [Hz] of a sine.
AMPLITUDE, FREQUENCY = 8e-3, 0.05
_SAMPLES = 4000
_LABELS = {"linear": "Lin", "nonlinear": "NLin", "hydrodynamic": "HD-b"}
#: Half the width of a step of the flow charts, and where their ways back run.
_HALF, _WAY_BACK = 1.4, 1.95


def bushing_models() -> Figure:
    """Elements of the hydro-dynamic bushing, and force over deflection of all three (figure 4)."""
    figure = Figure(figsize=(13.0, 5.6), layout="constrained")
    drawing, laws = figure.subplots(1, 2, width_ratios=(1.0, 1.25))
    prepare(drawing, (-2.3, 2.6), (-2.3, 2.6), "hydro-dynamic bushing")
    _draw_elements(drawing)
    _draw_laws(laws)
    return figure


def _force_loops(
    frequency: float = FREQUENCY, amplitude: float = AMPLITUDE
) -> dict[str, tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Deflection [m] and force [N] over the second cycle of a slow sine, by model of table 3.

    The fluid's mass has no influence (:mod:`carrierflex.simulation.mounting.bushings`): spring and
    damper of its branch stand in series.
    """
    t = np.linspace(0.0, 2.0 / frequency, 2 * _SAMPLES + 1)
    omega = 2.0 * np.pi * frequency
    u, rate = amplitude * np.sin(omega * t), amplitude * omega * np.cos(omega * t)
    limits, none = np.array([t[1], 1e-9]), np.zeros(0)
    loops = {}
    for name, constants in TABLE_3.items():
        values = {"K1": constants["K1"], "C1": constants["C1"]}
        values |= {key: constants[key] for key in ("K3", "K5", "Kp", "Fy") if key in constants}
        if "C3" in constants:
            values["C_q2v"] = constants["C3"]
        if "k" in constants:
            values |= {"k": constants["k"], "tau": constants["c"] / constants["k"]}
        flat = element_values(values)
        force = restoring_force(u, rate, np.zeros_like(u), flat, limits, no_law, no_law, none, none)
        loops[_LABELS[name]] = (u[_SAMPLES:], force[_SAMPLES:])
    return loops


def _draw_laws(axes: Axes) -> None:
    for label, (u, force) in _force_loops().items():
        axes.plot(u * 1e3, force / 1e3, color=COLOURS[label], lw=1.3, label=label)
    axes.set(
        xlabel="deflection $u$ [mm]", ylabel="force of one bushing [kN]",
        title=f"table 3, sine of {AMPLITUDE * 1e3:.0f} mm at {FREQUENCY:g} Hz",
    )  # fmt: skip
    axes.legend()
    axes.grid(alpha=0.3)


def _draw_elements(axes: Axes) -> None:
    top, bottom = 1.5, -1.5
    box(axes, (-1.9, 1.9), (top, top + 0.12), INK)
    ground(axes, (-1.9, 1.9), bottom, depth=0.18)
    spring(axes, (-1.4, bottom), (-1.4, top), width=0.4)
    words(axes, "$F_e$", (-1.85, 0.0), size=12.0)
    # Fluid branch: spring k below the mass, damper c between mass and body.
    spring(axes, (0.0, bottom), (0.0, -0.45), width=0.35, turns=3)
    box(axes, (-0.35, 0.35), (-0.45, 0.05), "#c3ccd6")
    damper(axes, (0.0, 0.05), (0.0, top), width=0.5)
    words(axes, "$k$", (-0.45, -1.0), size=12.0)
    words(axes, "$m$", (0.0, -0.2), size=12.0)
    words(axes, "$c$", (-0.5, 0.75), size=12.0)
    # Elasto-plastic element: spring in series with a slider.
    spring(axes, (1.4, bottom), (1.4, 0.2), width=0.35, turns=4)
    line(axes, [(1.4, top), (1.4, 0.95)], colour=INK, width=1.4)
    line(axes, [(1.15, 0.2), (1.15, 0.95)], colour=INK, width=3.0)
    line(axes, [(1.65, 0.2), (1.65, 0.95)], colour=INK, width=3.0)
    box(axes, (1.17, 1.63), (0.45, 0.95), "#c3ccd6")
    line(axes, [(1.15, 0.2), (1.65, 0.2)], colour=INK, width=1.4)
    words(axes, "$F_{ep}$", (2.0, -0.2), size=12.0)
    arrow(axes, (-1.9, 1.62), (-1.9, 2.2), "$u$", text_at=(-2.1, 2.0), width=1.4)
    arrow(axes, (0.55, -0.2), (0.55, 0.3), "$u_m$", text_at=(0.8, 0.1), width=1.4)
    arrow(axes, (0.0, 1.62), (0.0, 2.3), "$F$", text_at=(0.2, 2.3), width=1.8)


def identification_flow(shared: SharedRuns) -> Figure:
    """Flow of the complex method, and how it converges on this record (figure 8)."""
    figure = Figure(figsize=(14.5, 8.2), layout="constrained")
    main, sub, convergence = figure.subplots(1, 3, width_ratios=(1.0, 0.9, 1.35))
    prepare(main, (-1.5, 2.2), (-10.6, 0.9), "(a) main program")
    _draw_main_program(main)
    prepare(sub, (-1.7, 1.7), (-10.6, 0.9), "(b) subprograms")
    _draw_subprograms(sub)
    _draw_convergence(convergence, shared)
    return figure


def _draw_main_program(axes: Axes) -> None:
    steps = (
        "Main program start", "i = 0", "Randomly generate design\nwithin given limits",
        "Evaluate design\ni = i + 1",
    )  # fmt: skip
    for k, text in enumerate(steps):
        _step(axes, (0.0, -1.05 * k), text, round_ends=k == 0)
    for k in range(len(steps)):
        _link(axes, [(0.0, -1.05 * k - 0.36), (0.0, -1.05 * (k + 1) + 0.36)])
    _decision(axes, (0.0, -4.2), "i = n?")
    _link(axes, [(0.75, -4.2), (_WAY_BACK, -4.2), (_WAY_BACK, -2.1), (_HALF, -2.1)])
    words(axes, "No", (1.1, -4.02), size=8.0)
    lower = (
        "Identify worst design, $e_w$", "Mirror worst design", "Evaluate mirrored design",
        "Identify worst, $e_w$,\nand best design, $e_b$",
    )  # fmt: skip
    for k, text in enumerate(lower):
        _step(axes, (0.0, -5.3 - 1.05 * k), text)
        above = -4.2 if k == 0 else -5.3 - 1.05 * (k - 1)
        _link(axes, [(0.0, above - 0.36), (0.0, -5.3 + 0.36 - 1.05 * k)])
    words(axes, "Yes", (0.25, -4.72), size=8.0)
    _link(axes, [(0.0, -8.45 - 0.36), (0.0, -9.14)])
    _decision(axes, (0.0, -9.5), "$e_w - e_b$ < tol?")
    _link(axes, [(0.85, -9.5), (_WAY_BACK, -9.5), (_WAY_BACK, -6.35), (_HALF, -6.35)])
    words(axes, "No", (1.2, -9.32), size=8.0)
    _link(axes, [(0.0, -9.86), (0.0, -10.1)])
    words(axes, "Yes", (0.25, -9.98), size=8.0)
    _step(axes, (0.0, -10.35), "Main program end", round_ends=True, height=0.42)


def _draw_subprograms(axes: Axes) -> None:
    for top, steps in (
        (0.0, ("Evaluate design", "Run simulation", "Read simulated results",
               "Read measured results", "Calculate error (eq. 12)")),
        (-5.9, ("Run simulation", "Update parameters", "Choose bushing model",
                "March the record in time", "Zero, keep results\n(eqs. 13-15)")),
    ):  # fmt: skip
        for k, text in enumerate(steps):
            _step(axes, (0.0, top - 1.0 * k), text, round_ends=k == 0)
            if k:
                _link(axes, [(0.0, top - 1.0 * (k - 1) - 0.36), (0.0, top - 1.0 * k + 0.36)])


def _draw_convergence(axes: Axes, shared: SharedRuns) -> None:
    records = shared.mounting
    for model, label in LABELS.items():
        search, fit = records.searches[model], records.estimates[model].fit
        calls, least, largest = search.history.T
        worst = np.where(np.isfinite(largest), largest, np.nan)
        colour = COLOURS[label]
        end = "" if search.converged else ", stopped"
        axes.loglog(
            calls, least, color=colour, lw=1.8, label=f"{label}, best ({calls[-1]:.0f}{end})"
        )
        axes.loglog(calls, worst, color=colour, lw=0.7, alpha=0.6)
        axes.axhline(fit.cost, color=colour, ls=":", lw=1.2)
    axes.plot([], [], color="0.4", lw=0.7, label="worst of the population, $e_w$")
    axes.plot([], [], color="0.4", ls=":", label="least squares by gradients")
    axes.set(
        xlabel="simulations", ylabel="objective $e$ of equation 12",
        title="convergence of the complex method",
    )  # fmt: skip
    axes.legend(fontsize=9)
    axes.grid(which="both", alpha=0.25)


def _step(
    axes: Axes, at: Point, text: str, *, round_ends: bool = False, height: float = 0.72
) -> None:
    style = "round,pad=0,rounding_size=0.2" if round_ends else "square,pad=0"
    axes.add_patch(
        FancyBboxPatch(
            (at[0] - _HALF, at[1] - height / 2.0),
            2.0 * _HALF,
            height,
            boxstyle=style,
            facecolor="#eef2f6",
            edgecolor=INK,
            linewidth=0.9,
            zorder=3,
        )
    )
    axes.text(*at, text, ha="center", va="center", fontsize=8.5, color=INK, zorder=4)


def _decision(axes: Axes, at: Point, text: str) -> None:
    corners = [(at[0], at[1] + 0.36), (at[0] + 0.85, at[1]), (at[0], at[1] - 0.36),
               (at[0] - 0.85, at[1])]  # fmt: skip
    axes.add_patch(Polygon(corners, facecolor="#f6edd9", edgecolor=INK, linewidth=0.9, zorder=3))
    axes.text(*at, text, ha="center", va="center", fontsize=8.5, color=INK, zorder=4)


def _link(axes: Axes, points: list[Point]) -> None:
    """Line through points with a head at its end."""
    line(axes, points[:-1] if len(points) > 2 else points, colour=INK)
    arrow(axes, points[-2], points[-1], colour=INK, width=0.9)
