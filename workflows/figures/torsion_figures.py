"""Torque sweep and torsional drive train: 2011 paper, figures 11 and 12."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox

from carrierflex.simulation.mounting.torsional_train import TorsionalTrain, mounted_and_held_hz
from carrierflex.workflows.figures.shared_runs import SharedRuns
from carrierflex.workflows.figures.sketching import (
    CARRIER,
    GEAR,
    INK,
    STEEL,
    arrow,
    box,
    ground,
    line,
    prepare,
    spring,
    words,
)
from carrierflex.workflows.simulation.compute_torsion import (
    PAPER_FREQUENCIES_HZ,
    PAPER_STIFFNESSES,
)


def torque_over_rotation(shared: SharedRuns) -> Figure:
    """Torque over rotation, housing held and output locked (figure 11)."""
    sweeps = shared.torque_sweep
    figure = Figure(figsize=(7.5, 5.4), layout="constrained")
    axes = figure.subplots()
    for name, sweep, style in (
        ("gearbox", sweeps.gearbox, "o-"), ("main shaft", sweeps.main_shaft, "s--"),
    ):  # fmt: skip
        axes.plot(
            np.append(0.0, sweep.rotation) * 1e3, np.append(0.0, sweep.torque) / 1e5, style, ms=4,
            label=f"{name}: {sweep.stiffness / 1e6:.1f} MNm/rad "
            f"(paper: {PAPER_STIFFNESSES[name] / 1e6:.0f})",
        )  # fmt: skip
    axes.set(
        xlabel="Main shaft rotation [$10^{-3}$ rad]", ylabel="Torque [$10^5$ Nm]",
        xlim=(0.0, 8.4), ylim=(0.0, 2.4),
    )  # fmt: skip
    axes.legend(loc="upper left")
    axes.grid(alpha=0.3)
    return figure


def torsional_diagram() -> Figure:
    """Inertias, stiffnesses and ratios of the torsional train, and its frequencies (figure 12)."""
    train = TorsionalTrain()
    figure = Figure(figsize=(13.5, 7.0), layout="constrained")
    axes = figure.subplots()
    prepare(axes, (-0.5, 13.6), (-5.1, 2.3))
    _draw_chain(axes, train)
    _draw_bushings(axes, train)
    _draw_frequencies(axes, train)
    return figure


def _draw_chain(axes: Axes, train: TorsionalTrain) -> None:
    inertias = (
        (0.0, 1.2, "Rotor\n$J$ = $2\\cdot10^5$ kg m²", STEEL),
        (3.0, 1.2, f"MS & PLC\n$J$ = {train.shaft_and_carrier:.0f} kg m²", CARRIER),
        (8.2, 1.0, f"LS\n$J$ = {train.low_speed:.0f} kg m²", STEEL),
        (12.2, 1.2, f"Generator\n$J$ = {train.generator:.0f} kg m²", STEEL),
    )
    for x, width, text, colour in inertias:
        box(axes, (x, x + width), (-0.7, 0.7), colour)
        words(axes, text, (x + width / 2.0, 1.25))
    for start, end, text in (
        (1.2, 3.0, f"MS\n$k$ = {train.shaft_stiffness / 1e6:.0f} MNm/rad"),
        (4.2, 6.0, f"Gearbox\n$k$ = {train.gearbox_stiffness / 1e6:.0f} MNm/rad"),
    ):
        spring(axes, (start, 0.0), (end, 0.0), width=0.5)
        words(axes, text, ((start + end) / 2.0, -0.75))
    for x, text in ((6.0, "Planetary\nstage"), (9.9, "Parallel\nstages")):
        box(axes, (x, x + 1.4), (-0.9, 0.9), GEAR)
        words(axes, text, (x + 0.7, 0.0))
    for start, end in ((7.4, 8.2), (9.2, 9.9), (11.3, 12.2)):
        line(axes, [(start, 0.0), (end, 0.0)], colour=INK, width=2.2)
    for x, text in ((0.0, r"$\omega_{MS}$"), (8.0, r"$\omega_{LS}$"), (11.7, r"$\omega_{HS}$")):
        arrow(axes, (x - 0.35, 1.95), (x + 0.35, 1.95), text, text_at=(x + 0.75, 1.95), width=1.2)
    words(
        axes,
        r"$\omega_{LS}/\omega_{PLC}=2\,(39+21)/21$"
        f" = {train.planetary_ratio:.2f}\n(printed as −5.71; with the ring"
        "\nfixed the sun turns with the carrier)",
        (8.35, -1.75),
    )
    words(
        axes,
        r"$\omega_{HS}/\omega_{LS}=\frac{82}{23}\cdot\frac{88}{22}$"
        f" = {train.parallel_ratio:.2f}",
        (11.4, -1.35),
    )


def _draw_bushings(axes: Axes, train: TorsionalTrain) -> None:
    """The ring gear on its bushings, as the paper draws it."""
    line(axes, [(6.7, -0.9), (6.7, -1.2)], colour=INK, width=2.2)
    spring(axes, (6.7, -2.6), (6.7, -1.2), width=0.4)
    ground(axes, (6.2, 7.2), -2.6, depth=0.25)
    words(axes, f"Bushings\n$k$ = {train.bushing_stiffness / 1e6:.1f} MNm/rad", (5.3, -1.9))


def _draw_frequencies(axes: Axes, train: TorsionalTrain) -> None:
    """First frequencies by topology and mounting, beside the printed ones."""
    found = mounted_and_held_hz(train)
    heavier = mounted_and_held_hz(TorsionalTrain(rotor=1.9e5))
    ring, one = "ring gear alone on the mounting", "all stages in one housing"
    rows = (
        ("ring gear on the bushings, as drawn", found, ring),
        ("the same, rotor of 1.9e5 kg m²", heavier, ring),
        ("all stages in one housing", found, one),
    )
    mounts = ("held", "on bushings")
    cells = [
        [name, *(f"{values[topology, mount][0]:.3f}" for mount in mounts)]
        for name, values, topology in rows
    ]
    printed = (f"{PAPER_FREQUENCIES_HZ[mount]:.2f}" for mount in mounts)
    cells.append(["paper (printed as rad/s)", *printed])
    table = axes.table(
        cells,
        colLabels=["first frequency [Hz]", "without bushings", "with bushings"],
        colWidths=[0.26, 0.13, 0.13],
        cellLoc="center",
        bbox=Bbox.from_bounds(0.2, 0.01, 0.62, 0.27),
    )
    table.auto_set_font_size(False)
    table.set_fontsize(10)
