"""Every dimension of the planetary stage in a file to edit, and a drawing that shows them.

A good answer: each key has its words, unit, source and the range in which it alone may be changed.
"""

from collections.abc import Iterator
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING

from carrierflex.files.whole_files import check_file_writable, refuse_existing, whole_file
from carrierflex.geometry.parameter_files import StageParameters, read_parameters
from carrierflex.geometry.parameter_sources import limits, sources
from carrierflex.geometry.parameters import CarrierParameters
from carrierflex.geometry.pins import pin_angles
from carrierflex.workflows.outputs import save_figure, schema_line

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_TABLES = ("carrier", "pin", "gear", "main_shaft")


@dataclass(frozen=True)
class WrittenParameters:
    """The file of dimensions, its drawing, and how many keys it has."""

    path: Path
    drawing: Path
    n_keys: int


def main(*, out: Path, parameters: Path | None = None) -> WrittenParameters:
    """Write every dimension with unit, source and limits, and a dimensioned drawing.

    Parameters
    ----------
    out
        File to write (.toml), which --parameters of other commands takes; the drawing is a PNG of
        the same name. An existing file is not replaced.
    parameters
        TOML file whose dimensions are written in place of the defaults [m, rad].

    Returns
    -------
    WrittenParameters
        Both files.

    Raises
    ------
    ValueError
        Where dimensions contradict each other, all of them at once, or the file exists already.
    """
    stage = read_parameters(parameters)
    drawing = out.with_suffix(".png")
    refuse_existing(out, drawing)
    check_file_writable(out)
    lines = list(parameter_lines(stage))
    with whole_file(out) as path:
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    save_figure(drawing, _dimensioned_drawing(stage.carrier))
    return WrittenParameters(out, drawing, sum(" = " in line for line in lines))


def parameter_lines(stage: StageParameters) -> Iterator[str]:
    """Lines of a file with all dimensions of a stage, each with its words, source and limits."""
    from pydantic import TypeAdapter

    from carrierflex.files.toml_values import FileSchema
    from carrierflex.geometry.parameter_tables import ParameterTables

    tables = TypeAdapter(ParameterTables).json_schema(schema_generator=FileSchema)["$defs"]
    yield schema_line("carrier parameters")
    yield "# Dimensions of the planetary stage, in metres and radians. What is missing keeps its"
    yield "# default. 'alone': range in which a dimension may be changed while all others stay."
    for table in _TABLES:
        values = getattr(stage, table)
        known = tables[type(values).__name__]["properties"]
        source, ends = sources(type(values)), limits(stage, table)
        yield ""
        yield f"[{table}]  # {ParameterTables.model_fields[table].description}"
        for field in fields(values):
            name = field.name
            yield f"# {known[name]['description']} {source.get(name, '')}".rstrip()
            alone = f"  # {_range_words(*ends[name])}" if name in ends else ""
            yield f"{name} = {getattr(values, name)!r}{alone}"


def _range_words(low: float, high: float) -> str:
    if high - low < 1e-6 * high:
        return "tied to another dimension: change both"
    if high == float("inf"):
        return f"alone: above {low:.4g}"
    return f"alone: {low:.4g} to {high:.4g}"


def _dimensioned_drawing(carrier: CarrierParameters) -> "Figure":
    """Longitudinal section above the axis, and the face, with the names of all dimensions."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13.0, 7.0), layout="constrained")
    section, face = figure.subplots(1, 2, width_ratios=(1.15, 1.0))
    _section(section, carrier)
    _face(face, carrier)
    for axes in (section, face):
        axes.set_aspect("equal")
        axes.grid(alpha=0.15)
    figure.suptitle("Planet carrier: dimensions by their keys [mm]", fontsize=11)
    return figure


def _section(axes: "Axes", c: CarrierParameters) -> None:
    """Half section through a pin: x downwind, radius upwards."""
    from matplotlib.patches import Rectangle

    mm = 1e3
    a = c.upwind_plate_thickness
    gap = c.plate_gap
    b = c.downwind_plate_thickness
    hub, seat = c.hub_inner_diameter / 2.0, c.seat_inner_diameter / 2.0
    bodies = (
        (0.0, hub, a, c.outer_radius - hub),
        (a + gap, seat, b, c.outer_radius - seat),
        (-c.hub_length, hub, c.hub_length, c.hub_outer_diameter / 2.0 - hub),
        (a + gap + b, seat, c.seat_length, c.seat_outer_diameter / 2.0 - seat),
    )
    for x, r, width, height in bodies:
        axes.add_patch(
            Rectangle(
                (mm * x, mm * r), mm * width, mm * height, facecolor="#d5dae0", edgecolor="#1b1f24"
            )
        )
    for x, width in ((0.0, a), (a + gap, b)):
        axes.add_patch(
            Rectangle(
                (mm * x, mm * (c.centre_distance - c.pin_hole_radius)),
                mm * width,
                mm * 2.0 * c.pin_hole_radius,
                facecolor="white",
                edgecolor="#1b1f24",
            )
        )
    axes.axhline(0.0, color="#6b6b6b", linestyle="-.", linewidth=0.8)
    _lengths(axes, c)
    _radii(axes, c)
    axes.set_xlim(-mm * (c.hub_length + 0.06), mm * (a + gap + b + c.seat_length + 0.06))
    axes.set_ylim(-20.0, mm * (c.outer_radius + 0.13))
    axes.set_xlabel("x, downwind [mm]")
    axes.set_ylabel("radius [mm]")
    axes.set_title("section through a pin", fontsize=9)


def _lengths(axes: "Axes", c: CarrierParameters) -> None:
    """Dimensions along the axis."""
    mm = 1e3
    a, gap = c.upwind_plate_thickness, c.plate_gap
    total = c.length_between_faces
    top = c.outer_radius
    rows = (
        (0.0, a, top + 0.03, "upwind_plate_thickness"),
        (a, a + gap, top + 0.085, "plate_gap"),
        (a + gap, total, top + 0.03, "downwind_plate_thickness"),
        (-c.hub_length, 0.0, c.hub_outer_diameter / 2.0 + 0.03, "hub_length"),
        (total, total + c.seat_length, c.seat_outer_diameter / 2.0 + 0.03, "seat_length"),
        (*c.upwind_bearing_x, c.hub_outer_diameter / 2.0 + 0.075, "upwind_bearing_width"),
    )
    for low, high, r, name in rows:
        arrow = {"arrowstyle": "<->", "linewidth": 0.8}
        axes.annotate("", (mm * low, mm * r), (mm * high, mm * r), arrowprops=arrow)
        text = f"{name}\n{mm * (high - low):.4g}"
        axes.text(mm * 0.5 * (low + high), mm * r + 4, text, ha="center", va="bottom", fontsize=7)


def _radii(axes: "Axes", c: CarrierParameters) -> None:
    """Dimensions from the axis."""
    mm = 1e3
    hub, seat = c.hub_inner_diameter / 2.0, c.seat_inner_diameter / 2.0
    total = c.length_between_faces
    middle = c.upwind_plate_thickness + 0.5 * c.plate_gap
    radii = (
        (middle - 0.07, c.centre_distance, "centre_distance", 1.0),
        (-0.6 * c.hub_length, c.hub_outer_diameter / 2.0, "hub_outer_diameter", 2.0),
        (-0.2 * c.hub_length, hub, "hub_inner_diameter", 2.0),
        (total + 0.75 * c.seat_length, c.seat_outer_diameter / 2.0, "seat_outer_diameter", 2.0),
        (total + 0.2 * c.seat_length, seat, "seat_inner_diameter", 2.0),
        (middle + 0.07, c.web_inner_radius, "web_inner_radius", 1.0),
    )
    for x, r, name, times in radii:
        arrow = {"arrowstyle": "->", "linewidth": 0.8}
        axes.annotate("", (mm * x, mm * r), (mm * x, 0.0), arrowprops=arrow)
        sign = "Ø " if times == 2.0 else ""
        axes.text(
            mm * x - 3,
            8.0,
            f"{name}  {sign}{mm * times * r:.4g}",
            rotation=90,
            ha="right",
            va="bottom",
            fontsize=7,
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5, "alpha": 0.8},
        )


def _face(axes: "Axes", c: CarrierParameters) -> None:
    """Upwind face with pins, clearance of the planets and the sensors' circle."""
    import numpy as np
    from matplotlib.patches import Circle

    mm = 1e3
    circles = (
        (c.outer_radius, "-", "outer_radius", 20.0),
        (c.sensor_radius, "--", "sensor_radius", 142.0),
    )
    for radius, dashes, name, angle in circles:
        axes.add_patch(Circle((0.0, 0.0), mm * radius, fill=False, linestyle=dashes))
        at = mm * radius * np.array([np.cos(np.deg2rad(angle)), np.sin(np.deg2rad(angle))])
        axes.annotate(
            f"{name} {mm * radius:.4g}",
            (float(at[0]), float(at[1])),
            (1.16 * float(at[0]), 1.5 * float(at[1])),
            fontsize=7,
            ha="center",
            arrowprops={"arrowstyle": "->", "linewidth": 0.7},
        )
    axes.add_patch(Circle((0.0, 0.0), mm * c.web_inner_radius, fill=False, linestyle=":"))
    for k, turn in enumerate(pin_angles(c.n_planets)):
        y, z = mm * c.centre_distance * np.sin(turn), mm * c.centre_distance * np.cos(turn)
        bore = Circle((y, z), mm * c.pin_hole_radius, facecolor="#eef1f4", edgecolor="#1b1f24")
        axes.add_patch(bore)
        planet = mm * c.planet_clearance_radius
        axes.add_patch(Circle((y, z), planet, fill=False, linestyle=":", color="#0072b2"))
        axes.text(y, z, f"pin {k + 1}", ha="center", va="center", fontsize=7)
    # Of the pin nearest to the drawing's lower right: pin 2 of three.
    below = float(pin_angles(c.n_planets)[round(c.n_planets / 3)])
    pin = (mm * c.centre_distance * np.sin(below), mm * c.centre_distance * np.cos(below))
    axes.annotate(
        f"pin_hole_diameter Ø {mm * c.pin_hole_diameter:.4g}",
        (pin[0] + mm * c.pin_hole_radius, pin[1]),
        (pin[0] + 60.0, pin[1] - 320.0),
        fontsize=7,
        ha="center",
        arrowprops={"arrowstyle": "->", "linewidth": 0.7},
    )
    axes.annotate(
        f"planet_clearance_radius {mm * c.planet_clearance_radius:.4g}",
        (
            -pin[0] - 0.5 * mm * c.planet_clearance_radius,
            pin[1] - 0.866 * mm * c.planet_clearance_radius,
        ),
        (-pin[0] - 60.0, pin[1] - 330.0),
        fontsize=7,
        ha="center",
        arrowprops={"arrowstyle": "->", "linewidth": 0.7},
    )
    reach = 1.32 * mm * c.outer_radius
    axes.set_xlim(-reach, reach)
    axes.set_ylim(-reach, reach)
    axes.set_xlabel("seen downwind [mm]")
    axes.text(0.0, 0.0, f"n_planets {c.n_planets}", ha="center", va="center", fontsize=7)
    axes.set_title("upwind face", fontsize=9)
