"""Whether a mix of stiff and flexible stands for every pin fit.

The torque curve over the interface stiffness from 0 to infinity.

The 2012 paper believes that a mix of the two extreme curves represents the actual deflection. A
good answer tells where three peaks become six, which shares represent each curve, and what the best
mix leaves of it.
"""

from __future__ import annotations

import contextlib
import csv
import dataclasses
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypedDict

import numpy as np

from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.files.json_files import save_json
from carrierflex.files.versions import Versions, versions
from carrierflex.files.whole_files import whole_file
from carrierflex.geometry.parameter_files import Dimensions, StageParameters, read_parameters
from carrierflex.workflows.fe.compute_curves import GivenFile
from carrierflex.workflows.outputs import prepared_folder, save_figure
from carrierflex.workflows.progress import Stages

if TYPE_CHECKING:
    from carrierflex.reduction.pin_fit import ExtremeCurves, PinFitFamily, PinFitRow
    from carrierflex.workflows.fe.pin_fit_pictures import PinFitStudy
    from carrierflex.workflows.geometry.carrier_files import CarrierFiles

#: Interface stiffnesses between which the sweep runs, beside its two ends [N m/rad].
LOWEST, HIGHEST = 1e4, 1e12
#: Derived from the paper's Table 4: RMS of the rim deflection [m per kN m].
TABLE_4_RMS = 0.083e-6


def main(
    *,
    out: Path,
    size: float | None = None,
    points_per_decade: int = 8,
    parameters: Path | None = None,
    step: Path | None = None,
    surfaces: Path | None = None,
    quiet: bool = False,
) -> PinFitStudy:
    """Sweep the pin fit from simply supported to rigid.

    Writes pin_fit.csv, pin_fit.json and two pictures.

    Parameters
    ----------
    out
        Folder to write: pin_fit.csv, pin_fit.json and two pictures.
    size
        Element edge length [m]; default: 0.03; of a STEP file as of carrierflex curves.
    points_per_decade
        Stiffnesses a decade from 1e4 to 1e12 N m/rad; 0, infinity and the named fits are added.
    parameters
        TOML file with the tables [carrier], [pin], [gear], dimensions in metres; a missing key has
        its default. four_planets: a bundled set.
    step
        STEP file with the carrier without pins, instead of the parametric carrier; any length unit.
    surfaces
        TOML file that states the STEP file's surfaces; carrierflex cad writes one to start from.
    quiet
        Show no progress.

    Returns
    -------
    PinFitStudy
        A mix stands for a curve where its residual is small against what else the signals hold.
    """
    if not 1 <= points_per_decade <= 1000:
        raise ValueError(f"--points-per-decade is {points_per_decade}; expected 1 to 1000")
    stage = read_parameters(parameters)

    from carrierflex.workflows.geometry.carrier_files import CarrierFiles

    files = CarrierFiles(step, surfaces)
    record, edge = files.record(), files.element_size(size)
    prepared_folder(out)

    from carrierflex.reduction.pin_fit import pin_fit_row
    from carrierflex.workflows.fe.pin_fit_pictures import PinFitStudy, mix_figure, sweep_figure

    stages = Stages(3, quiet)
    with stages.stage("both carriers and a pin: finite elements, static reduction"):
        tied, extremes = static_family(stage, edge, files)
    with stages.stage("sweep of the interface stiffness"):
        families = (tied, dataclasses.replace(tied, sliding=True))
        stiffnesses = _stiffnesses(points_per_decade)
        rows = tuple(pin_fit_row(family, k, extremes) for family in families for k in stiffnesses)
        study = PinFitStudy(tied, extremes, rows, _changes(tied))
    with stages.stage(f"writing {out}"):
        _write_table(out / "pin_fit.csv", rows)
        inputs = {"size": edge, "stage": stage, "files": record}
        findings = {"stiffness_of_changes": study.changes, "worst": study.worst}
        save_json(out / "pin_fit.json", {"inputs": inputs, **findings, "versions": versions()})
        save_figure(out / "pin_fit.png", sweep_figure(study))
        save_figure(out / "pin_fit_mixes.png", mix_figure(study))
    return study


def static_family(
    stage: StageParameters, size: float, files: CarrierFiles | None = None
) -> tuple[PinFitFamily, ExtremeCurves]:
    """Carrier and pin reduced to their pilots, and the extremes that need no joint.

    Statics needs no modes.

    Parameters
    ----------
    stage : StageParameters
        Dimensions.
    size : float
        Element edge length [m].
    files : CarrierFiles
        STEP file or meshes of the carrier, where it is not that of the dimensions.
    """
    from carrierflex.fe.carrier_curves import UNIT_TORQUE
    from carrierflex.fe.load_cases import gear_forces
    from carrierflex.reduction.craig_bampton import craig_bampton
    from carrierflex.reduction.pin_fit import ExtremeCurves, PinFitFamily, torque_curve
    from carrierflex.workflows.fe.bodies import built_carrier, built_pin
    from carrierflex.workflows.geometry.carrier_files import CarrierFiles

    files = files or CarrierFiles()
    models = {}
    clamped_pilots = {}
    clamped = {}
    for name in ("flexible", "stiff"):
        built = built_carrier(name, stage, size, files)
        radius = built.interface.sensor_radius
        models[name] = craig_bampton(built.structure, 0).model
        clamped_pilots[name] = torque_curve(name, models[name], built.cases["both"], radius)
        clamped[name] = built.solved().curves["both"]
    pin = craig_bampton(built_pin(stage, size, files, built.mesh), 0).model
    forces = gear_forces(UNIT_TORQUE, built.gear, built.n_planets)
    extremes = ExtremeCurves(
        clamped_pilots["stiff"], clamped_pilots["flexible"], clamped["stiff"], clamped["flexible"]
    )
    return PinFitFamily(models["flexible"], pin, forces, radius), extremes


def _stiffnesses(points_per_decade: int) -> list[float]:
    from carrierflex.reduction.pin_joints import PIN_FITS

    n = round(np.log10(HIGHEST / LOWEST)) * points_per_decade + 1
    sweep = np.logspace(np.log10(LOWEST), np.log10(HIGHEST), n)
    return sorted({*map(float, sweep), *PIN_FITS.values()})


def _changes(family: PinFitFamily) -> dict[str, float]:
    """Interface stiffness at which the curve's character changes [N m/rad]."""
    from carrierflex.workflows.fe.pin_fit_pictures import MORE_PEAKS, TABLE_4

    conditions: dict[str, Callable[[DeflectionCurve], bool]] = {
        MORE_PEAKS: lambda curve: len(curve.peak_angles()) > family.n_planets,
        TABLE_4: lambda curve: curve.rms <= TABLE_4_RMS,
    }
    changes = {}
    for name, reached in conditions.items():
        # Another carrier may be softer or stiffer than the paper's throughout.
        with contextlib.suppress(ValueError):
            changes[name] = family.stiffness_where(reached, LOWEST, HIGHEST)
    return changes


def _write_table(path: Path, rows: Sequence[PinFitRow]) -> None:
    """Write one line a row; stiffness in N m/rad, orders and RMS in m per kN m."""
    from carrierflex.reduction.pin_fit import PinFitRow

    names = [field.name for field in dataclasses.fields(PinFitRow)]
    split = names.index("orders")
    orders = [f"order_{order}" for order in rows[0].orders]
    with whole_file(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([*names[:split], *orders, *names[split + 1 :]])
        for row in rows:
            values = [getattr(row, name) for name in names]
            values[split : split + 1] = row.orders.values()
            writer.writerow(
                [f"{value:.9g}" if isinstance(value, float) else value for value in values]
            )


class PinFitInputs(TypedDict):
    """Inputs of the pin fit's study."""

    size: Annotated[float, "Element edge length [m]"]
    stage: Dimensions
    files: Annotated[Mapping[str, GivenFile], "Files by role; empty without any"]


class Residual(TypedDict):
    """Largest residual of a mix over the sweep."""

    residual: Annotated[float, "RMS left over RMS"]
    stiffness: Annotated[float, "Interface stiffness at the best mix [N m/rad]"]


class PinFitDocument(TypedDict):
    """pin_fit.json, written by pin-fit."""

    inputs: Annotated[PinFitInputs, "Inputs"]
    stiffness_of_changes: Annotated[
        Mapping[str, float], "Where the curve's character changes [N m/rad]"
    ]
    worst: Annotated[
        Mapping[str, Mapping[str, Residual]], "Largest residual by axial fit and kind of mix"
    ]
    versions: Versions
