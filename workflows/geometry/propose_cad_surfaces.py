"""Which faces of a CAD model are the carrier's axis, pins, seats, rim and shaft face.

Proposes surfaces.toml and draws what was recognised, before anything is computed.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from carrierflex.files.whole_files import check_file_writable, refuse_existing
from carrierflex.geometry.cad_surface_tables import ChosenSolid, StepUnit
from carrierflex.workflows.outputs import prepared_folder, save_image

if TYPE_CHECKING:
    from carrierflex.geometry.cad_recognition.surface_proposal import SurfaceProposal

Triple = tuple[float, float, float]


def main(
    step: Path,
    *,
    out: Path,
    axis: Triple | None = None,
    origin: Triple | None = None,
    length_unit: StepUnit | None = None,
    solid: ChosenSolid | None = None,
    sensor_radius: float | None = None,
    bearing_width: float | None = None,
) -> SurfaceProposal:
    """Recognise axis, pins, seats and rim of a STEP file; write surfaces.toml.

    The picture stands beside it under the same name, .png: surfaces numbered as in the list, what
    is proposed in colour. A name that several surfaces fit alike is left out, with the candidates
    as comments.

    Parameters
    ----------
    step
        STEP file with one solid, the carrier without pins and planets.
    out
        File to write (.toml); an existing one is not replaced. The picture has its name.
    axis
        Direction downwind, in the file's frame, where it is not to be recognised: 0 0 1.
    origin
        Point of the axis in the upwind face of the rim, in the file's frame [m].
    length_unit
        Length unit of the STEP file where it declares a wrong one.
    solid
        Solid of a STEP file that holds several: its number in the list that a refusal shows, or
        united for all of them, which must touch.
    sensor_radius
        Radius of the circle on the rim face that the sensors are aimed at [m]; half-way between
        bores and rim where it is not given.
    bearing_width
        Width of the planet bearings' seat on the pins [m]; two thirds of the gap between the bores
        where it is not given.

    Returns
    -------
    SurfaceProposal
        A good answer names every surface; look at the picture, and correct the file.
    """
    picture = _checked_outputs(out)
    given = {"--axis": axis, "--origin": origin}
    direction, point = (_finite(name, values) for name, values in given.items())
    if direction is not None and not np.linalg.norm(direction):
        raise ValueError(f"--axis is {direction.tolist()}; expected a direction, not all zero")
    for name, length in (("--sensor-radius", sensor_radius), ("--bearing-width", bearing_width)):
        if length is not None and not 0.0 < length < math.inf:
            raise ValueError(f"{name} is {length} m; expected a positive length in metres")

    from carrierflex.geometry.cad_recognition.oriented_faces import cad_solid
    from carrierflex.geometry.cad_recognition.proposal_files import write_proposal
    from carrierflex.geometry.cad_recognition.surface_proposal import proposed_surfaces
    from carrierflex.geometry.cad_recognition.view import proposal_picture

    proposal = proposed_surfaces(
        step,
        cad_solid(step, length_unit, solid),
        axis=direction,
        origin=point,
        length_unit=length_unit,
        sensor_radius=sensor_radius,
        bearing_width=bearing_width,
    )
    proposal = replace(proposal, frame=replace(proposal.frame, solid=solid))
    image = proposal_picture(proposal)
    prepared_folder(out.parent)
    save_image(picture, image)
    write_proposal(out, proposal)
    return proposal


def _checked_outputs(out: Path) -> Path:
    """Path of the picture beside the surfaces file; both can be written."""
    if out.suffix != ".toml":
        raise ValueError(f"--out is {out}; expected the name of a surfaces file, .toml")
    picture = out.with_suffix(".png")
    refuse_existing(out, picture)
    if out.parent.exists():
        check_file_writable(out)
    return picture


def _finite(name: str, values: Triple | None) -> NDArray[np.float64] | None:
    if values is None:
        return None
    if not all(math.isfinite(value) for value in values):
        raise ValueError(f"{name} is {list(values)}; expected three finite numbers")
    return np.array(values)
