"""The elastic body of the planetary stage.

Default carrier, pins and main shaft, or body files in their place.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from carrierflex.geometry.parameter_files import read_parameters
from carrierflex.reduction.body_files import read_body
from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.reduction.pin_joints import carrier_with_pins
from carrierflex.reduction.reduced_model import ReducedModel
from carrierflex.simulation.stage.stage_body import (
    ShaftData,
    StageBody,
    beam_shaft,
    holds_pins,
    joined_to_shaft,
    refuse_missing_pilots,
    refuse_unfit_carrier,
)
from carrierflex.workflows.support.named_bodies import body_structure

#: Fixed-interface modes of carrier, pin and shaft, whole groups of equal frequency: up to about 2
#: kHz, far beyond the mesh frequency's harmonics.
_N_MODES = {"flexible_carrier": 20, "pin": 4, "main_shaft": 10}
#: What each body file must bring; a carrier is checked as a whole.
_PILOTS = {
    "pin": ("pin_1_upwind", "pin_1_midspan", "pin_1_downwind"),
    "shaft": ("main_bearing_seat", "carrier_joint"),
}


def default_stage_body(
    pin_fit_stiffness: float,
    size: float,
    *,
    carrier_factor: float = 1.0,
    main_shaft: str = "beam",
) -> StageBody:
    """Default carrier and pins by finite elements of `size` [m], joined to the main shaft.

    `carrier_factor` multiplies the carrier's stiffness: a large one makes it rigid. The shaft is a
    ``beam`` or of ``finite_elements`` with its lowest modes.
    """
    body = _reduced("flexible_carrier", size)
    carrier = carrier_with_pins(
        replace(body, K=carrier_factor * body.K), _reduced("pin", size), pin_fit_stiffness
    )
    return joined_to_shaft(carrier, _default_shaft(main_shaft, carrier, size))


def _default_shaft(kind: str, carrier: ReducedModel, size: float) -> ReducedModel:
    if kind == "finite_elements":
        return _reduced("main_shaft", size)
    return beam_shaft(ShaftData(), carrier.pilots["shaft_face"])


def stage_body_of_files(
    files: Mapping[str, Path], pin_fit_stiffness: float, size: float, *, main_shaft: str = "beam"
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
    main_shaft : str
        Default main shaft, as in :func:`default_stage_body`.

    Raises
    ------
    ValueError, FileNotFoundError
        Before any reduction, where a file is missing or its body lacks what the stage takes hold
        of; the message names it.
    """
    read = {name: _checked(name, path) for name, path in files.items()}
    carrier = read.get("carrier")
    if carrier is not None and holds_pins(carrier):
        if "pin" in read:
            raise ValueError(
                f"{files['pin']}: {carrier.name} comes with its pins; expected no body file for a "
                "pin"
            )
    else:
        pin = read.get("pin") or _reduced("pin", size)
        carrier = carrier_with_pins(
            carrier or _reduced("flexible_carrier", size), pin, pin_fit_stiffness
        )
    return joined_to_shaft(carrier, read.get("shaft") or _default_shaft(main_shaft, carrier, size))


def _reduced(name: str, size: float) -> ReducedModel:
    _, structure = body_structure(name, read_parameters(None), size)
    return craig_bampton(structure, _N_MODES[name]).model


def _checked(name: str, path: Path) -> ReducedModel:
    model = read_body(path)
    try:
        if name == "carrier":
            refuse_unfit_carrier(model, read_parameters(None).gear)
        else:
            refuse_missing_pilots(model, _PILOTS[name])
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    return model
