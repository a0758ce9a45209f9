"""The rig drawn from the project's own dimensions: 2011 paper, figures 1, 2, 3, 5; 2012, figure 1.

What is not published is drawn freely; each drawing says so where it matters.
"""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from carrierflex.simulation.mounting.rig import MountingRig
from carrierflex.workflows.figures.drive_train import (
    DriveTrain,
    draw_bushing,
    draw_gearbox,
    draw_main_shaft,
)
from carrierflex.workflows.figures.sketching import (
    FORCE,
    FRAME,
    HOUSING,
    INK,
    RUBBER,
    SENSOR,
    STEEL,
    Point,
    arrow,
    box,
    cross,
    dimension,
    disc,
    ground,
    leader,
    line,
    outline,
    prepare,
    sheet,
    turning_arrow,
    words,
)


def main_components() -> Figure:
    """Names of the main components, on a section of main shaft and gearbox (2012, figure 1)."""
    train = DriveTrain()
    figure, axes = sheet((11.0, 6.6), (-2.75, 1.75), (-1.12, 1.28))
    draw_main_shaft(axes, train)
    draw_gearbox(axes, train)
    draw_bushing(axes, train)
    named: dict[str, tuple[Point, Point]] = {
        "Hub flange": ((-2.37, 0.25), (-2.55, 0.72)),
        "Main bearing": ((train.bearing_x, 0.23), (-1.95, 0.92)),
        "Main shaft (MS)": ((-1.2, 0.1), (-1.2, 0.5)),
        "Planet carrier (PLC)": ((0.03, 0.41), (-0.55, 0.95)),
        "Planet pin": ((0.03, 0.30), (-0.62, 0.66)),
        "Planet (PL)": ((0.185, 0.48), (0.05, 1.12)),
        "Ring": ((0.23, 0.56), (0.42, 1.20)),
        "Sun": ((0.2, 0.05), (-0.62, -0.62)),
        "Sun shaft": ((0.44, 0.02), (0.66, -0.72)),
        "Low speed shaft (LS)": ((0.95, -0.06), (1.38, -0.30)),
        "Intermediate speed\nshaft (IMS)": ((1.10, 0.46), (1.46, 0.30)),
        "High speed shaft (HS)": ((1.38, 0.735), (1.36, 1.05)),
        "Housing": ((0.75, 0.875), (0.86, 1.14)),
        "Bearing PLC-A": ((-0.06, -0.26), (-0.75, -0.40)),
        "Bearing PLC-B": ((0.38, -0.225), (0.42, -0.92)),
        "Bushing": ((0.1, -0.70), (-0.40, -0.90)),
    }
    for text, (at, text_at) in named.items():
        leader(axes, text, at, text_at)
    cross(axes, (-2.6, -1.0), 0.25, "x", "z")
    return figure


def drive_train_with_loads() -> Figure:
    """Main shaft and gearbox with torque, radial load and equivalent mass (2011, figure 2)."""
    train = DriveTrain()
    figure, axes = sheet((13.0, 5.6), (-4.6, 1.85), (-1.15, 1.30))
    draw_main_shaft(axes, train)
    draw_gearbox(axes, train)
    draw_bushing(axes, train)
    flange = train.shaft.flange_x(train.carrier) - 0.06
    line(axes, [(train.coupling_x, 0.0), (flange, 0.0)], colour=INK, width=2.5)
    disc(axes, (train.coupling_x, 0.0), 0.16, RUBBER)
    arm = train.mounting.ntl_arm
    arrow(
        axes, (train.bearing_x - arm, 0.75), (train.bearing_x - arm, 0.05), "$F_{NTL}$",
        text_at=(train.bearing_x - arm, 0.88),
    )  # fmt: skip
    turning_arrow(axes, (-2.9, 0.0), 0.3, (-120.0, 120.0), "T", text_at=(-2.78, 0.42), colour=FORCE)
    named: dict[str, tuple[Point, Point]] = {
        "Equivalent mass\n4100 kg": ((train.coupling_x, -0.1), (-4.05, -0.55)),
        "Hub flange for connection to\ndynamometer coupling": ((-2.37, 0.28), (-2.62, 1.16)),
        "Main bearing": ((train.bearing_x, 0.23), (-1.75, 0.80)),
        "Main shaft (MS)": ((-1.2, 0.1), (-1.1, 0.5)),
        "Planet carrier (PLC)": ((0.03, 0.41), (-0.65, 0.98)),
        "Sun shaft": ((0.44, 0.02), (0.62, -0.74)),
        "Low speed shaft": ((0.95, -0.06), (1.45, -0.30)),
        "IMS": ((1.10, 0.46), (1.42, 0.36)),
        "HS": ((1.38, 0.735), (1.55, 0.98)),
        "Bushing": ((0.1, -0.70), (-0.45, -0.90)),
    }
    for text, (at, text_at) in named.items():
        leader(axes, text, at, text_at)
    dimension(
        axes, (train.coupling_x, -0.95), (train.bearing_x, -0.95),
        f"{train.mounting.coupling_arm * 1e3:.0f} mm",
    )  # fmt: skip
    line(axes, [(train.coupling_x, -0.75), (train.coupling_x, -1.0)])
    dimension(
        axes, (train.bearing_x - arm, 0.60), (train.bearing_x, 0.60),
        f"{arm * 1e3:.0f} mm (chosen)", text_at=(train.bearing_x - arm / 2.0, 0.66),
    )  # fmt: skip
    return figure


def dynamometer() -> Figure:
    """The dynamometer set-up from the side, not to scale (2011, figure 1)."""
    figure, axes = sheet((12.0, 4.8), (-7.6, 4.2), (-1.95, 2.15))
    ground(axes, (-7.4, 4.1), -1.5, depth=0.15)
    box(axes, (-4.1, 4.0), (-1.5, -1.15), HOUSING)
    outline(axes, [(-7.2, -1.5), (-7.0, 0.75), (-5.9, 0.75), (-5.7, -1.5)], STEEL)
    box(axes, (-5.9, -4.5), (-0.14, 0.14))
    box(axes, (-4.5, -3.9), (-0.5, 0.5), RUBBER)
    box(axes, (-3.9, -3.65), (-0.38, 0.38))
    box(axes, (-3.65, 0.0), (-0.19, 0.19))
    outline(axes, [(-3.1, -1.15), (-2.95, 0.45), (-2.35, 0.45), (-2.2, -1.15)], HOUSING)
    outline(
        axes, [(0.0, -0.75), (0.0, 0.75), (0.85, 0.75), (0.85, 1.05), (1.7, 1.05), (1.7, -0.55),
               (0.85, -0.55), (0.85, -0.75)],
        HOUSING,
    )  # fmt: skip
    outline(axes, [(0.15, -1.15), (0.25, 0.1), (0.65, 0.1), (0.75, -1.15)], STEEL, layer=3.0)
    disc(axes, (0.45, 0.0), 0.16, RUBBER, layer=4.0)
    disc(axes, (0.45, 0.0), 0.08, STEEL, layer=5.0)
    box(axes, (1.7, 2.4), (0.66, 0.84))
    box(axes, (2.4, 3.8), (0.25, 1.25), STEEL)
    box(axes, (2.5, 2.7), (-1.15, 0.25), STEEL)
    box(axes, (3.5, 3.7), (-1.15, 0.25), STEEL)
    arrow(axes, (-4.2, 1.55), (-4.2, 0.5), "Radial NTL", text_at=(-4.2, 1.75))
    arrow(axes, (-5.35, -0.5), (-4.55, -0.5), "Axial NTL", text_at=(-5.0, -0.8))
    turning_arrow(axes, (-5.55, 0.0), 0.42, (-120.0, 120.0))
    named: dict[str, tuple[Point, Point]] = {
        "Dynamometer support\nand input torque": ((-6.5, 0.4), (-6.7, 1.35)),
        "Dynamometer\nshaft": ((-5.0, 0.05), (-5.25, 1.35)),
        "Dynamometer\ncoupling": ((-4.1, -0.35), (-4.1, -0.95)),
        "Main bearing": ((-2.65, 0.3), (-2.65, 1.1)),
        "Main shaft": ((-1.2, 0.05), (-1.2, 0.7)),
        "Torque arm\nsupport": ((0.45, -0.6), (-0.75, -0.75)),
        "Gearbox": ((1.2, 0.9), (1.0, 1.65)),
        "Generator": ((3.1, 0.9), (3.1, 1.65)),
        "Bedplate": ((-1.7, -1.3), (-1.7, -1.78)),
    }
    for text, (at, text_at) in named.items():
        leader(axes, text, at, text_at)
    cross(axes, (0.45, 0.0), 1.3, "x", "z")
    return figure


def mounted_bushings() -> Figure:
    """Bushings between torque arms and bedplate, from behind and in section (2011, figure 3)."""
    figure = Figure(figsize=(11.0, 4.8), layout="constrained")
    back, section = figure.subplots(1, 2, width_ratios=(1.7, 1.0))
    prepare(back, (-1.25, 1.25), (-0.95, 0.95), "from behind (looking upwind)")
    _draw_housing_from_behind(back)
    for side in (-1.0, 1.0):
        box(back, (side * 0.75 - 0.17, side * 0.75 + 0.17), (-0.85, -0.14), HOUSING, layer=1.0)
    ground(back, (-1.15, 1.15), -0.85, depth=0.07)
    leader(back, "Bushings", (-0.75, 0.1), (0.0, 0.85), colour=RUBBER)
    leader(back, "Bushings", (0.75, 0.1), (0.0, 0.85), colour=RUBBER)
    leader(back, "Torque arm", (0.55, 0.0), (0.95, 0.55))
    leader(back, "Bedplate", (-0.75, -0.6), (-0.35, -0.75))
    prepare(section, (-0.36, 0.36), (-0.36, 0.36), "one bushing, section (drawn freely)")
    box(section, (-0.24, 0.24), (0.17, 0.25), HOUSING)
    box(section, (-0.24, 0.24), (-0.25, -0.17), HOUSING)
    for z in ((0.08, 0.17), (-0.17, -0.08)):
        box(section, (-0.18, 0.18), z, RUBBER)
    box(section, (-0.30, 0.30), (-0.08, 0.08), STEEL)
    leader(section, "Rubber", (0.1, 0.12), (0.25, 0.31), colour=RUBBER)
    leader(section, "Trunnion pin of the torque arm", (-0.05, 0.0), (0.0, -0.31))
    leader(section, "Eye on the bedplate", (-0.12, 0.21), (-0.14, 0.31))
    return figure


def motion_sensors() -> Figure:
    """Six motion sensors on the housing, from behind and from the side (2011, figure 5)."""
    rig = MountingRig()
    figure = Figure(figsize=(12.0, 5.8), layout="constrained")
    back, side = figure.subplots(1, 2, width_ratios=(1.35, 1.0))
    prepare(back, (-1.3, 1.35), (-1.12, 1.1), "(a) Back")
    _draw_housing_from_behind(back)
    R_x = rig.R_x
    R_y = rig.R_y
    R_z = rig.R_z
    for name, position, text_at in (
        ("ssx", (R_z, R_y), (1.02, 0.42)), ("spx", (-R_z, R_y), (-1.02, 0.42)),
        ("sbx", (0.0, -rig.R_b), (0.32, -0.74)),
    ):  # fmt: skip
        _sensor_along_view(back, position)
        leader(back, name, position, text_at, colour=SENSOR, size=11.0)
    for name, position in (("ssz", (R_x, 0.0)), ("spz", (-R_x, 0.0))):
        arrow(back, (position[0], -0.50), (position[0], -0.13), colour=SENSOR)
        words(back, name, (position[0] + 0.12, -0.42), colour=SENSOR, size=11.0)
    arrow(back, (-1.25, 0.0), (-0.92, 0.0), colour=SENSOR)
    words(back, "spy", (-1.15, -0.1), colour=SENSOR, size=11.0)
    dimension(back, (0.0, -0.95), (R_x, -0.95), f"$R_x = R_z$ = {R_x * 1e3:.0f} mm")
    line(back, [(R_x, -0.15), (R_x, -1.0)])
    line(back, [(0.0, 0.0), (0.0, -1.0)], style="-.")
    line(back, [(R_z, R_y), (1.28, R_y)])
    line(back, [(R_z, 0.0), (1.28, 0.0)])
    dimension(back, (1.2, 0.0), (1.2, R_y), "", text_at=(1.2, -5.0))
    words(back, f"$R_y$ = {R_y * 1e3:.1f} mm", (1.12, 0.24), size=8.5)
    cross(back, (0.0, 0.0), 0.28, "y", "z")
    prepare(side, (-0.95, 1.35), (-1.12, 1.1), "(b) Side (port)")
    _draw_housing_from_the_side(side)
    _draw_side_sensors(side, rig)
    return figure


def _draw_side_sensors(side: Axes, rig: MountingRig) -> None:
    R_y = rig.R_y
    R_b = rig.R_b
    R_yz = rig.R_yz
    for name, z, text_at in (("spx", R_y, (-0.78, R_y)), ("sbx", -R_b, (-0.62, -R_b))):
        arrow(side, (text_at[0] + 0.13, z), (-0.12, z), colour=SENSOR)
        words(side, name, text_at, colour=SENSOR, size=11.0)
    arrow(side, (0.0, -0.45), (0.0, -0.12), colour=SENSOR)
    words(side, "spz", (0.12, -0.40), colour=SENSOR, size=11.0)
    _sensor_along_view(side, (-R_yz, 0.0))
    leader(side, "spy", (-R_yz, 0.0), (-0.5, -0.22), colour=SENSOR, size=11.0)
    dimension(side, (-0.36, 0.0), (-0.36, R_y), "", text_at=(0.0, -5.0))
    words(side, "$R_y$", (-0.47, 0.06))
    dimension(side, (0.95, 0.0), (0.95, -R_b), f"$R_b$ = {R_b * 1e3:.0f} mm\n(assumed)")
    line(side, [(-0.12, -R_b), (1.0, -R_b)])
    line(side, [(-0.95, 0.0), (1.3, 0.0)], style="-.")
    dimension(side, (-R_yz, 0.86), (0.0, 0.86), "", text_at=(0.0, -5.0))
    line(side, [(-R_yz, 0.0), (-R_yz, 0.9)])
    line(side, [(0.0, 0.0), (0.0, 0.9)])
    words(side, f"$R_{{yz}}$ = {R_yz * 1e3:.0f} mm (assumed)", (0.0, 0.98))
    cross(side, (0.0, 0.0), 0.28, "x", "z")


def _sensor_along_view(axes: Axes, point: Point) -> None:
    """A sensor that measures along the line of sight."""
    disc(axes, point, 0.035, "white", layer=8.0)
    axes.plot(*point, "o", color=SENSOR, markersize=4, zorder=9)


def _draw_housing_from_behind(axes: Axes) -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 120)
    outline(
        axes, [(0.64 * float(np.cos(v)), 0.64 * float(np.sin(v))) for v in angle], HOUSING,
        layer=2.0,
    )  # fmt: skip
    outline(
        axes, [(-0.45, -0.42), (0.45, -0.42), (0.45, 0.2), (0.3, 0.72), (-0.3, 0.72), (-0.45, 0.2)],
        "#eef1f3", layer=2.5,
    )  # fmt: skip
    for x in (-0.75, 0.75):
        box(axes, tuple(sorted((np.sign(x) * 0.45, x))), (-0.12, 0.12), HOUSING, layer=2.2)
        disc(axes, (x, 0.0), 0.13, RUBBER, layer=3.0)
        disc(axes, (x, 0.0), 0.06, STEEL, layer=4.0)
    disc(axes, (0.0, 0.0), 0.10, STEEL, layer=3.0)
    disc(axes, (0.12, 0.52), 0.05, STEEL, layer=3.0)


def _draw_housing_from_the_side(axes: Axes) -> None:
    outline(
        axes, [(-0.12, -0.66), (-0.12, 0.66), (0.35, 0.66), (0.35, 0.78), (1.1, 0.78),
               (1.1, -0.5), (0.35, -0.5), (0.35, -0.66)], HOUSING,
    )  # fmt: skip
    box(axes, (-0.95, -0.12), (-0.17, 0.17), STEEL)
    box(axes, (1.1, 1.3), (0.48, 0.56), STEEL)
    disc(axes, (0.0, 0.0), 0.11, RUBBER, layer=3.0)
    disc(axes, (0.0, 0.0), 0.05, STEEL, layer=4.0)
    line(axes, [(-0.12, -0.66), (-0.12, 0.66)], colour=FRAME)
