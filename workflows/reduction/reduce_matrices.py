"""Reduce a body from files of another program: matrices, or a mesh of any solids.

A good answer: the certificate is met, and the body of the same model by another format is the same.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

from carrierflex.fe.matrices.given_structure import GivenBody, given_body
from carrierflex.fe.matrices.interface_files import read_interfaces
from carrierflex.fe.matrices.matrix_files import SUFFIXES as MATRIX_SUFFIXES
from carrierflex.fe.matrices.node_files import ASSEMBLY, punch_of
from carrierflex.fe.solids.given_solids import solid_body
from carrierflex.files.versions import provenance
from carrierflex.geometry.given_meshes.solid_files import SUFFIXES
from carrierflex.reduction.certificate import FREE_MESH
from carrierflex.reduction.craig_bampton import freedom_record
from carrierflex.reduction.mechanisms import sound_grounding
from carrierflex.reduction.reduced_model import ReducedModel
from carrierflex.workflows.geometry.carrier_files import file_record, refuse_changed
from carrierflex.workflows.progress import Stages
from carrierflex.workflows.reduction.certified_body import (
    REDUCTION_WEIGHTS,
    cached_body,
    write_certified_body,
)

#: Roles of the files, as options name them.
_ROLES = ("stiffness", "mass", "interfaces")


@dataclass(frozen=True)
class MatrixFiles:
    """Files that a user gives a body by."""

    stiffness: Annotated[Path, "Stiffness matrix, or the mesh"]
    mass: Annotated[Path, "Mass matrix, or the mesh"]
    interfaces: Annotated[Path, "File of nodes or materials, of pilots and sensors"]

    @classmethod
    def of_options(
        cls,
        stiffness: Path | None,
        mass: Path | None,
        interfaces: Path | None,
        mesh: Path | None = None,
    ) -> "MatrixFiles | None":
        """The files of the three options, or a mesh and interfaces; None where neither is given.

        Raises
        ------
        ValueError
            Where some are given and others are not.
        """
        if mesh is not None and interfaces is not None and stiffness is None and mass is None:
            return cls(mesh, mesh, interfaces)
        given = dict(zip(_ROLES, (stiffness, mass, interfaces), strict=True))
        absent = [f"--{role}" for role, path in given.items() if path is None]
        if len(absent) == len(_ROLES):
            return None
        if stiffness is None or mass is None or interfaces is None:
            raise ValueError(
                f"{' and '.join(absent)} is missing; expected --stiffness, --mass and --interfaces "
                "together"
            )
        return cls(stiffness, mass, interfaces)

    @classmethod
    def recorded(cls, record: Mapping[str, Mapping[str, str]]) -> "MatrixFiles":
        """The files of an earlier :meth:`record`, unchanged since.

        Raises
        ------
        FileNotFoundError, ValueError
            Where a file is absent, or is no longer the one that was recorded.
        """
        files = cls(*(Path(record[role]["file"]) for role in _ROLES))
        refuse_changed(record, files.record())
        return files

    def body(self) -> GivenBody:
        """Structural model of the files.

        Raises
        ------
        FileNotFoundError, ValueError
            As :func:`carrierflex.fe.matrices.given_structure.given_body` and
            :func:`carrierflex.fe.solids.given_solids.solid_body`, or where a mesh has no materials.
        """
        suffix = self.stiffness.suffix.lower()
        # A file of a suffix that no reader of matrices knows is a mesh, also one that none reads.
        if self.stiffness == self.mass and (suffix in SUFFIXES or suffix not in MATRIX_SUFFIXES):
            document = read_interfaces(self.interfaces)
            if document.materials:
                return solid_body(self.stiffness, document)
        return given_body(self.stiffness, self.mass, self.interfaces)

    def inputs(self, body: GivenBody) -> dict[str, object]:
        """What a body file records of where the body comes from.

        Files, what may be a mistake, and the basis that makes it again; no symmetry is to be looked
        for in the mesh of another program.
        """
        usual = {"interface": "fixed", "residual_vectors": False, FREE_MESH[0]: int(FREE_MESH[1])}
        warnings = {"warnings": body.warnings} if body.warnings else {}
        return {"matrix_files": self.record(), **usual, **warnings}

    def digests(self) -> dict[str, str]:
        """SHA-256 of every file by its role: the body's identity, wherever the files lie."""
        return {role: entry["sha256"] for role, entry in self.record().items()}

    def record(self) -> dict[str, dict[str, str]]:
        """Name and SHA-256 of every file, for provenance; FileNotFoundError where one is absent."""
        nodes = read_interfaces(self.interfaces).nodes
        files = dict(zip(_ROLES, (self.stiffness, self.mass, self.interfaces), strict=True))
        named = () if nodes is None else (("nodes", nodes.file), ("dofs", nodes.dof_file))
        files |= {role: self.interfaces.parent / name for role, name in named if name is not None}
        companions = [self.stiffness.with_suffix(suffix) for suffix in (".dof", ".mapping")]
        companions += [punch_of(path) for path in files.values() if path.suffix.lower() == ASSEMBLY]
        files |= {f"beside {path.suffix}": path for path in companions if path.exists()}
        return file_record(files)


#: Options that belong to meshes of this program, with the value that says nothing.
MESH_OPTIONS: Mapping[str, object] = {
    "body": None,
    "variant": "flexible",
    "coupling": "rbe3",
    "parameters": None,
    "step": None,
    "surfaces": None,
    "mesh": None,
    "assembly": "compiled",
    "symmetry": True,
    "shapes": False,
    "stresses": False,
    "preview": False,
}
_CHOICES = ("interface", "residual_vectors")
_NUMBERS = ("up_to", "modes", "modes_below", "frf_tolerance")


def refuse_mesh_options(options: Mapping[str, Any]) -> None:
    """Refuse options that say how a mesh is made, beside matrices that are given.

    Raises
    ------
    ValueError
        Naming the first of them.
    """
    given = [name for name, nothing in MESH_OPTIONS.items() if options[name] != nothing]
    if given:
        raise ValueError(
            f"--{given[0].replace('_', '-')} is given together with --stiffness; expected "
            "matrices or a mesh: pilots and couplings of matrices are in --interfaces"
        )


def main(
    files: MatrixFiles, options: Mapping[str, Any], out: Path, *, cache: bool, quiet: bool
) -> ReducedModel:
    """Reduce the body of matrix files, certify it and write it.

    Parameters
    ----------
    files
        Stiffness, mass and interfaces.
    options
        How many modes are kept, and which.
    out
        Body file to write.
    cache
        Take a body that was reduced from the same inputs before, and keep a new one.
    quiet
        Show no progress.

    Returns
    -------
    ReducedModel
        The body as written.
    """
    chosen = {name: options[name] for name in (*_CHOICES, *_NUMBERS)}
    inputs = {"kind": "reduced matrices", "files": files.digests(), **chosen}
    compute = partial(_reduce, files, options, out, quiet=quiet)
    return cached_body(out, compute, use=cache, quiet=quiet, inputs=inputs)


def _reduce(files: MatrixFiles, options: Mapping[str, Any], out: Path, *, quiet: bool) -> None:
    stages = Stages(4, quiet, REDUCTION_WEIGHTS, timed_from=1)
    with stages.stage(f"matrices of {files.stiffness}"):
        body = files.body()
        try:
            grounded = sound_grounding(body)
        except (ValueError, ArithmeticError) as error:
            raise ValueError("; ".join((str(error), *body.warnings))) from error
    for warning in body.warnings:
        stages.tell(f"{body.structure.name}: {warning}")

    def record(n_modes: int) -> dict[str, str]:
        """Inputs that make the body again."""
        choices = {name: options[name] for name in _CHOICES} | {"modes": n_modes}
        if options["modes"] not in (None, n_modes):
            choices["modes_asked_for"] = options["modes"]
        return provenance(**{**files.inputs(body), **choices}) | freedom_record(body.structure)

    write_certified_body(body.structure, grounded, options, out, stages=stages, record=record)
