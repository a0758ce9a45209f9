"""The one solid of a STEP file in gmsh's session: in metres, in the carrier's frame."""

import logging
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import gmsh
import numpy as np
from scipy.spatial.transform import Rotation

from carrierflex.files.child_process import limited
from carrierflex.files.plain_files import plain_content
from carrierflex.geometry.cad_faces import CadFace, cad_faces
from carrierflex.geometry.cad_surface_files import CadFrame
from carrierflex.geometry.half_sector import quiet_geometry
from carrierflex.geometry.mesh_checks import refuse_wrong_unit
from carrierflex.geometry.silent_output import silent_stdout

log = logging.getLogger(__name__)

#: Solids that a refusal lists.
_SHOWN = 4

#: Who reads STEP files, for messages; the largest one that is read [bytes].
READER = "OpenCASCADE"
_MOST_BYTES = 500_000_000
#: Length units that a surfaces file may state, in metres.
STATED_UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "inch": 0.0254}
#: Prefixes of the metre and other units that a STEP file may declare, in metres.
_PREFIXES = {
    "": 1.0, "kilo": 1e3, "hecto": 1e2, "deca": 10.0, "deci": 0.1, "centi": 1e-2, "milli": 1e-3,
    "micro": 1e-6, "nano": 1e-9,
}  # fmt: skip
_DECLARED_UNITS = {f"{prefix}metre": factor for prefix, factor in _PREFIXES.items()} | {
    "inch": 0.0254,
    "foot": 0.3048,
}


@contextmanager
def step_solid(path: Path, frame: CadFrame) -> Iterator[tuple[int, tuple[CadFace, ...]]]:
    """Open the file's solid in the carrier's frame, in metres, inside a gmsh session.

    Gives its number and its faces. The unit is the one that `frame` states, otherwise the declared
    one.

    Raises
    ------
    FileNotFoundError, ValueError
        Where the file is no STEP file with one solid, or its size is no carrier's.
    """
    unit = declared_unit(path)
    with quiet_geometry():
        gmsh.option.setString("Geometry.OCCTargetUnit", "M")
        if frame.length_unit is not None:
            # OpenCASCADE converts from the declared unit; a similarity keeps cylinders cylinders.
            factor = STATED_UNITS[frame.length_unit] / metres_of(unit, path)
            gmsh.option.setNumber("Geometry.OCCScaling", factor)
        size = path.stat().st_size
        with limited(60 + size // 100_000, 1_000_000_000 + 100 * size):
            solid = _imported_solid(path, unit, frame)
            _move(solid, frame)
            faces = cad_faces()
        yield solid, faces


def _imported_solid(path: Path, declared: str, frame: CadFrame) -> int:
    """Number of the one solid that the file holds, or that is chosen of several."""
    try:
        with silent_stdout():
            gmsh.model.occ.importShapes(str(path), highestDimOnly=False)
        gmsh.model.occ.synchronize()
    except Exception as error:
        raise ValueError(
            f"{path}: OpenCASCADE cannot read this STEP file ({error}); it may be cut short"
        ) from error
    solids = [tag for _, tag in gmsh.model.getEntities(3)]
    if len(solids) > 1 and frame.solid is not None:
        solids = _united(path, solids) if frame.solid == "united" else _alone(path, solids, frame)
    if len(solids) != 1:
        raise ValueError(
            f"{path}: holds {len(solids)} solids{_listed(solids)}; expected one, the carrier "
            "without pins and planets: choose one by its number or unite those that touch, by "
            "[frame] solid = 1 or solid = 'united' of the surfaces file, --solid of cad-surfaces; "
            "or export its solid alone"
        )
    stated = frame.length_unit
    low, high = np.split(np.array(gmsh.model.getBoundingBox(3, solids[0])), 2)
    unit = f"declared unit: {declared}" if stated is None else f"stated unit: {stated}"
    try:
        refuse_wrong_unit(high - low, f"{path} ({unit})")
    except ValueError as error:
        raise ValueError(
            f"{error}; where the unit is wrong, state it: [frame] length_unit of the surfaces "
            "file, --length-unit of cad-surfaces"
        ) from error
    log.info("%s: %s, converted to metres", path, unit)
    return solids[0]


def _united(path: Path, solids: list[int]) -> list[int]:
    """All solids as one; ValueError where they do not touch."""
    entities = [(3, tag) for tag in solids]
    joined, _ = gmsh.model.occ.fuse(entities[:1], entities[1:])
    gmsh.model.occ.synchronize()
    tags = [tag for _, tag in joined]
    if len(tags) != 1:
        raise ValueError(
            f"{path}: its {len(solids)} solids remain {len(tags)} when they are united"
            f"{_listed(tags)}; expected solids that touch in faces: choose one by its number, "
            "[frame] solid = 1 of the surfaces file, --solid 1 of cad-surfaces"
        )
    return tags


def _alone(path: Path, solids: list[int], frame: CadFrame) -> list[int]:
    """The solid of the frame's number; the others are removed."""
    number = int(str(frame.solid))
    if not 1 <= number <= len(solids):
        raise ValueError(
            f"{path}: solid {number} of {len(solids)}{_listed(solids)}; expected 1 to "
            f"{len(solids)}, by [frame] solid of the surfaces file or --solid of cad-surfaces"
        )
    chosen = solids.pop(number - 1)
    gmsh.model.occ.remove([(3, tag) for tag in solids], recursive=True)
    gmsh.model.occ.synchronize()
    return [chosen]


def _listed(solids: list[int]) -> str:
    """Number, name, extent and volume of the first solids."""
    lines = []
    for number, tag in enumerate(solids[:_SHOWN], start=1):
        low, high = np.split(np.array(gmsh.model.getBoundingBox(3, tag)), 2)
        name = gmsh.model.getEntityName(3, tag).split("/")[-1] or f"solid {tag}"
        extent = " x ".join(f"{1e3 * length:.4g}" for length in high - low)
        volume = 1e6 * gmsh.model.occ.getMass(3, tag)
        lines.append(f"{number}: {name!r} of {extent} mm, {volume:.4g} cm^3")
    return f" ({'; '.join(lines)}{'; ...' if len(solids) > _SHOWN else ''})" if lines else ""


def declared_unit(path: Path) -> str:
    """Length unit that a STEP file declares, in words.

    Raises
    ------
    FileNotFoundError
        Where there is no such file.
    ValueError
        Where the file is no STEP file, is cut short or declares no unit.
    """
    content = plain_content(path, "a STEP file (.step, .stp)", _MOST_BYTES)
    text = content.decode("latin-1")
    if not text.lstrip().startswith("ISO-10303-21"):
        raise ValueError(f"{path}: not a STEP file; expected one that begins with ISO-10303-21")
    if "END-ISO-10303-21" not in text[-1000:]:
        raise ValueError(
            f"{path}: cut short, the line END-ISO-10303-21 is missing; expected a complete STEP "
            "file"
        )
    converted = re.search(
        r"CONVERSION_BASED_UNIT\s*\(\s*'(INCH|FOOT|[A-Z]*METRE)'", text, re.IGNORECASE
    )
    if converted:
        return converted.group(1).lower()
    metric = re.search(
        r"LENGTH_UNIT\s*\(\s*\)[^;]*?SI_UNIT\s*\(\s*(?:\$|\.(\w+)\.)\s*,\s*\.METRE\.\s*\)", text
    )
    metric = metric or re.search(r"SI_UNIT\s*\(\s*(?:\$|\.(\w+)\.)\s*,\s*\.METRE\.\s*\)", text)
    if not metric:
        raise ValueError(
            f"{path}: declares no length unit; expected a LENGTH_UNIT, such as "
            "SI_UNIT(.MILLI.,.METRE.)"
        )
    return f"{(metric.group(1) or '').lower()}metre"


def metres_of(unit: str, path: Path) -> float:
    """Length of a declared unit [m]; ValueError names the file where the unit is an unknown one."""
    if unit not in _DECLARED_UNITS:
        known = ", ".join(_DECLARED_UNITS)
        raise ValueError(f"{path}: declares the length unit {unit!r}; expected one of {known}")
    return _DECLARED_UNITS[unit]


def _move(solid: int, frame: CadFrame) -> None:
    """Move the solid into the carrier's frame by rotation and translation.

    An affine map would make B-splines of cylinders.
    """
    turn = Rotation.from_matrix(frame.rotation).as_rotvec()
    angle = float(np.linalg.norm(turn))
    shift = -frame.origin
    if not (angle or shift.any()):
        return
    gmsh.model.occ.translate([(3, solid)], *shift)
    if angle:
        gmsh.model.occ.rotate([(3, solid)], 0.0, 0.0, 0.0, *(turn / angle), angle)
    gmsh.model.occ.synchronize()
