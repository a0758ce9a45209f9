"""The fourteen figures of the 2012 paper on deflections in the planetary stage."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from carrierflex.fe.carrier_curves import UNIT_TORQUE
from carrierflex.fe.load_cases import gear_forces, radial
from carrierflex.geometry.parameters import CarrierParameters, GearData
from carrierflex.geometry.pins import pin_angles
from carrierflex.geometry.view import LIGHTING, skin
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.carrier.carrier_identification import two_revolutions
from carrierflex.identification.view import parameters_figure, signals_figure
from carrierflex.simulation.carrier.run_cases import AXIAL
from carrierflex.workflows.figures.drive_train import DriveTrain, pitch_radii
from carrierflex.workflows.figures.finite_element_figures import (
    boundary_conditions,
    deflection_curves,
    deformation_over_plane,
    pilot_nodes,
    seventh_mode,
)
from carrierflex.workflows.figures.paper_figure import PaperFigure, drawing
from carrierflex.workflows.figures.rig_drawings import main_components
from carrierflex.workflows.figures.scenes import rendered
from carrierflex.workflows.figures.shared_runs import SHOWN, SharedRuns
from carrierflex.workflows.figures.sketching import (
    CARRIER,
    FORCE,
    GEAR,
    HOUSING,
    INK,
    MEASURE,
    SENSOR,
    STEEL,
    Point,
    arrow,
    box,
    cross,
    dashed_arc,
    dimension,
    disc,
    leader,
    line,
    outline,
    prepare,
    sheet,
    turning_arrow,
    words,
)

_CARRIER = (
    "The carrier's dimensions are this project's (docs/decisions/0001): gear data, centre distance "
    "and sensor radius are published, plate thicknesses were chosen so that mass and rim "
    "deflection agree with what is published."
)
_RECORDS = (
    "The records are simulated by the case <code>stage_papers_gap</code>: the stage in time with "
    "the most probable causes of tables 4 and 5 (docs/papers.md). Tilt of the measured face, "
    "saddle and the pin out of place were fitted to those tables, the rim deflection by a pin fit "
    "to table 4. Sensor zeroes and gains are chosen."
)
_STAGE = ("flexible", "stiff", "bodies", "stage")
#: Housing angles of the axial and of the radial sensors [deg] (section 2).
_AXIAL_SENSORS, _RADIAL_SENSORS = (47, 137, 227, 317), (40, 310)
_TILT_H, _TILT_PLC = SENSOR, "#d07a1e"
#: Outlines above the axis in the drawing of the tilts, not to scale.
_HOUSING_SHELL = (
    (-0.28, 0.22),
    (-0.28, 0.62),
    (0.6, 0.62),
    (0.6, 0.54),
    (-0.20, 0.54),
    (-0.20, 0.22),
)
_CARRIER_HALF = (
    (0.0, 0.0), (0.0, 0.44), (0.1, 0.44), (0.1, 0.3), (0.32, 0.3), (0.32, 0.44), (0.4, 0.44),
    (0.4, 0.0),
)  # fmt: skip
#: Parameters of model M1, figure 10, and what M2 adds, figure 11.
_RIGID_PARAMETERS = ("d_x", "theta_H", "phi_H", "theta_PLC", "phi_PLC")
_DEFLECTION_PARAMETERS = ("rho_s", "rho_f")


def _identified_signals(shared: SharedRuns) -> Figure:
    """LC2 measured and identified at the four axial sensors (figure 9)."""
    stage = shared.stage
    fits = [(model, stage.estimates[model.name][SHOWN]) for model in stage.models]
    return signals_figure(stage.measured(), stage.campaign.channels_of(AXIAL), fits)


def _rigid_parameters(shared: SharedRuns) -> Figure:
    """Parameters of M1 by load case, by both models (figure 10)."""
    return parameters_figure(shared.stage.estimates, _RIGID_PARAMETERS)


def _deflection_parameters(shared: SharedRuns) -> Figure:
    """Scales of the deflection curves by load case (figure 11)."""
    return parameters_figure({"m2": shared.stage.estimates["m2"]}, _DEFLECTION_PARAMETERS)


def _measured_and_simulated(shared: SharedRuns) -> Figure:
    """LC2 measured and simulated at the four axial sensors (figure 14)."""
    stage = shared.stage
    channels = stage.campaign.channels_of(AXIAL)
    figure = Figure(figsize=(9.0, 7.5), layout="constrained")
    panels = figure.subplots(2, 2, sharex=True, sharey=True).ravel()
    gaps = []
    for panel, channel in zip(panels, channels, strict=True):
        turns, measured = _less_its_mean(stage.measured(), channel.name)
        simulated_turns, simulated = _less_its_mean(stage.simulated, channel.name)
        panel.plot(turns, measured * 1e3, color="0.6", label="measured")
        panel.plot(simulated_turns, simulated * 1e3, color="#0072b2", lw=1.2, label="simulated")
        gaps.append(measured - np.interp(turns, simulated_turns, simulated))
        panel.set_title(f"{channel.name}, sensor at {np.rad2deg(channel.angle or 0.0):.0f}°")
        panel.grid(alpha=0.3)
    for panel in panels[::2]:
        panel.set_ylabel("axial displacement\nless its mean [mm]")
    for panel in panels[2:]:
        panel.set_xlabel("carrier angle [revolutions]")
    rms = float(np.sqrt(np.mean(np.square(gaps)))) * 1e3
    figure.suptitle(f"{SHOWN}: measured and simulated, RMS of the gap {rms:.3f} mm")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure


def _less_its_mean(run: Run, name: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """First two revolutions of a signal: carrier angle [revolutions], displacement [m]."""
    shown = two_revolutions(run)
    turns = run.inputs["carrier_angle"][shown] / (2.0 * np.pi)
    signal = run.signals[name][shown]
    return turns - turns[0], signal - signal.mean()


def _at_angle(radius: float, degrees: float) -> Point:
    """Place on the drawing, seen from upwind, of a point at a housing angle."""
    angle = np.deg2rad(degrees)
    return radius * float(np.sin(angle)), radius * float(np.cos(angle))


def _sensor_locations(shared: SharedRuns) -> Figure:
    """Carrier with the six proximity sensors, in space and from upwind (2012, figure 2)."""
    carrier = shared.parameters.carrier
    mesh, R = shared.flexible.mesh, carrier.sensor_radius
    seats = {
        f"$s_e^{{{v}}}$": np.concatenate([[0.0], R * radial(np.deg2rad(v))[1:]])
        for v in _AXIAL_SENSORS
    }
    rims = {
        f"$s_e^{{{v}}}$": np.array([0.03, 0.0, 0.0]) + carrier.outer_radius * radial(np.deg2rad(v))
        for v in _RADIAL_SENSORS
    }

    def add(plotter: Any) -> None:
        plotter.add_mesh(skin(mesh), color=CARRIER, smooth_shading=True, split_sharp_edges=True,
                         **LIGHTING)  # fmt: skip
        for seat in seats.values():
            plotter.add_arrows(seat - [0.2, 0.0, 0.0], np.array([0.2, 0.0, 0.0]), color=SENSOR)
        for seat in rims.values():
            outward = seat * [0.0, 1.0, 1.0] / carrier.outer_radius
            plotter.add_arrows(seat + 0.16 * outward, -0.16 * outward, color=FORCE)

    tails = {name: seat - [0.26, 0.0, 0.0] for name, seat in seats.items()} | {
        name: seat * [1.0, 1.42, 1.42] for name, seat in rims.items()
    }
    scene = rendered(add, tails, (-1.6, 0.75, 0.6))
    figure = Figure(figsize=(12.5, 6.2), layout="constrained")
    space, front = figure.subplots(1, 2)
    scene.show(space, left=0.08, right=0.08, above=0.1, below=0.08)
    for name in tails:
        colour = SENSOR if name in seats else FORCE
        words(space, name, scene.pixels[name], colour=colour, size=13.0)
    _draw_front(front, carrier)
    return figure


def _draw_front(axes: Axes, carrier: CarrierParameters) -> None:
    prepare(axes, (-0.68, 0.68), (-0.62, 0.66), "seen from upwind, along +x")
    _draw_carrier_front(axes, carrier)
    R = carrier.sensor_radius
    disc(axes, (0.0, 0.0), R, "none", style="--", layer=4.0)
    for v in _AXIAL_SENSORS:
        disc(axes, _at_angle(R, v), 0.02, SENSOR, layer=6.0)
        words(axes, f"$s_e^{{{v}}}$", _at_angle(0.53, v + 2.0), colour=SENSOR, size=13.0)
    for v in _RADIAL_SENSORS:
        arrow(axes, _at_angle(0.55, v), _at_angle(carrier.outer_radius, v), colour=FORCE)
        words(axes, f"$s_e^{{{v}}}$", _at_angle(0.61, v - 3.0), colour=FORCE, size=13.0)
    dimension(axes, (0.0, 0.0), _at_angle(R, 180.0), "", text_at=(0.0, -5.0))
    words(axes, f"$R_s$ = {R * 1e3:.0f} mm", (0.13, -0.33), colour=MEASURE)
    turning_arrow(axes, (0.0, 0.0), 0.155, (90.0, 43.0), r"$\theta_x$", text_at=(0.085, 0.19),
                  colour=INK)  # fmt: skip
    cross(axes, (0.0, 0.0), 0.14, "y", "z", to_left=True)


def _draw_carrier_front(axes: Axes, carrier: CarrierParameters) -> None:
    disc(axes, (0.0, 0.0), carrier.outer_radius, CARRIER)
    disc(axes, (0.0, 0.0), carrier.hub_outer_diameter / 2.0, "#b8c9dc", layer=3.0)
    disc(axes, (0.0, 0.0), carrier.hub_inner_diameter / 2.0, "white", layer=3.0)
    for angle in pin_angles(carrier.n_planets):
        centre = _at_angle(carrier.centre_distance, float(np.rad2deg(angle)))
        disc(axes, centre, carrier.pin_hole_radius, STEEL, layer=2.5)


def _frames_and_angles() -> Figure:
    """Housing's and carrier's frame, axes of both tilts and the angles to a sensor (figure 3)."""
    figure, axes = sheet((8.6, 8.0), (-1.45, 1.45), (-1.25, 1.42))
    theta_x = 24.0
    theta_H = 68.0
    theta_PLC = 118.0
    sensor = 47.0
    disc(axes, (0.0, 0.0), 1.0, "#eef2f6")
    for degrees, name, colour in ((0.0, "z_H", INK), (270.0, "y_H", INK)):
        arrow(axes, (0.0, 0.0), _at_angle(1.2, degrees), f"${name}$", colour=colour, width=1.4)
    for degrees, name in ((theta_x, "z_{PLC}"), (270.0 + theta_x, "y_{PLC}")):
        arrow(axes, (0.0, 0.0), _at_angle(1.13, degrees), f"${name}$", colour=MEASURE, width=1.4)
    for degrees, colour in ((theta_H, _TILT_H), (theta_x + theta_PLC, _TILT_PLC)):
        line(axes, [_at_angle(1.0, degrees + 180.0), _at_angle(1.0, degrees)], colour=colour,
             width=2.4)  # fmt: skip
    words(axes, r"tilt axis $\phi_H$", _at_angle(1.22, theta_H + 4.0), colour=_TILT_H, size=11.0)
    words(axes, r"tilt axis $\phi_{PLC}$", _at_angle(1.13, theta_x + theta_PLC + 4.0),
          colour=_TILT_PLC, size=11.0)  # fmt: skip
    line(axes, [(0.0, 0.0), _at_angle(1.0, sensor)], style="--")
    disc(axes, _at_angle(1.0, sensor), 0.035, SENSOR, layer=8.0)
    words(axes, "sensor $v$", _at_angle(1.19, sensor), colour=SENSOR, size=11.0)
    _angle(axes, 0.22, (0.0, theta_x), r"$\theta_x(t)$", INK, 12.0, 0.33)
    _angle(axes, 0.42, (0.0, sensor), "$v$", SENSOR, 36.0, 0.49)
    _angle(axes, 0.56, (0.0, theta_H), r"$\theta_H$", _TILT_H, 10.0, 0.64)
    _angle(axes, 0.70, (theta_x, theta_x + theta_PLC), r"$\theta_{PLC}$", _TILT_PLC, 92.0, 0.79)
    _angle(axes, 0.84, (sensor, theta_H), r"$\theta_H^v$", _TILT_H, 57.0, 0.75)
    _angle(axes, 0.92, (sensor, theta_x + theta_PLC), r"$\theta_{PLC}^v$", _TILT_PLC, 112.0, 1.05)
    words(
        axes,
        "seen from upwind; all angles from z, positive about +x:\n"
        r"$\theta_H^v=\theta_H-v$   (2),   "
        r"$\theta_{PLC}^v=\theta_x(t)+\theta_{PLC}-v$   (3)",
        (0.0, -1.14),
    )
    return figure


def _angle(
    axes: Axes, radius: float, degrees: tuple[float, float], text: str, colour: str,
    text_degrees: float, text_radius: float,
) -> None:  # fmt: skip
    """Arc with a head between two housing angles."""
    turning_arrow(
        axes, (0.0, 0.0), radius, (90.0 - degrees[0], 90.0 - degrees[1]), text,
        text_at=_at_angle(text_radius, text_degrees), colour=colour, width=1.2,
    )  # fmt: skip


def _tilts() -> Figure:
    """Misalignment of housing and of carrier, far exaggerated (2012, figure 4)."""
    figure = Figure(figsize=(11.5, 4.8), layout="constrained")
    panels = figure.subplots(1, 2)
    for axes, title, housing, carrier in (
        (panels[0], r"housing tilted by $\phi_H$: the axis is fixed", 7.0, 0.0),
        (panels[1], r"carrier tilted by $\phi_{PLC}$: the axis turns with the shaft", 0.0, 7.0),
    ):
        prepare(axes, (-2.15, 0.95), (-0.95, 0.95), title)
        line(axes, [(-2.1, 0.0), (0.9, 0.0)], style="-.")
        box(axes, (-2.0, 0.0), (-0.15, 0.15))
        leader(axes, "Main shaft", (-1.5, 0.05), (-1.5, 0.45))
        for side in (1.0, -1.0):
            shell = [(x, side * z) for x, z in _HOUSING_SHELL]
            body = [(x, side * z) for x, z in _CARRIER_HALF]
            outline(axes, _turned(shell, housing), HOUSING)
            outline(axes, _turned(body, carrier), CARRIER)
        sensor = _turned([(-0.20, 0.41), (-0.02, 0.41)], housing)
        arrow(axes, sensor[0], sensor[1], colour=SENSOR)
        words(axes, "sensor", (sensor[0][0] - 0.30, sensor[0][1] + 0.02), colour=SENSOR)
        angle, colour = (housing, _TILT_H) if housing else (carrier, _TILT_PLC)
        line(axes, _turned([(0.0, 0.0), (0.9, 0.0)], angle), colour=colour, width=1.6)
        turning_arrow(axes, (0.0, 0.0), 0.72, (0.0, -angle), colour=colour)
        name = r"$\phi_H$" if housing else r"$\phi_{PLC}$"
        words(axes, name, (0.82, -0.22), colour=colour, size=12.0)
    leader(panels[0], "Housing", (0.17, 0.565), (-0.6, 0.85))
    leader(panels[1], "Planet carrier", (0.05, -0.36), (-0.75, -0.7))
    return figure


def _turned(points: list[Point], degrees: float) -> list[Point]:
    """Points turned about the origin, clockwise."""
    angle = -np.deg2rad(degrees)
    cos, sin = float(np.cos(angle)), float(np.sin(angle))
    return [(cos * x - sin * z, sin * x + cos * z) for x, z in points]


def _gear_force_drawing() -> Figure:
    """Forces on planets and carrier, pressure and helix angle, with their sizes (figure 5)."""
    figure = Figure(figsize=(13.5, 6.0), layout="constrained")
    train, tooth = figure.subplots(1, 2, width_ratios=(1.0, 1.15))
    drive = DriveTrain()
    prepare(train, (-0.72, 0.72), (-0.66, 0.70), "(a) planets and carrier, seen from upwind")
    _draw_gear_train(train, drive)
    forces = gear_forces(UNIT_TORQUE, drive.gear, drive.carrier.n_planets)
    prepare(tooth, (-0.2, 3.2), (-1.75, 1.45), "(b) pressure angle and helix angle")
    _draw_tooth_forces(tooth, drive.gear)
    words(
        tooth,
        "for T = 1 kN m:  "
        f"$F_{{PLC}}$ = {forces.F_PLC:.0f} N,  $F_t$ = {forces.F_t:.0f} N,\n"
        rf"$F_n' = F_t / \cos\alpha$ = {forces.F_n:.0f} N (4),  "
        rf"$F_a = F_n' \tan\beta$ = {forces.F_a:.1f} N (5),"
        "\n"
        rf"$M_t = d F_a$ = {forces.M_t:.2f} N m (6; the paper prints 30.3)",
        (1.5, -1.45),
        size=10.0,
    )
    return figure


def _draw_gear_train(axes: Axes, drive: DriveTrain) -> None:
    radii, a = pitch_radii(drive.gear), drive.gear.centre_distance
    disc(axes, (0.0, 0.0), 0.60, GEAR)
    disc(axes, (0.0, 0.0), radii["ring"], "white")
    disc(axes, (0.0, 0.0), radii["sun"], GEAR, layer=4.0)
    leader(axes, "Sun", (-0.05, 0.05), (-0.30, 0.02))
    leader(axes, "Ring", (-0.42, 0.36), (-0.62, 0.60))
    leader(axes, "Planet", (-0.10, 0.36), (-0.38, 0.66))
    for number, degrees in enumerate(np.rad2deg(pin_angles(drive.carrier.n_planets))):
        centre = _at_angle(a, float(degrees))
        disc(axes, centre, radii["planet"], "#ecdcae", layer=3.0)
        disc(axes, centre, drive.carrier.pin_hole_radius, STEEL, layer=4.0)
        along = np.array(_at_angle(1.0, float(degrees) + 90.0))
        # The torque drives the carrier clockwise in this view: the pins push the planets along,
        # sun and ring hold them back.
        for radius, size, name in (
            (a - radii["planet"], 0.13, "$F_t$"), (a + radii["planet"], 0.13, "$F_t$"),
        ):  # fmt: skip
            head = np.array(_at_angle(radius, float(degrees)))
            arrow(axes, tuple(head), tuple(head - size * along), name if number == 0 else "")
        head = np.array(centre)
        arrow(
            axes, tuple(head), tuple(head + 0.2 * along), "$F_{PLC}$" if number == 0 else "",
            colour=SENSOR,
        )  # fmt: skip
    turning_arrow(axes, (0.0, 0.0), 0.645, (20.0, -20.0), "T", text_at=(0.70, 0.0), colour=INK)
    line(axes, [(0.0, 0.0), _at_angle(a, 120.0)], style="-.")
    words(axes, f"$a$ = {a * 1e3:.0f} mm", _at_angle(0.17, 108.0), colour=MEASURE)


def _draw_tooth_forces(axes: Axes, gear: GearData) -> None:
    """Transverse plane on the left, plane of the pitch cylinders on the right."""
    alpha, beta = gear.pressure_angle, gear.helix_angle
    origin = (0.25, -0.55)
    tangential = (origin[0] + 1.0, origin[1])
    normal = (origin[0] + 1.0, origin[1] + float(np.tan(alpha)))
    arrow(axes, origin, tangential, "$F_t$")
    arrow(axes, origin, normal, "$F_n'$")
    arrow(axes, tangential, normal, "", colour=MEASURE, width=1.0)
    words(axes, "$F_r$", (normal[0] + 0.14, (normal[1] + tangential[1]) / 2.0), colour=MEASURE)
    dashed_arc(axes, origin, 0.62, (0.0, float(np.rad2deg(alpha))), INK)
    words(axes, rf"$\alpha$ = {np.rad2deg(alpha):.0f}°", (1.06, -0.42))
    words(axes, "transverse plane", (0.75, -0.85))
    rack = (1.95, -0.55)
    for k in range(6):
        x = rack[0] + 0.17 * k
        lean = 1.3 * float(np.tan(beta))
        outline(axes, [(x, -0.55), (x + 0.09, -0.55), (x + 0.09 + lean, 0.75), (x + lean, 0.75)],
                GEAR, layer=1.5)  # fmt: skip
    foot = (rack[0], rack[1])
    line(axes, [foot, (foot[0], 0.95)], style="-.")
    line(axes, [foot, (foot[0] + 1.5 * float(np.tan(beta)), 0.95)], colour=INK)
    words(axes, rf"$\beta$ = {np.rad2deg(beta):.1f}°", (2.06, 1.08))
    start = (2.62, 0.1)
    arrow(axes, start, (start[0] + 0.45, start[1]), "$F_n'$")
    arrow(axes, start, (start[0], start[1] + 0.45), "$F_a$", colour=SENSOR)
    cross(axes, (1.55, 0.35), 0.28, "", "x")
    words(axes, "along the tooth's width", (2.5, -0.85))


FIGURES_2012 = (
    PaperFigure(
        "2012", 1, "Naming of the main components",
        "Section of the gearbox with the names of its parts.",
        "A section to scale from the dimensions of <code>geometry/</code> and "
        "<code>simulation/stage/stage_data.py</code>; walls, bearing outlines and the stations "
        "behind the carrier are drawn freely, the parallel shafts turned into the plane.",
        "Names and gear data are the papers'.",
        drawing(main_components),
    ),
    PaperFigure(
        "2012", 2, "Location of the proximity sensors",
        "The carrier with its two machined faces and six sensors: four axial at R<sub>s</sub> = "
        "412 mm, two radial.",
        "The mesh of the carrier (<code>carrierflex mesh</code>), sensors as in "
        "<code>simulation/cases/stage_lc1.toml</code>.",
        f"Angles and radius are printed. {_CARRIER}",
        _sensor_locations, ("flexible",),
    ),
    PaperFigure(
        "2012", 3, "Coordinate systems and angles",
        "Frames of housing and carrier, the axes of both tilts, angles to one sensor.",
        "A drawing by the conventions of <code>geometry/</code>: the frame is right-handed with x "
        "downwind, so y points left for who looks along x.",
        "Equations 2 and 3 as printed.",
        drawing(_frames_and_angles),
    ),
    PaperFigure(
        "2012", 4, "Misalignment of carrier and housing",
        "Both tilts exaggerated.",
        "A drawing, not to scale.",
        "Nothing is computed.",
        drawing(_tilts),
    ),
    PaperFigure(
        "2012", 5, "Calculation of forces",
        "Tangential forces at a planet; pressure and helix angle with normal and axial force.",
        "A drawing to scale in the pitch circles; numbers by <code>fe/load_cases.py</code>.",
        "Equations 4 to 6 and table 3 are the paper's. Equation 5 as printed gives 6 % more axial "
        "force than the usual F<sub>t</sub> tan beta.",
        drawing(_gear_force_drawing),
    ),
    PaperFigure(
        "2012", 6, "Boundary conditions of the finite elements",
        "Carrier with pins: upwind end held, force and tilting moment on every pin.",
        "The mesh and the pilots of <code>carrierflex curves</code> (stiff variant).",
        _CARRIER,
        boundary_conditions, ("stiff",),
    ),
    PaperFigure(
        "2012", 7, "Axial deformation over y and z",
        "Deflection patterns of the stiff and the flexible model.",
        "<code>carrierflex curves</code>: static solution under 1 kNm, the upwind face coloured by "
        "its axial displacement; colours end at the largest displacement near the rim.",
        _CARRIER,
        deformation_over_plane, ("stiff", "flexible"),
    ),
    PaperFigure(
        "2012", 8, "Axial deformation over the angle",
        "The same along the rim: six peaks stiff, three flexible.",
        "<code>carrierflex curves</code>.",
        f"{_CARRIER} The number of peaks follows from the carrier's symmetry and was not fitted.",
        deflection_curves, ("stiff", "flexible"),
    ),
    PaperFigure(
        "2012", 9, "Measurements and identified models, LC2",
        "Four axial sensors at half torque with M1 and M2.",
        "<code>carrierflex simulate stage_papers_gap</code> for the measurement, "
        "<code>carrierflex identify --model m2 --per-run</code> for the models. What both leave is "
        "the static saddle, which no tilt and no deflection that turns can follow.",
        _RECORDS,
        _identified_signals, _STAGE,
    ),
    PaperFigure(
        "2012", 10, "Parameters of the rigid-body model",
        "d<sub>x</sub>, theta and phi of housing and carrier by load case, M1 and M2.",
        "As figure 9, with 95 % intervals.",
        _RECORDS,
        _rigid_parameters, _STAGE,
    ),
    PaperFigure(
        "2012", 11, "Parameters of the deflection model",
        "Scales rho<sub>s</sub> and rho<sub>f</sub> by load case, M2.",
        "As figure 9. The scales belong to 1 kNm curves: shares of 1, not of the torque.",
        f"{_RECORDS} The pins of the records are neither bonded nor absent but fitted with 1.7e7 "
        "Nm/rad.",
        _deflection_parameters, _STAGE,
    ),
    PaperFigure(
        "2012", 12, "Seventh mode of main shaft and carrier",
        "First elastic mode of the free main shaft and carrier; the pins pivot.",
        "<code>carrierflex reduce</code> for the three bodies and <code>carrierflex join</code>: "
        "reduced bodies joined at the pins' six interfaces, modes of the free assembly.",
        f"The interface stiffness of 1e6 Nm/rad is the paper's. {_CARRIER}",
        seventh_mode, ("flexible", "bodies"),
    ),
    PaperFigure(
        "2012", 13, "Pilot nodes on the carrier",
        "Two pilots an interface, tied in translation, with torsional springs; RBE3 to the bores.",
        "Pilots of <code>carrierflex reduce --variant flexible</code>; every fourth of the nodes "
        "that a pilot averages is drawn.",
        "The interface is the paper's. It calls RBE3 rigid; distributing couplings, as here, are "
        "not (docs/reduction.md).",
        pilot_nodes, ("flexible", "bodies"),
    ),
    PaperFigure(
        "2012", 14, "Measured and simulated deflection, LC2",
        "Four axial sensors at half torque, measurement and multibody simulation.",
        "Measured: the record of figure 9. Simulated: <code>stage_paper_lc2</code>, the paper's "
        "own model (planet bearings by rollers, main shaft of finite elements, spur gears), with "
        "the tilt that M1 found.",
        f"{_RECORDS} The simulated stage is another one (bearings, pin fit, shaft, gears), but its "
        "tilt comes from the record, as in the paper. Means are left out: the sensors' zeroes are.",
        _measured_and_simulated, _STAGE,
    ),
)  # fmt: skip
