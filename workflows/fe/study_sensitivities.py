"""Which dimension, material or stiffness moves which order of the deflection curves."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypedDict

import numpy as np

from carrierflex.files.json_files import save_json
from carrierflex.files.versions import Versions, versions
from carrierflex.geometry.parameter_files import Dimensions, StageParameters, read_parameters
from carrierflex.geometry.pins import PAPER_STIFFNESS
from carrierflex.geometry.tet_mesh import TetMesh
from carrierflex.simulation.stage.stage_data import BearingData
from carrierflex.workflows.outputs import prepared_folder, save_figure, save_table
from carrierflex.workflows.progress import Stages

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from carrierflex.reduction.carrier_sensitivities import BodySensitivities, CarrierProblem
    from carrierflex.workflows.geometry.carrier_files import CarrierFiles

_HEADER = (
    "cause", "value", "unit", "body", "quantity", "nominal", "derivative", "change",
    "change_percent",
)  # fmt: skip
#: Frequencies of each body in table and picture.
_FREQUENCIES = 4
#: Change in per cent at which the picture's colour is full.
_FULL_COLOUR = 3.0


@dataclass(frozen=True)
class SensitivityRow:
    """One quantity's derivative by one cause."""

    cause: Annotated[str, "What may differ"]
    value: Annotated[float, "Its nominal value [unit]; 0 of an offset"]
    unit: Annotated[str, "Its unit"]
    body: Annotated[str, "Body that the quantity is of"]
    quantity: Annotated[str, "Order of a curve, or frequency"]
    nominal: Annotated[float, "Amplitude [m per 1 kN m or 1 N], or frequency [Hz]"]
    derivative: Annotated[float, "Of it, per unit of the cause"]
    change: Annotated[float, "Change of the cause that change_percent is for [unit]"]
    change_percent: Annotated[
        float, "Change of an amplitude in % of its curve's RMS, of a frequency in % of it"
    ]


@dataclass(frozen=True, eq=False)
class SensitivityStudy:
    """Sensitivities of the carrier without pins, with bonded pins and with sprung pins."""

    bodies: tuple[BodySensitivities, ...]
    n_planets: int

    @property
    def rows(self) -> tuple[SensitivityRow, ...]:
        """Every quantity by every cause of its body."""
        return tuple(row for body in self.bodies for row in _rows(body, self.n_planets))


def main(
    *,
    out: Path,
    size: float | None = None,
    modes: int = 20,
    pin_fit: float = PAPER_STIFFNESS,
    upwind_seat: float = BearingData.upwind_radial,
    downwind_seat: float = BearingData.downwind_radial,
    parameters: Path | None = None,
    step: Path | None = None,
    surfaces: Path | None = None,
    flexible_mesh: Path | None = None,
    stiff_mesh: Path | None = None,
    length_unit: Literal["m", "mm", "inch"] = "m",
    quiet: bool = False,
) -> SensitivityStudy:
    """Derive curves, matrices and frequencies by dimensions, materials and stiffnesses.

    Writes sensitivities.csv and sensitivities.json (orders and frequencies), sensitivities.png and
    sensitivities.h5 (whole curves, matrices dK and dM).

    Parameters
    ----------
    out
        Folder to write: sensitivities.csv, .json, .h5 and .png.
    size
        Element edge length [m]; 0.03 where it is not given, of a STEP file as in curves.
    modes
        Fixed-interface modes of the reduced bodies.
    pin_fit
        Bending and torsional stiffness of each pin interface [N m/rad] in the carrier with sprung
        pins.
    upwind_seat
        Radial stiffness of the carrier bearing on the upwind seat [N/m], same body.
    downwind_seat
        Radial stiffness of the carrier bearing on the downwind seat [N/m], same body.
    parameters
        TOML file with the tables [carrier], [pin], [gear], dimensions in metres; a missing key has
        its default. four_planets: a bundled set.
    step
        STEP file with the carrier without pins, instead of the parametric carrier; its named
        surfaces are moved along their normals in place of dimensions.
    surfaces
        TOML file that states the surfaces of the STEP or mesh files.
    flexible_mesh
        Mesh file (.msh, .inp, .bdf, .unv, .med; tetrahedra) of the carrier without pins, instead of
        the parametric carrier.
    stiff_mesh
        Mesh file of the same kinds of the carrier with bonded pins.
    length_unit
        Unit of the mesh files' coordinates.
    quiet
        Show no progress.

    Returns
    -------
    SensitivityStudy
        A cause that moves an order by less than the measurement resolves cannot be identified from
        it; two causes with proportional rows cannot be told apart.
    """
    stage = read_parameters(parameters)
    springs = {"pin-fit": pin_fit, "upwind-seat": upwind_seat, "downwind-seat": downwind_seat}
    for flag, stiffness in springs.items():
        if not (np.isfinite(stiffness) and stiffness > 0.0):
            raise ValueError(f"--{flag} is {stiffness}; expected a positive, finite stiffness")

    from carrierflex.reduction.carrier_sensitivities import sensitivities
    from carrierflex.reduction.sensitivity_files import write_sensitivities
    from carrierflex.workflows.geometry.carrier_files import CarrierFiles, meshes_of_variants

    meshes = meshes_of_variants(flexible_mesh, stiff_mesh)
    files = CarrierFiles(step, surfaces, meshes, length_unit)
    record, edge = files.record(), files.element_size(size)
    prepared_folder(out)
    stages = Stages(3 if files.given else 4, quiet)
    bodies = []
    for variant in ("flexible", "stiff"):
        with stages.stage(f"{variant} carrier, elements of {edge:.4g} m"):
            problem = _problem(variant, stage, files, edge)
            names = [change.cause.name for change in problem.changes]
            bodies.append(
                sensitivities(
                    problem,
                    modes,
                    n_frequencies=_FREQUENCIES,
                    note=lambda name, names=names: stages.note(  # type: ignore[misc]
                        name, names.index(name) / len(names)
                    ),
                )
            )
    if not files.given:
        with stages.stage("pin fit and seats"):
            seats = {"upwind": upwind_seat, "downwind": downwind_seat}
            bodies.append(_springs(bodies[0], stage, edge, pin_fit, seats))
    n_planets = problem.n_planets
    study = SensitivityStudy(tuple(bodies), n_planets)
    with stages.stage(f"writing {out}"):
        save_table(
            out / "sensitivities.csv",
            _HEADER,
            ([getattr(row, name) for name in _HEADER] for row in study.rows),
        )
        inputs = {
            "size": edge, "modes": modes, "pin_fit": pin_fit, "upwind_seat": upwind_seat,
            "downwind_seat": downwind_seat, "stage": stage, "files": record,
        }  # fmt: skip
        save_json(
            out / "sensitivities.json",
            {"inputs": inputs, "sensitivities": study.rows, "versions": versions()},
        )
        save_figure(out / "sensitivities.png", sensitivity_figure(study))
        write_sensitivities(out / "sensitivities.h5", bodies)
    return study


def _problem(
    variant: str, stage: StageParameters, files: CarrierFiles, size: float
) -> CarrierProblem:
    from carrierflex.geometry.carrier_mesh import flexible_half_sector, stiff_half_sector
    from carrierflex.reduction.carrier_sensitivities import given_problem, parametric_problem

    if not files.given:
        half = (
            flexible_half_sector(stage.carrier, size)
            if variant == "flexible"
            else stiff_half_sector(stage.carrier, stage.pin, size)
        )
        return parametric_problem(half, stage)
    mesh = files.mesh(variant, size)
    if not isinstance(mesh, TetMesh):
        raise ValueError(
            f"the {variant} carrier's mesh has hexahedra or wedges; expected tetrahedra alone: "
            "sensitivities are derived for these"
        )
    return given_problem(mesh, stage.gear, files.materials())


def _springs(
    flexible: BodySensitivities,
    stage: StageParameters,
    size: float,
    pin_fit: float,
    seats: Mapping[str, float],
) -> BodySensitivities:
    from carrierflex.reduction.carrier_sensitivities import spring_sensitivities
    from carrierflex.reduction.craig_bampton import craig_bampton
    from carrierflex.workflows.fe.bodies import body_structure

    pin = craig_bampton(body_structure("pin", stage, size)[1], 0).model
    radius = stage.carrier.sensor_radius
    return spring_sensitivities(
        flexible.model,
        pin,
        stage.gear,
        radius=radius,
        pin_fit=pin_fit,
        seats=seats,
        n_frequencies=_FREQUENCIES,
    )


def _quantities(
    body: BodySensitivities, n_planets: int
) -> Iterator[tuple[str, float, np.ndarray, float]]:
    """Name, nominal value, derivatives and the value that changes are shown in per cent of."""
    for name, curve in body.curves.items():
        nominal = curve.nominal
        for order in nominal.main_orders(n_planets):
            amplitude = abs(nominal.axial_order(order))
            derivative = curve.amplitude_derivative(order)
            yield f"{name} order {order}", amplitude, derivative, nominal.rms
    frequencies = body.frequencies
    for i, frequency in enumerate(frequencies.frequency[:_FREQUENCIES]):
        yield f"frequency {i + 1}", float(frequency), frequencies.derivative[:, i], float(frequency)


def _rows(body: BodySensitivities, n_planets: int) -> Iterator[SensitivityRow]:
    quantities = list(_quantities(body, n_planets))
    for number, cause in enumerate(body.causes):
        for name, nominal, derivatives, scale in quantities:
            derivative = float(derivatives[number])
            percent = 100.0 * derivative * cause.change / scale
            yield SensitivityRow(
                cause.name, cause.value, cause.unit, body.name, name, nominal, derivative,
                cause.change, percent,
            )  # fmt: skip


def sensitivity_figure(study: SensitivityStudy) -> Figure:
    """Draw which cause moves which order and frequency, one panel a body."""
    from matplotlib.figure import Figure

    counts = [len(body.causes) for body in study.bodies]
    figure = Figure(
        figsize=(8.5, 1.2 + 0.27 * (sum(counts) + 4 * len(counts))), layout="constrained"
    )
    panels = figure.subplots(len(counts), 1, height_ratios=[n + 1 for n in counts], squeeze=False)
    for axis, body in zip(panels[:, 0], study.bodies, strict=True):
        rows = list(_rows(body, study.n_planets))
        columns = [name for name, *_ in _quantities(body, study.n_planets)]
        percent = np.array([row.change_percent for row in rows]).reshape(-1, len(columns))
        limit = _FULL_COLOUR
        axis.imshow(percent, cmap="RdBu_r", vmin=-limit, vmax=limit, aspect="auto")
        for i, j in np.ndindex(percent.shape):
            colour = "white" if abs(percent[i, j]) > 0.7 * limit else "black"
            text = f"{percent[i, j]:+.2f}" if abs(percent[i, j]) >= 0.005 else "·"
            axis.text(j, i, text, ha="center", va="center", fontsize=7, color=colour)
        axis.set_yticks(range(len(body.causes)), [_label(cause) for cause in body.causes])
        labels = [name.replace("_joined", "\njoined").replace(" ", "\n", 1) for name in columns]
        axis.set_xticks(range(len(columns)), labels, fontsize=6)
        axis.tick_params(labelsize=7, length=0)
        axis.set_title(body.name.replace("_", " "), loc="left", fontsize=9)
    figure.suptitle(
        "change in % (orders: of the curve's RMS) for 1 % more of a value, 1 mm of an offset",
        fontsize=9,
    )
    return figure


def _label(cause: Any) -> str:
    """Name and value; an offset has none."""
    unit = "" if cause.unit == "1" else f" {cause.unit}"
    return f"{cause.name} = {cause.value:.4g}{unit}" if cause.value else cause.name


class SensitivityInputs(TypedDict):
    """Inputs of the sensitivities."""

    size: Annotated[float, "Element edge length [m]"]
    modes: Annotated[int, "Fixed-interface modes of the reduced bodies"]
    pin_fit: Annotated[float, "Stiffness of each pin interface [N m/rad]"]
    upwind_seat: Annotated[float, "Radial stiffness of the bearing on the upwind seat [N/m]"]
    downwind_seat: Annotated[float, "Radial stiffness of the bearing on the downwind seat [N/m]"]
    stage: Dimensions
    files: Annotated[Mapping[str, Any], "Files by role; empty without any"]


class SensitivitiesDocument(TypedDict):
    """sensitivities.json, written by sensitivities."""

    inputs: Annotated[SensitivityInputs, "Inputs"]
    sensitivities: Annotated[Sequence[SensitivityRow], "Derivatives, one row a quantity and cause"]
    versions: Versions
