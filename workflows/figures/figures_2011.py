"""The twelve figures of "Modeling of Wind Turbine Gearbox Mounting" (2011)."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox

from carrierflex.simulation.mounting.torsional_train import TorsionalTrain, mounted_and_held_hz
from carrierflex.workflows.figures.bushing_figures import bushing_models, identification_flow
from carrierflex.workflows.figures.mounting_figures import (
    housing_motion,
    load_case,
    roll_of_three_models,
    six_motions,
)
from carrierflex.workflows.figures.paper_figure import PaperFigure, drawing
from carrierflex.workflows.figures.rig_drawings import (
    drive_train_with_loads,
    dynamometer,
    motion_sensors,
    mounted_bushings,
)
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
from carrierflex.workflows.simulation.compute_torsion import PAPER_FREQUENCIES_HZ, PAPER_STIFFNESSES

_RECORD = (
    "The record is simulated: times of section 4, levels from the axes of the paper's figure 6, "
    "nonlinear bushings of table 3."
)
_UNKNOWN = (
    " It also holds what no fitted model knows (unequal bushings, a radial load off the vertical, "
    "an elastic main bearing, gains of two sensors; chosen), so that no fit is perfect."
)
_CASE = "the case <code>mounting_2011</code> at the paper's 3.85 samples a second"


def _torque_over_rotation(shared: SharedRuns) -> Figure:
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


def _torsional_diagram() -> Figure:
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
    frequencies = mounted_and_held_hz(train)
    heavier = mounted_and_held_hz(TorsionalTrain(rotor=1.9e5))
    ring, one = "ring gear alone on the mounting", "all stages in one housing"
    rows = (
        ("ring gear on the bushings, as drawn", frequencies, ring),
        ("the same, rotor of 1.9e5 kg m²", heavier, ring),
        ("all stages in one housing", frequencies, one),
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


FIGURES_2011 = (
    PaperFigure(
        "2011", 1, "The dynamometer set-up",
        "The rig from the side: dynamometer, coupling, radial and axial load, main bearing, "
        "gearbox on torque arms, generator.",
        "A drawing, not to scale.",
        "Parts and names are the paper's; shapes are free.",
        drawing(dynamometer),
    ),
    PaperFigure(
        "2011", 2, "Main components of main shaft and gearbox",
        "Main shaft and gearbox with their parts, torque, radial load, bushing and the equivalent "
        "mass of the coupling.",
        "A section to scale from the dimensions of <code>geometry/</code> and "
        "<code>simulation/stage/stage_data.py</code>; walls, bearing outlines and the stations "
        "behind the carrier are drawn freely.",
        "The equivalent mass and its arm of 1750 mm are printed; the arm of the radial load is not "
        "and is chosen: 1220 mm in the stage, the hub; with the mass in the mounting's record.",
        drawing(drive_train_with_loads),
    ),
    PaperFigure(
        "2011", 3, "Bushings mounted in the gearbox",
        "The two bushings between torque arms and bedplate.",
        "A drawing, to scale in the bushings' distance of 750 mm from the axis.",
        "The distance is printed (figure 5); the bushing's section is drawn freely.",
        drawing(mounted_bushings),
    ),
    PaperFigure(
        "2011", 4, "The hydro-dynamic bushing; force over deflection of the three laws",
        "Elements of the hydro-dynamic bushing model: elastic, fluid and elasto-plastic force. The "
        "paper shows no force over deflection; it is added here.",
        "Equations 1 to 7 with the constants of table 3, by the laws of "
        "<code>simulation/element/kernels.py</code> under a slow sine. Equation 7 with both yield "
        "limits; equation 6 as spring and damper in series (the mass has no influence).",
        "The constants are the paper's.",
        drawing(bushing_models),
    ),
    PaperFigure(
        "2011", 5, "Locations of the motion sensors",
        "The six sensors on the housing from behind and from the side, with R<sub>x</sub>, "
        "R<sub>y</sub>, R<sub>z</sub>, R<sub>b</sub>, R<sub>yz</sub>.",
        "A drawing from <code>simulation/mounting/rig.py</code>, the matrix T of equation 8 behind "
        "the places.",
        "R<sub>x</sub>, R<sub>y</sub>, R<sub>z</sub> are printed; R<sub>b</sub> and "
        "R<sub>yz</sub> are not and are assumed.",
        drawing(motion_sensors),
    ),
    PaperFigure(
        "2011", 6, "Measured data from the load case",
        "Torque, port and starboard radial load and the six motion sensors over 655 s.",
        f"<code>carrierflex simulate mounting_2011</code>: {_CASE}.",
        f"{_RECORD}{_UNKNOWN} The cylinders' directions (45° to either side of upright) are "
        "assumed.",
        load_case, ("mounting",),
    ),
    PaperFigure(
        "2011", 7, "Data used in the parameter identification",
        "Displacements and rotations of the housing, d = T<sup>-1</sup> s.",
        "The record of figure 6 through equation 10; <code>carrierflex identify CAMPAIGN --model "
        "nonlinear_bushing --housing-motion</code> writes the same of any campaign.",
        "As figure 6.",
        housing_motion, ("mounting",),
    ),
    PaperFigure(
        "2011", 8, "Flow charts of the identification; convergence of the complex method",
        "Main program and subprograms of the complex method. The paper shows no convergence; it "
        "is added here.",
        "<code>identification/estimation/complex_method.py</code> on the record of figure 6 and "
        "equation 12, best and worst of the population over the simulations; dotted, what "
        "least squares by gradients reaches (<code>carrierflex identify --compare-complex</code>).",
        "The record as in figure 6; the weights of equation 12 (theta<sub>x</sub> tenfold) are "
        "chosen, the paper says only that theta<sub>x</sub> rules.",
        identification_flow, ("mounting",),
    ),
    PaperFigure(
        "2011", 9, "Comparison of theta_x: test and three bushing models",
        "Roll of the housing: test, nonlinear, linear and hydro-dynamic bushing.",
        "Three models identified from the record of figure 6 by <code>carrierflex identify "
        "--model hydrodynamic_bushing</code>, each simulated with what was found.",
        "The test's bushings are those of table 3 (nonlinear), so the linear model must be the "
        "worst here; in the paper the hydro-dynamic one is, which shows a search that had not "
        "converged: it contains the nonlinear one. The intervals of the constants in "
        "figures.json do not include what no model knows: true constants may lie outside them.",
        roll_of_three_models, ("mounting",),
    ),
    PaperFigure(
        "2011", 10, "Six motions measured and adapted, nonlinear bushings",
        "Displacements and rotations of the housing, measured (m) and of the model (a).",
        "The nonlinear model of figure 9.",
        "As figure 9. What is left in d<sub>z</sub>, theta<sub>y</sub> and theta<sub>z</sub> is "
        "what the models do not know.",
        six_motions, ("mounting",),
    ),
    PaperFigure(
        "2011", 11, "Torque as function of main shaft rotation",
        "Torque over the rotation of the carrier, housing held and output locked; 27 MNm/rad by "
        "regression.",
        "Static equilibria of the planetary stage under a growing torque, housing and generator "
        "turned back (<code>carrierflex study torsion</code>).",
        "The stiffness of the sun shaft and the shaft's diameter were derived from the printed 27 "
        "and 50 MNm/rad: the slopes are put in, that the line is straight is not.",
        _torque_over_rotation, ("bodies", "torque_sweep"),
    ),
    PaperFigure(
        "2011", 12, "The torsional drive train",
        "Inertias, stiffnesses and ratios of the simplified drive train.",
        "<code>simulation/mounting/torsional_train.py</code>; frequencies as <code>carrierflex "
        "torsion</code> gives them.",
        "All numbers but the ratios' signs are the paper's; the frequencies are computed.",
        drawing(_torsional_diagram),
    ),
)  # fmt: skip
