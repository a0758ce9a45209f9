"""Which few coordinates stand for the elastic body? Writes a Craig-Bampton body for a multibody simulation."""

from pathlib import Path
from typing import Literal

import numpy as np

from fe.rigid_couplings import rigidly_coupled
from fe.structural_model import (
    StructuralModel,
)
from geometry.carrier_mesh import DEFAULT_SIZE
from geometry.parameter_files import StageParameters, read_parameters
from reduction.body_files import write_body
from reduction.certificate import certify
from reduction.craig_bampton import craig_bampton
from reduction.fixed_interface_modes import count_below
from reduction.held_structure import GroundedBody, HeldStructure
from reduction.reduced_model import ReducedModel
from workflows.named_bodies import body_structure
from workflows.outputs import prepared_folder, provenance
from workflows.progress import Stages

#: Fixed-interface modes kept where the user does not say.
DEFAULT_MODES = 20


def main(
    *,
    body: Literal["carrier", "pin"],
    out: Path,
    variant: Literal["stiff", "flexible"] = "flexible",
    coupling: Literal["rbe3", "rbe2"] = "rbe3",
    modes: int | None = None,
    max_frequency: float | None = None,
    size: float = DEFAULT_SIZE,
    parameters: Path | None = None,
    quiet: bool = False,
) -> ReducedModel:
    """Reduce a body to its pilot nodes and fixed-interface modes (Craig-Bampton), with a certificate.

    Parameters
    ----------
    body
        carrier: the planet carrier; pin: planet pin 1 in the carrier's frame.
    out
        Body file (.h5): K, M, D, labels of every coordinate, pilots, sensor rows, mass properties, provenance; SI units.
    variant
        Of the carrier; stiff: pins bonded, pilots at the pins' mid-spans; flexible: no pins, pilots at the six bores.
    coupling
        Of the pilots to their surfaces; rbe3: distributing, the surface stays free to deform; rbe2: rigid. The truth of a
        fitted part lies between the two.
    modes
        Number of fixed-interface modes (20 where neither this nor a maximum frequency is given).
    max_frequency
        Keep all fixed-interface modes below this frequency [Hz] instead.
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
    if modes is not None and max_frequency is not None:
        raise ValueError("--modes and --max-frequency are both given; expected one of them")
    stages = Stages(4, quiet)
    with stages.stage(f"finite elements of {size} m"):
        structure = _structure(body, variant, stage, size, coupling=coupling)
    with stages.stage(f"reduction of {structure.n_dofs} degrees of freedom"):
        n_modes = _n_modes(structure, modes, max_frequency)
        choices = {"body": body, "variant": variant, "coupling": coupling, "modes": n_modes}
        record = provenance(parameters=stage, size=size, **choices)
        reduction = craig_bampton(structure, n_modes, provenance=record)
    with stages.stage("certificate"):
        certificate = certify(structure, reduction)
    with stages.stage(f"writing {out}"):
        write_body(reduction.model, out, certificate)
    return reduction.model


def _n_modes(structure: StructuralModel, modes: int | None, max_frequency: float | None) -> int:
    if max_frequency is None:
        return DEFAULT_MODES if modes is None else modes
    held = HeldStructure(GroundedBody(structure.K, structure.points, structure.rigid_points), structure.pilots)
    return count_below(held, structure.M, max_frequency, rng=np.random.default_rng(0))


def _structure(body: str, variant: str, stage: StageParameters, size: float, *, coupling: str) -> StructuralModel:
    mesh, structure = body_structure("pin" if body == "pin" else f"{variant}_carrier", stage, size)
    return structure if coupling == "rbe3" else rigidly_coupled(structure, mesh)
