"""The elastic body of the planetary stage.

Default carrier, pins and main shaft, or body files in their place.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from carrierflex.geometry.parameter_files import StageParameters, read_parameters
from carrierflex.geometry.parameters import GearData
from carrierflex.geometry.pins import planets_of
from carrierflex.reduction.body_files import read_body
from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.reduction.mode_count import rule_of_options
from carrierflex.reduction.pin_joints import carrier_with_each_pin, carrier_with_pins
from carrierflex.reduction.reduced_model import ReducedModel
from carrierflex.reduction.shapes.body_stresses import BodyStresses
from carrierflex.simulation.stage.stage_body import (
    ShaftData,
    StageBody,
    beam_shaft,
    holds_pins,
    joined_to_shaft,
    refuse_missing_pilots,
    refuse_unfit_carrier,
)
from carrierflex.simulation.stage.stress import pins_with_stress_rows, with_stress_rows
from carrierflex.workflows.fe.bodies import body_structure, built_carrier, built_pin
from carrierflex.workflows.geometry.carrier_files import CarrierFiles

#: Stiffness of a carrier that counts as rigid, over the real one: its deflection falls below a
#: micrometre.
RIGID_FACTOR = 100.0
#: What each body file must bring; a carrier is checked as a whole.
_PILOTS = {
    "pin": ("pin_1_upwind", "pin_1_midspan", "pin_1_downwind"),
    "shaft": ("main_bearing_seat", "carrier_joint"),
}


def default_stage_body(
    pin_fit_stiffness: float,
    size: float,
    *,
    main_shaft: str = "beam",
) -> StageBody:
    """Default carrier and pins by finite elements of `size` [m], joined to the main shaft.

    The shaft is a ``beam`` or of ``finite_elements`` with its lowest modes.
    """
    return stage_body_of_files({}, pin_fit_stiffness, size, gear=GearData(), main_shaft=main_shaft)


def flexible_and_rigid_body(
    carrier: ReducedModel, pin: ReducedModel, pin_fit_stiffness: float
) -> tuple[StageBody, StageBody]:
    """Bodies of two stages that differ in the carrier: its own stiffness, and that of a rigid one.

    Parameters
    ----------
    carrier, pin : ReducedModel
        The carrier's own stiffness, without pins, and pin 1.
    pin_fit_stiffness : float
        Bending stiffness of each pin interface [N m/rad].
    """
    return (
        stage_body_of(carrier, pin, pin_fit_stiffness),
        stage_body_of(made_rigid(carrier), pin, pin_fit_stiffness),
    )


def reduced_carrier_and_pin(
    size: float, stage: StageParameters | None = None, files: CarrierFiles | None = None
) -> tuple[ReducedModel, ReducedModel, GearData]:
    """Carrier without pins, pin and gear, by finite elements of `size` [m], for several stages.

    Parameters
    ----------
    size : float
        Element edge length [m].
    stage : StageParameters, optional
        Dimensions other than the default's.
    files : CarrierFiles, optional
        STEP file of the carrier, where it is not that of the dimensions.
    """
    stage, files = stage or read_parameters(None), files or CarrierFiles()
    built = built_carrier("flexible", stage, size, files)
    pin = built_pin(stage, size, files)
    rule = rule_of_options({})
    carrier, reduced_pin = (craig_bampton(body, rule).model for body in (built.structure, pin))
    return carrier, reduced_pin, built.gear


def reduced_pin(size: float) -> ReducedModel:
    """Default pin by finite elements of `size` [m]."""
    return _reduced("pin", size)


def made_rigid(carrier: ReducedModel) -> ReducedModel:
    """Copy of a carrier that is so stiff that it counts as rigid."""
    return replace(carrier, K=RIGID_FACTOR * carrier.K)


def stage_body_of(carrier: ReducedModel, pin: ReducedModel, pin_fit_stiffness: float) -> StageBody:
    """Body of a stage from a reduced carrier without pins, a pin and the default main shaft.

    Parameters
    ----------
    carrier, pin : ReducedModel
        Bodies.
    pin_fit_stiffness : float
        Bending stiffness of each pin interface [N m/rad].
    """
    pinned = carrier_with_pins(carrier, pin, pin_fit_stiffness)
    return joined_to_shaft(pinned, beam_shaft(ShaftData(), pinned.pilots["shaft_face"]))


def stage_body_of_files(
    files: Mapping[str, Path],
    pin_fit_stiffness: float,
    size: float,
    *,
    gear: GearData,
    main_shaft: str = "beam",
    stresses: BodyStresses | None = None,
    pin_stresses: BodyStresses | None = None,
) -> StageBody:
    """Body of a stage in which files stand for some of carrier, pin and main shaft.

    Parameters
    ----------
    files : mapping of str to Path
        Files of ``carrierflex reduce`` by ``carrier``, ``pin`` and ``shaft``. A carrier with its
        pins takes no pin. Missing ones are the default's.
    pin_fit_stiffness : float
        Bending stiffness of each pin interface [N m/rad].
    size : float
        Element edge length [m] of default bodies.
    gear : GearData
        Gears whose centre distance the carrier's pins have to stand at.
    main_shaft : str
        Default main shaft, as in :func:`default_stage_body`.
    stresses : BodyStresses, optional
        Stress rows of the carrier's file, to be read like its sensors.
    pin_stresses : BodyStresses, optional
        Those of the pin's file.

    Raises
    ------
    ValueError, FileNotFoundError
        Before any reduction, where a file is missing or its body lacks what the stage takes hold
        of; the message names it.
    """
    read = {name: _checked(name, path, gear) for name, path in files.items()}
    carrier = read.get("carrier")
    if carrier is not None and stresses is not None:
        carrier = with_stress_rows(carrier, stresses)
    if carrier is not None and holds_pins(carrier):
        if "pin" in read:
            raise ValueError(
                f"{files['pin']}: {carrier.name} comes with its pins; expected no body file for a "
                "pin"
            )
    else:
        pin = read.get("pin") or _reduced("pin", size)
        carrier = carrier or _reduced("flexible_carrier", size)
        n_planets = planets_of(carrier.pilots)
        pins = (pin,) * n_planets
        if pin_stresses is not None:
            pins = pins_with_stress_rows(pin, pin_stresses, n_planets)
        carrier = carrier_with_each_pin(carrier, pins, pin_fit_stiffness)
    shaft = read.get("shaft")
    if shaft is None and main_shaft == "finite_elements":
        shaft = _reduced("main_shaft", size)
    return joined_to_shaft(carrier, shaft or beam_shaft(ShaftData(), carrier.pilots["shaft_face"]))


def _reduced(name: str, size: float) -> ReducedModel:
    _, structure = body_structure(name, read_parameters(None), size)
    # The frequency of use that `carrierflex reduce` has without options, and modes that follow.
    return craig_bampton(structure, rule_of_options({})).model


def _checked(name: str, path: Path, gear: GearData) -> ReducedModel:
    model = read_body(path)
    try:
        if name == "carrier":
            refuse_unfit_carrier(model, gear)
        else:
            refuse_missing_pilots(model, _PILOTS[name])
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    return model
