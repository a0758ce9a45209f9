"""Estimate what a misaligned planet costs.

Contact pressure and pitting life of both meshes over the misalignment, and what of it a kink of
main shaft and carrier makes in the whole stage.

The 2012 paper finds 1.5 % more pressure at the sun and 23 % less life (its section 4). A good
answer tells at which misalignment of the mesh that happens, and which misalignment the stage has:
floating sun and bearings leave only a part of phi_PLC in the mesh, and the supports of carrier and
housing decide which.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, TypedDict

import numpy as np
from numpy.typing import NDArray

from carrierflex.files.json_files import save_json
from carrierflex.files.versions import Versions, versions
from carrierflex.geometry.involute_pair import InvolutePair, ring_planet_pair, sun_planet_pair
from carrierflex.geometry.parameter_files import read_parameters
from carrierflex.geometry.parameters import GearData
from carrierflex.geometry.pins import PAPER_STIFFNESS, planets_of
from carrierflex.identification.carrier.printed_tables import PHI_PLC
from carrierflex.simulation.stage.stage_data import StageData
from carrierflex.simulation.stage.tooth_contact import (
    MeshContact,
    ToothFlank,
    life_ratio,
    mesh_contact,
)
from carrierflex.simulation.view import mesh_contact_figure, stage_contact_figure
from carrierflex.workflows.fe.compute_curves import GivenFile
from carrierflex.workflows.outputs import prepared_folder, save_figure, save_table
from carrierflex.workflows.progress import Stages
from carrierflex.workflows.simulation.identified_life import (
    LIFE_HEADER,
    IdentifiedLife,
    IdentifiedSharing,
    IdentifiedTilt,
    identified_life,
    identified_sharing,
    identified_tilt,
    life_figure,
    life_rows,
)
from carrierflex.workflows.simulation.stage_misalignment import (
    KinkInMesh,
    StageState,
    kinks_in_meshes,
    stage_states,
)

#: Supports of the order-one study in which the kink is followed to the teeth: their numbers there.
_SUPPORTS = {
    "housing free": 0,
    "clearances": 12,
    "housing held": 19,
    "bearing A alone": 23,
}
#: Supports of the picture.
_SHOWN = ("housing held", "clearances")
#: Opens one end of every mesh under any load in use [rad].
_LARGE_MISALIGNMENT = 0.02
#: Increase of the contact pressure that the paper reports for the sun.
_PAPER_INCREASE = 0.015


@dataclass(frozen=True, eq=False)
class MeshLife:
    """One mesh over its misalignment.

    Parameters
    ----------
    aligned_pressure : float
        Largest contact pressure of the aligned mesh [Pa].
    pressure_ratio, life_ratio : ndarray, shape (n,)
        Worse direction of misalignment over aligned.
    papers_misalignment : float
        Misalignment of the mesh that raises the pressure by the paper's 1.5 % [rad].
    """

    aligned_pressure: float
    pressure_ratio: NDArray[np.float64]
    life_ratio: NDArray[np.float64]
    papers_misalignment: float


@dataclass(frozen=True, eq=False)
class GearLife:
    """Both meshes, ``sun`` and ``ring``, one torque and flank."""

    torque: Annotated[float, "[N m]"]
    flank: Annotated[ToothFlank, "Modifications and stiffness"]
    misalignment: Annotated[NDArray[np.float64], "Of the sweep [rad], shape (n,)"]
    meshes: Annotated[dict[str, MeshLife], "Sweep by mesh"]
    states: Annotated[
        list[StageState],
        "The stage by support and carrier, without and with the shaft-carrier misalignment",
    ]
    kinks: Annotated[list[KinkInMesh], "Effect of the misalignment on the meshes"]
    identified: Annotated[
        IdentifiedLife | None, "Life under what a campaign identified; null without a diagnosis"
    ] = None


def main(
    *,
    out: Path,
    torque: float = 360e3,
    crowning: float = ToothFlank.crowning,
    tip_relief: float = ToothFlank.tip_relief,
    largest_misalignment: float = PHI_PLC,
    phi_plc: float | None = None,
    diagnosis: Path | None = None,
    loads: Path | None = None,
    parameters: Path | None = None,
    size: float | None = None,
    step: Path | None = None,
    surfaces: Path | None = None,
    quiet: bool = False,
) -> GearLife:
    """Contact pressure and pitting life of sun and ring mesh over misalignment.

    What misalignment a kink between main shaft and carrier makes comes from the statics of the
    whole stage, by support of carrier and housing.

    Parameters
    ----------
    out
        Folder to write: gear_life.json, gear_life.png, stage_meshes.csv, stage_tilts.csv and
        stage_contact.png; with a diagnosis identified_life.csv and identified_life.png too.
    torque
        Torque of the main shaft [N m], shared equally by the planets.
    crowning
        Height of the crowning at the ends of the face width [m].
    tip_relief
        Tip relief of both wheels, normal to the flank [m].
    largest_misalignment
        End of the sweep: slope of the gap over the face width in the plane of action [rad].
    phi_plc
        Misalignment of main shaft and carrier in the stage [rad]; default: 0.58e-3.

        The 2012 paper's by default, or the tilt of the diagnosis.
    diagnosis
        diagnosis.json of diagnose, or its folder: identified tilt.

        The tilt of the carrier that it identifies, with its interval, in place of a typed one. Load
        and life of teeth and planet bearings by assumed support, with intervals.
    loads
        loads.json of loads, or its folder, beside a diagnosis.

        The load sharing factor that it identifies, with its interval.
    parameters
        TOML file with the tables [carrier], [pin], [gear]; a missing key has its default.
    size
        Element edge length of carrier and pins [m]; default: 0.03; of a STEP file as of carrierflex
        curves.
    step
        STEP file with the carrier without pins, instead of the parametric carrier; any length unit.
    surfaces
        TOML file that states the STEP file's surfaces; carrierflex cad writes one to start from.
    quiet
        Show no progress.

    Returns
    -------
    GearLife
        Pressure and life by mesh.
    """
    stage = read_parameters(parameters)
    flank = ToothFlank(crowning=crowning, tip_relief=tip_relief)
    if not (np.isfinite(largest_misalignment) and largest_misalignment > 0.0):
        raise ValueError(
            f"--largest-misalignment is {largest_misalignment} rad; expected a positive angle"
        )
    if phi_plc is not None and not np.isfinite(phi_plc):
        raise ValueError(f"--phi-plc is {phi_plc} rad; expected a finite angle")
    tilt, sharing = _identified(phi_plc, diagnosis, loads)
    kink = phi_plc if phi_plc is not None else tilt.phi.value if tilt else PHI_PLC

    from carrierflex.workflows.geometry.carrier_files import CarrierFiles

    files = CarrierFiles(step, surfaces)
    record, edge = files.record(), files.element_size(size)
    prepared_folder(out)

    from carrierflex.simulation.stage.statics import SteadyLoad
    from carrierflex.workflows.simulation.stage_bodies import (
        flexible_and_rigid_body,
        reduced_carrier_and_pin,
    )

    stages = Stages(3 + (tilt is not None), quiet)
    with stages.stage(f"reduced carrier and pins, elements of {edge:.3g} m, and a rigid carrier"):
        carrier, pin, gear = reduced_carrier_and_pin(edge, stage, files)
        flexible, rigid = flexible_and_rigid_body(carrier, pin, PAPER_STIFFNESS)
    force = _tangential_force(torque, gear, planets_of(carrier.pilots))
    slopes = np.linspace(0.0, largest_misalignment, 30)
    pairs = {"sun": sun_planet_pair(gear), "ring": ring_planet_pair(gear)}
    with stages.stage("meshes over their misalignment"):
        meshes = {name: _swept(pair, flank, force, slopes) for name, pair in pairs.items()}
    with stages.stage("statics of the stage with and without the misalignment"):
        bodies = {"flexible": flexible, "rigid": rigid}
        states = stage_states(bodies, _stages(gear), kink, SteadyLoad(torque))
        kinks = kinks_in_meshes(states, pairs, flank)
    life = GearLife(torque, flank, slopes, meshes, states, kinks)
    if tilt is not None:
        with stages.stage("life under the identified tilt"):
            load = SteadyLoad(torque)
            of_tilt = identified_life(
                tilt, sharing, flexible, _stages(gear), pairs=pairs, flank=flank, load=load
            )
        life = replace(life, identified=of_tilt)
        save_table(out / "identified_life.csv", LIFE_HEADER, list(life_rows(of_tilt)))
        save_figure(out / "identified_life.png", life_figure(of_tilt))
    _write_stage(life, pairs, force, out)
    inputs = {
        "torque": torque,
        "gear": gear,
        "size": edge,
        "files": record,
        "diagnosis": str(diagnosis) if diagnosis else None,
        "loads": str(loads) if loads else None,
    }
    save_json(
        out / "gear_life.json",
        {"inputs": inputs, "result": life, "versions": versions()},
    )
    contacts = {
        f"{name}, {slope * 1e6:.0f} urad": mesh_contact(pair, flank, force, misalignment=slope)
        for name, pair in pairs.items()
        for slope in (0.0, largest_misalignment)
    }
    ratios = {name: mesh.pressure_ratio for name, mesh in life.meshes.items()}
    save_figure(out / "gear_life.png", mesh_contact_figure(contacts, slopes, ratios))
    return life


def _identified(
    phi_plc: float | None, diagnosis: Path | None, loads: Path | None
) -> tuple[IdentifiedTilt | None, IdentifiedSharing | None]:
    """Tilt and load sharing of files."""
    if diagnosis is None:
        if loads is not None:
            raise ValueError("--loads is given without --diagnosis; expected both")
        return None, None
    if phi_plc is not None:
        raise ValueError("--phi-plc and --diagnosis are both given; expected one of them")
    return identified_tilt(diagnosis), None if loads is None else identified_sharing(loads)


def _stages(gear: GearData) -> dict[str, StageData]:
    """Stages by support, with these gears."""
    from carrierflex.workflows.simulation.order_one_supports import supports

    table = supports()
    return {name: replace(table[number].data, gear=gear) for name, number in _SUPPORTS.items()}


def _write_stage(
    life: GearLife, pairs: Mapping[str, InvolutePair], force: float, out: Path
) -> None:
    n_planets = len(life.kinks[0].added_slope)
    planets = [f"added slope, planet {planet} [urad]" for planet in range(1, n_planets + 1)]
    pressures = ["aligned: pressure [MPa]", "misaligned: pressure [MPa]", "increase [%]", "life"]
    raw = [
        "no lead correction, aligned: pressure [MPa]",
        "no lead correction, misaligned: pressure [MPa]",
    ]
    header = ["support", "carrier", "mesh", "common slope [urad]", *planets, *pressures, *raw]
    save_table(out / "stage_meshes.csv", header, [_mesh_row(kink) for kink in life.kinks])
    tilts = [
        [state.support, state.carrier, state.phi_PLC * 1e3, wheel, *(state.tilt[wheel] * 1e6)]
        for state in life.states
        for wheel in state.tilt
    ]
    header = ["support", "carrier", "phi_PLC [mrad]", "part", "about y [urad]", "about z [urad]"]
    save_table(out / "stage_tilts.csv", header, tilts)
    save_figure(out / "stage_contact.png", stage_contact_figure(_contacts(life, pairs, force)))


def _mesh_row(kink: KinkInMesh) -> list[object]:
    slopes = [kink.common_slope * 1e6, *(kink.added_slope * 1e6)]
    pressures = [kink.pressure / 1e6, kink.pressure_with_kink / 1e6]
    increase = [(kink.pressure_ratio - 1.0) * 100.0, kink.life_ratio]
    raw = [kink.uncorrected / 1e6, kink.uncorrected_with_kink / 1e6]
    return [kink.support, kink.carrier, kink.mesh, *slopes, *pressures, *increase, *raw]


def _contacts(
    life: GearLife, pairs: Mapping[str, InvolutePair], force: float
) -> dict[str, MeshContact]:
    """Contacts of the worst planet by title: aligned, and with the kink by support."""
    contacts = {}
    for mesh, pair in pairs.items():
        contacts[f"{mesh}, aligned"] = mesh_contact(pair, life.flank, force)
        shown = [kink for kink in life.kinks if kink.mesh == mesh and kink.support in _SHOWN]
        for kink in (kink for kink in shown if kink.carrier == "flexible"):
            title = f"{mesh}, {kink.support}:\n{kink.worst * 1e6:.0f} urad"
            contacts[title] = mesh_contact(pair, life.flank, force, misalignment=kink.worst)
    return contacts


def _tangential_force(torque: float, gear: GearData, n_planets: int) -> float:
    """Force of each mesh at the working pitch circle [N]."""
    # Half the pin force T/(n a), as the planet is in balance.
    return torque / (n_planets * gear.centre_distance) / 2.0


def _swept(
    pair: InvolutePair, flank: ToothFlank, force: float, slopes: NDArray[np.float64]
) -> MeshLife:

    from scipy.optimize import brentq

    aligned = mesh_contact(pair, flank, force).largest_pressure

    def ratio(slope: float) -> float:
        """Larger contact pressure of both senses of a misalignment, over the aligned one."""
        both = (
            mesh_contact(pair, flank, force, misalignment=sign * slope).largest_pressure
            for sign in (1, -1)
        )
        return max(both) / aligned

    ratios = np.array([ratio(slope) for slope in slopes])
    papers = brentq(
        lambda slope: ratio(slope) - 1.0 - _PAPER_INCREASE, 0.0, _LARGE_MISALIGNMENT, xtol=1e-9
    )
    return MeshLife(
        aligned,
        ratios,
        np.array([life_ratio(ratios_of_mesh) for ratios_of_mesh in ratios]),
        float(papers),
    )


class GearLifeInputs(TypedDict):
    """Inputs of the gear life."""

    torque: Annotated[float, "Torque of the main shaft [N m]"]
    gear: Annotated[Mapping[str, float], "Table [gear] of carrier-parameters"]
    size: Annotated[float, "Element edge length [m]"]
    files: Annotated[Mapping[str, GivenFile], "Files of the carrier by role; empty without any"]
    diagnosis: Annotated[str | None, "Diagnosis that the tilt is from; null without one"]
    loads: Annotated[str | None, "Loads that the sharing factor is from; null without them"]


class GearLifeDocument(TypedDict):
    """gear_life.json, written by gear-life."""

    inputs: Annotated[GearLifeInputs, "Inputs"]
    result: Annotated[GearLife, "Pressure and life by mesh"]
    versions: Versions
