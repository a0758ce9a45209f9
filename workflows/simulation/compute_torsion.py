"""Torsional stiffness of shaft, gearbox and mounting.

The frequencies of the drive train (2011 paper, sections 5.2, 5.3).

A torque that grows at the hub gives the stiffness of main shaft and gearbox from the whole
planetary stage and that of the mounting from its bushings; two topologies of the torsional train
give the frequencies. A good answer: three stiffnesses of one order of magnitude, and a first
frequency that the mounting lowers by a third. That shaft and gearbox agree with the paper proves
nothing: their dimensions in the stage were derived from the printed stiffnesses.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypedDict

import numpy as np

from carrierflex.files.json_files import save_json
from carrierflex.files.versions import Versions, versions
from carrierflex.geometry.parameter_files import read_parameters
from carrierflex.geometry.pins import PAPER_STIFFNESS
from carrierflex.simulation.mounting.case_files import read_mounting_case
from carrierflex.simulation.mounting.parameter_arrays import parameter_array
from carrierflex.simulation.mounting.rig import MountingRig
from carrierflex.simulation.mounting.torsional_train import (
    TorqueSweep,
    TorsionalTrain,
    mounted_and_held_hz,
)
from carrierflex.simulation.stage.torsion_view import torque_sweep_figure
from carrierflex.workflows.fe.compute_curves import GivenFile
from carrierflex.workflows.outputs import prepared_folder, save_figure, save_table
from carrierflex.workflows.progress import Stages

if TYPE_CHECKING:
    from carrierflex.workflows.geometry.carrier_files import CarrierFiles

#: What the 2011 paper prints: stiffness [N m/rad] by member, first frequency by mounting (in Hz;
#: printed as rad/s).
PAPER_STIFFNESSES = {"main shaft": 50e6, "gearbox": 27e6, "mounting": 11.4e6}
PAPER_FREQUENCIES_HZ = {"held": 2.11, "on bushings": 1.47}
#: Members of the stage whose data were derived from a printed stiffness, and which.
FITTED = {
    "main shaft": "outer diameter of the shaft, from 50 MN m/rad over its length",
    "gearbox": "torsion of the sun shaft, the rest that makes 27 MN m/rad at the carrier",
}


@dataclass(frozen=True, eq=False)
class Torsion:
    """Sweeps by member, and frequencies [Hz] of the train by topology and mounting."""

    sweeps: Mapping[str, TorqueSweep]
    frequencies_hz: Mapping[tuple[str, str], np.ndarray]


def main(
    *,
    out: Path,
    torque: float = 360e3,
    case: Path | None = None,
    rotor_inertia: float = TorsionalTrain.rotor,
    generator_inertia: float = TorsionalTrain.generator,
    housing_inertia: float = TorsionalTrain.housing_inertia,
    shaft_stiffness: float = TorsionalTrain.shaft_stiffness,
    gearbox_stiffness: float = TorsionalTrain.gearbox_stiffness,
    bushing_stiffness: float = TorsionalTrain.bushing_stiffness,
    size: float | None = None,
    step: Path | None = None,
    surfaces: Path | None = None,
    parameters: Path | None = None,
    quiet: bool = False,
) -> Torsion:
    """Torsional stiffness of main shaft, gearbox and mounting.

    Natural frequencies of the torsional drive train.

    Stiffnesses come from a torque sweep of the default planetary stage and of the mounting; the
    frequencies from the inertias and stiffnesses given here, by default those that the 2011 paper
    prints (its figure 12).

    Parameters
    ----------
    out
        Folder to write: torsion.json, torque_sweep.csv and torque_sweep.png.
    torque
        Torque on the main shaft that the sweep reaches [N m].
    case
        Case file of kind mounting whose bushings are swept (its [rig] and [truth]); default: linear
        bushings of table 3.
    rotor_inertia
        Of the rotor about the main shaft [kg m^2].
    generator_inertia
        Of the high-speed shaft with the generator about its own axis [kg m^2].
    housing_inertia
        Of the gearbox housing about the main shaft [kg m^2]; not in the paper.
    shaft_stiffness
        Of the main shaft [N m/rad].
    gearbox_stiffness
        Of the gearbox at the main shaft, housing and output held [N m/rad].
    bushing_stiffness
        Of the mounting about the main shaft [N m/rad].
    size
        Element edge length of carrier and pins [m]; default: 0.03; of a STEP file as of carrierflex
        curves.
    step
        STEP file with the carrier without pins, instead of the parametric carrier; any length unit.
    surfaces
        TOML file that states the STEP file's surfaces; carrierflex cad writes one to start from.
    parameters
        TOML file with the tables [carrier], [pin], [gear]; a missing key has its default.
    quiet
        Show no progress.

    Returns
    -------
    Torsion
        Sweeps and frequencies.
    """
    train = TorsionalTrain(
        rotor=rotor_inertia,
        generator=generator_inertia,
        housing_inertia=housing_inertia,
        shaft_stiffness=shaft_stiffness,
        gearbox_stiffness=gearbox_stiffness,
        bushing_stiffness=bushing_stiffness,
    )
    rig, bushings = _mounting(case)

    from carrierflex.simulation.mounting.torque_sweep import mounting_sweep
    from carrierflex.simulation.stage.stage_data import StageData
    from carrierflex.simulation.stage.stage_model import stage_model
    from carrierflex.simulation.stage.torque_sweep import stage_sweeps
    from carrierflex.workflows.geometry.carrier_files import CarrierFiles
    from carrierflex.workflows.simulation.stage_bodies import reduced_carrier_and_pin, stage_body_of

    # Cheap, and refuses a torque that cannot be before the folder is made.
    on_mounting = mounting_sweep(rig, bushings, torque)
    stage, files = read_parameters(parameters), CarrierFiles(step, surfaces)
    edge = files.element_size(size)
    prepared_folder(out)
    stages = Stages(2, quiet)
    with stages.stage(f"reduced carrier and pins, elements of {edge:.3g} m"):
        carrier, pin, gear = reduced_carrier_and_pin(edge, stage, files)
        body = stage_body_of(carrier, pin, PAPER_STIFFNESS)
        model = stage_model(body, StageData(gear=gear), speed=0.0)
    with stages.stage("torque sweep of the stage"):
        sweeps = stage_sweeps(model, torque * np.linspace(0.1, 1.0, 10))
    result = Torsion(
        {"main shaft": sweeps.main_shaft, "gearbox": sweeps.gearbox, "mounting": on_mounting},
        mounted_and_held_hz(train),
    )
    _write(result, train, edge, files, out)
    return result


def _mounting(case: Path | None) -> tuple[MountingRig, np.ndarray]:
    if case is None:
        return MountingRig(), parameter_array(MountingRig())
    what = read_mounting_case(case)
    return what.rig, what.truth


def _write(
    result: Torsion, train: TorsionalTrain, size: float, files: "CarrierFiles", out: Path
) -> None:
    rows = [
        [name, torque, rotation]
        for name, sweep in result.sweeps.items()
        for torque, rotation in zip(sweep.torque, sweep.rotation, strict=True)
    ]
    save_table(out / "torque_sweep.csv", ["member", "torque [N m]", "rotation [rad]"], rows)
    save_figure(out / "torque_sweep.png", torque_sweep_figure(result.sweeps))
    content = {
        "inputs": {"size": size, "files": files.record()},
        "train": train,
        "stiffness_nm_per_rad": {name: sweep.stiffness for name, sweep in result.sweeps.items()},
        "paper": {
            "stiffness_nm_per_rad": PAPER_STIFFNESSES,
            "first_frequency_hz": PAPER_FREQUENCIES_HZ,
            "fitted_to_it": FITTED,
        },
        "frequencies_hz": {
            f"{topology}, {mount}": f for (topology, mount), f in result.frequencies_hz.items()
        },
        "versions": versions(),
    }
    save_json(out / "torsion.json", content)


class TorsionPaper(TypedDict):
    """What the paper prints of the torsional train."""

    stiffness_nm_per_rad: Annotated[Mapping[str, Any], "Stiffness by member [N m/rad]"]
    first_frequency_hz: Annotated[Any, "First frequency [Hz]"]
    fitted_to_it: Annotated[Any, "What was fitted to it"]


class CarrierInputs(TypedDict):
    """Where the carrier comes from."""

    size: Annotated[float, "Element edge length [m]"]
    files: Annotated[Mapping[str, GivenFile], "Files by role; empty without any"]


class TorsionDocument(TypedDict):
    """torsion.json, written by torsion."""

    inputs: Annotated[CarrierInputs, "Carrier of the stage"]
    train: Annotated[TorsionalTrain, "Inertias, stiffnesses, ratios"]
    stiffness_nm_per_rad: Annotated[Mapping[str, float], "By member, from the sweeps [N m/rad]"]
    paper: Annotated[TorsionPaper, "What the paper prints"]
    frequencies_hz: Annotated[Mapping[str, Sequence[float]], "By topology and mounting [Hz]"]
    versions: Versions
