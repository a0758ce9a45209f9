"""Valid reduced bodies of other programs, and who reads them."""

from pathlib import Path

from carrierflex.geometry.given_meshes.solid_files import read_solid_mesh
from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.reduction.exports.exudyn_files import write_exudyn
from carrierflex.reduction.exports.op4_files import write_op4
from carrierflex.reduction.exports.simscape_files import write_simscape
from carrierflex.reduction.imports.foreign_bodies import read_any_body
from tests.fe.matrices.ansys_sample import ARCHIVE
from tests.reduction.imports.sid_sample import sample
from tests.reduction.small_bar import bar

_LINKED = """GRID,1,,0.,0.,0.
GRID,2,,0.,1.,0.
GRID,3,,0.,0.,1.
GRID,9,,0.,.3,.3
RBE3,7,,9,123456,1.0,123,1,2
+,3
DMIG,KAAX,0,6,2,0
DMIG,MAAX,0,6,2,0
"""
#: Damaged file, and the file that is read: what stands beside a body is damaged too.
BODY_READERS = {
    "plate.SID_FEM": "plate.SID_FEM",
    "body.hdf5": "body.hdf5",
    "body.mat": "body.mat",
    "body.op4": "body.op4",
    "body.asm": "body.op4",
    "body.pch": "body.op4",
    "linked.bdf": "linked.bdf",
    "model.cdb": "model.cdb",
}
_LINKED_FILES = ("body.op4", "body.asm", "body.pch")


def read(path: Path) -> None:
    """Read a body, or the solids of an archive."""
    (read_solid_mesh if path.suffix == ".cdb" else read_any_body)(path)


def body_contents(folder: Path) -> dict[str, dict[str, bytes]]:
    """Content of every file, and of those that stand beside it, by the file that is damaged."""
    structure = bar((1, 1, 1))
    reduction = craig_bampton(structure, 1)
    write_exudyn(structure, reduction, folder / "body.hdf5")
    write_simscape(reduction.model, folder / "body.mat")
    write_op4(reduction.model, folder / "body.op4")
    (folder / "plate.SID_FEM").write_text(sample())
    (folder / "model.cdb").write_text(ARCHIVE)
    (folder / "linked.bdf").write_text(_LINKED + "".join(_dmig()))
    files = {path.name: path.read_bytes() for path in folder.iterdir()}
    return {
        name: {each: files[each] for each in (_LINKED_FILES if name in _LINKED_FILES else (name,))}
        for name in BODY_READERS
    }


def _dmig():
    """Three nodes on springs to one another and to none, with a mass each."""
    for grid in (1, 2, 3):
        for axis in (1, 2, 3):
            yield f"DMIG,KAAX,{grid},{axis},,{grid},{axis},2.\n"
            yield f"DMIG,MAAX,{grid},{axis},,{grid},{axis},1.\n"
