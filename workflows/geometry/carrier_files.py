"""A carrier from files instead of parameters.

A STEP file with stated surfaces, or meshes with named surfaces.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from carrierflex.fe.materials import BODY_MATERIALS, Material
from carrierflex.fe.solids.solid_matrices import (
    linear_warnings,
    refuse_inverted,
)
from carrierflex.files.whole_files import file_digest
from carrierflex.geometry.cad_mesh import step_carrier_mesh, step_element_size
from carrierflex.geometry.cad_surface_files import read_cad_statements
from carrierflex.geometry.given_meshes.named_solids import GivenMesh, NamedSolids
from carrierflex.geometry.half_sector import refuse_useless_size
from carrierflex.geometry.mesh_files import read_mesh
from carrierflex.geometry.parameters import DEFAULT_SIZE

#: Units that coordinates of a mesh file may have, in metres.
_METRES = {"m": 1.0, "mm": 1e-3, "inch": 0.0254}


@dataclass(frozen=True)
class CarrierFiles:
    """Files that a user gives a carrier by; none of them means the parametric carrier.

    Raises
    ------
    ValueError
        Where the STEP file, the surfaces file or the unit stands alone, or meshes are given beside
        a STEP file.
    """

    step: Annotated[Path | None, "CAD model"] = None
    surfaces: Annotated[Path | None, "File that states its surfaces"] = None
    meshes: Annotated[Mapping[str, Path], "Mesh file by variant, ``stiff`` and ``flexible``"] = (
        field(default_factory=dict)
    )
    length_unit: Annotated[str, "Unit of the mesh files' coordinates"] = "m"

    def __post_init__(self) -> None:
        if self.step is not None and self.surfaces is None:
            raise ValueError(
                "--step is given without --surfaces; expected the CAD model and the file that "
                "states its surfaces"
            )
        if self.surfaces is not None and self.step is None and not self.meshes:
            raise ValueError(
                "--surfaces is given without --step; expected the CAD model or a mesh file with "
                "the file that states its surfaces"
            )
        if self.length_unit != "m" and not self.meshes:
            raise ValueError(
                f"--length-unit is {self.length_unit} without a mesh file; expected a mesh file "
                "with it (a STEP file's unit is stated as [frame] length_unit of the surfaces file)"
            )
        if self.meshes and self.step is not None:
            raise ValueError("a mesh file and --step are both given; expected one of them")

    @classmethod
    def recorded(cls, record: Mapping[str, Mapping[str, str]]) -> "CarrierFiles":
        """The files of an earlier :meth:`record`, unchanged since.

        Raises
        ------
        FileNotFoundError, ValueError
            Where a file is absent, or is no longer the one that was recorded.
        """
        paths = {role: Path(entry["file"]) for role, entry in record.items()}
        step, surfaces = paths.pop("step", None), paths.pop("surfaces", None)
        units = {entry.get("length_unit", "m") for entry in record.values()} - {"m"}
        files = cls(step, surfaces, paths, units.pop() if units else "m")
        refuse_changed(record, files.record())
        return files

    @property
    def given(self) -> bool:
        """Whether the carrier comes from files."""
        return self.step is not None or bool(self.meshes)

    def element_size(self, given: float | None) -> float:
        """Element size [m]: the given one, or the default; of a STEP file what its walls ask for.

        Errors as :meth:`mesh`: a preview refuses what the work would.
        """
        if given is not None:
            size = given
        elif self.step is not None and self.surfaces is not None:
            size = step_element_size(self.step, read_cad_statements(self.surfaces))
        else:
            size = DEFAULT_SIZE
        refuse_useless_size(size)
        return size

    def mesh(self, variant: str, size: float) -> GivenMesh:
        """Mesh of a variant: read, or made of the STEP file with elements of `size` [m].

        Errors as there.
        """
        if self.step is not None and self.surfaces is not None:
            return step_carrier_mesh(
                self.step, read_cad_statements(self.surfaces), size, pins=variant == "stiff"
            )
        statements = None if self.surfaces is None else read_cad_statements(self.surfaces)
        if statements is not None and statements.frame.length_unit is not None:
            raise ValueError(
                f"{self.surfaces}: [frame] length_unit is {statements.frame.length_unit} together "
                "with a mesh file; expected none, a mesh's unit is stated by --length-unit"
            )
        mesh = read_mesh(
            self.meshes[variant], metres=_METRES[self.length_unit], statements=statements
        )
        if ("pins" in mesh.bodies) != (variant == "stiff"):
            bodies, other = (
                ("a body", "stiff") if "pins" in mesh.bodies else ("no body", "flexible")
            )
            raise ValueError(
                f"{self.meshes[variant]}: has {bodies} 'pins', a {other} carrier; expected the "
                f"{variant} one"
            )
        if isinstance(mesh, NamedSolids):
            refuse_inverted(mesh, str(self.meshes[variant]))
        return mesh

    def materials(self) -> dict[str, Material]:
        """Material of each body: as the surfaces file states it, else the usual one.

        Raises
        ------
        ValueError
            Where a stated value is none of SI units; the message names the file.
        """
        stated = {} if self.surfaces is None else read_cad_statements(self.surfaces).materials
        materials = dict(BODY_MATERIALS)
        for body, values in stated.items():
            try:
                materials[body] = Material(body, *values)
            except ValueError as error:
                raise ValueError(f"{self.surfaces}: [materials.{body}]: {error}") from error
        return materials

    def digests(self) -> dict[str, str]:
        """SHA-256 of every file by its role: the carrier's identity, wherever the files lie.

        With the meshes' unit where that is not the metre.
        """
        digests = {role: entry["sha256"] for role, entry in self.record().items()}
        return digests if self.length_unit == "m" else {**digests, "length_unit": self.length_unit}

    def record(self) -> dict[str, dict[str, str]]:
        """Name and SHA-256 of every file, for provenance; FileNotFoundError where one is absent."""
        files = {"step": self.step, "surfaces": self.surfaces, **self.meshes}
        record = file_record({role: path for role, path in files.items() if path is not None})
        if self.length_unit != "m":
            for role in self.meshes:
                record[role]["length_unit"] = self.length_unit
        return record


def meshes_of_variants(flexible: Path | None, stiff: Path | None) -> dict[str, Path]:
    """Mesh files by variant: of both, or of none.

    Raises
    ------
    ValueError
        Where one is given without the other.
    """
    if (flexible is None) != (stiff is None):
        alone, absent = (
            ("--flexible-mesh", "--stiff-mesh")
            if stiff is None
            else ("--stiff-mesh", "--flexible-mesh")
        )
        raise ValueError(f"{alone} is given without {absent}; expected the meshes of both variants")
    if flexible is None or stiff is None:
        return {}
    return {"flexible": flexible, "stiff": stiff}


def file_record(files: Mapping[str, Path]) -> dict[str, dict[str, str]]:
    """Name and SHA-256 of every file by its role; FileNotFoundError where one is absent."""
    return {role: {"file": str(path), "sha256": _digest(path)} for role, path in files.items()}


def located(
    record: Mapping[str, Mapping[str, str]], body_folder: Path
) -> dict[str, dict[str, str]]:
    """The record of files with those looked up beside a body that are not where they were.

    Parameters
    ----------
    record : mapping
        Name and digest by role, as :func:`file_record` makes it.
    body_folder : Path
        Folder of the body file; relative names hold from there too.

    Raises
    ------
    FileNotFoundError
        Where a file is at neither place.
    """
    entries = {role: dict(entry) for role, entry in record.items()}
    for entry in entries.values():
        path = Path(entry["file"])
        existing = [
            candidate
            for candidate in (path, body_folder / path, body_folder / path.name)
            if candidate.is_file()
        ]
        if not existing:
            raise FileNotFoundError(
                f"{path}: no such file, nor {path.name} in the folder of the body file; expected "
                "the file that the body was made of, at its path or in the folder of the body"
            )
        entry["file"] = str(existing[0])
    return entries


def refuse_changed(
    record: Mapping[str, Mapping[str, str]], now: Mapping[str, Mapping[str, str]]
) -> None:
    """Refuse files that are no longer those that were recorded.

    Raises
    ------
    ValueError
        Where a digest differs; the message names the file.
    """
    for role, entry in now.items():
        if role not in record or entry["sha256"] != record[role]["sha256"]:
            raise ValueError(
                f"{entry['file']}: changed since the body was made of it; expected the same file"
            )


def _digest(path: Path) -> str:
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such file")
    return file_digest(path)


def mesh_warnings(mesh: GivenMesh) -> tuple[str, ...]:
    """What is to be told of a mesh that can be computed with: entries left out, linear elements."""
    return (*mesh.left_out, *linear_warnings(mesh)) if isinstance(mesh, NamedSolids) else ()
