"""Which few coordinates stand for the elastic body? Writes a Craig-Bampton body for a multibody simulation."""

from pathlib import Path
from typing import Literal

from fe.structural_model import (
    FLEXIBLE_CARRIER_PILOTS,
    PIN_PILOTS,
    STIFF_CARRIER_PILOTS,
    StructuralModel,
    structural_model,
)
from geometry.carrier_mesh import DEFAULT_SIZE, flexible_carrier_mesh, pin_mesh, stiff_carrier_mesh
from geometry.parameter_files import StageParameters, read_parameters
from reduction.body_files import write_body
from reduction.craig_bampton import craig_bampton
from reduction.reduced_model import ReducedModel
from workflows.outputs import prepared_folder, provenance
from workflows.progress import Stages


def main(
    *,
    body: Literal["carrier", "pin"],
    out: Path,
    variant: Literal["stiff", "flexible"] = "flexible",
    modes: int = 20,
    size: float = DEFAULT_SIZE,
    parameters: Path | None = None,
    quiet: bool = False,
) -> ReducedModel:
    """Reduce a body to its pilot nodes and fixed-interface modes (Craig-Bampton, distributing couplings).

    Parameters
    ----------
    body
        carrier: the planet carrier; pin: planet pin 1 in the carrier's frame.
    out
        Body file (.h5): K, M, D, labels of every coordinate, pilots, sensor rows, mass properties, provenance; SI units.
    variant
        Of the carrier; stiff: pins bonded, pilots at the pins' mid-spans; flexible: no pins, pilots at the six bores.
    modes
        Number of fixed-interface modes.
    size
        Element edge length [m].
    parameters
        TOML file with the tables [carrier], [pin], [gear], dimensions in metres; what it leaves out keeps its default.
    quiet
        Show no progress.

    Returns
    -------
    ReducedModel
        The body as written.
    """
    stage = read_parameters(parameters)
    if out.suffix != ".h5":
        raise ValueError(f"{out}: suffix {out.suffix!r}; expected .h5")
    prepared_folder(out.parent)
    stages = Stages(3, quiet)
    with stages.stage(f"finite elements of {size} m"):
        structure = _structure(body, variant, stage, size)
    with stages.stage(f"reduction of {structure.n_dofs} degrees of freedom, {modes} modes"):
        record = provenance(parameters=stage, size=size, body=body, variant=variant, modes=modes)
        model = craig_bampton(structure, modes, provenance=record).model
    with stages.stage(f"writing {out}"):
        write_body(model, out)
    return model


def _structure(body: str, variant: str, stage: StageParameters, size: float) -> StructuralModel:
    if body == "pin":
        return structural_model("pin", pin_mesh(stage.carrier, stage.pin, size), stage.carrier, PIN_PILOTS)
    if variant == "flexible":
        mesh, pilots = flexible_carrier_mesh(stage.carrier, size), FLEXIBLE_CARRIER_PILOTS
    else:
        mesh, pilots = stiff_carrier_mesh(stage.carrier, stage.pin, size), STIFF_CARRIER_PILOTS
    return structural_model(f"{variant}_carrier", mesh, stage.carrier, pilots)
