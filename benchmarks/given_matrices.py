"""Reduction of matrices from files against that of our own mesh, both from the files on.

    python -m benchmarks.given_matrices [SIZE] [--form npz|op4] [--library CHOLMOD|MKL]

The peer is the way of our own program: mesh, finite elements and reduction without symmetry. The
other reads the same matrices from files (binary output4 in sparse columns, or npz), the nodes from
a deck, and reduces them; both with either factorisation library.
"""

import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from benchmarks.measured import measured
from benchmarks.ratio import DIFFERENCE, PROCESSOR_TIME, TIME, Absent, Ratio, Row, at_least, at_most
from benchmarks.run import run_alone
from carrierflex.fe import factorisation
from carrierflex.fe.matrices.given_structure import given_body
from carrierflex.fe.structural_model import StructuralModel, with_equal_node_weights
from carrierflex.geometry.mesh_files import write_mesh
from carrierflex.geometry.parameter_files import read_parameters
from carrierflex.geometry.tet_mesh import TetMesh
from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.reduction.mechanisms import sound_grounding
from carrierflex.reduction.reduced_model import ReducedModel
from carrierflex.workflows.fe.bodies import body_structure

QUICK = {"size": 0.06}
#: At most 1.3 times our own mesh's time.
_WANTED = at_least(1.0 / 1.3)
_N_MODES = 20
_PILOT = (
    '[[pilots]]\nname = "{name}"\ntype = "distributing"\nnode_set = "{name}"\npoint = {point}\n'
)
_HEADER = (
    'format = "carrierflex-interfaces"\nversion = 1\nname = "carrier"\n[nodes]\nfile = "m.inp"\n'
)


def ratios(size: float = 0.0178, *, form: str = "npz", library: str = "") -> Iterator[Row]:
    """Time of both ways with either library, and what their bodies differ by.

    Parameters
    ----------
    size
        Element edge length [m].
    form
        ``npz`` or ``op4``.
    library
        ``CHOLMOD`` or ``MKL``; both of them by default.
    """
    libraries = {"CHOLMOD": factorisation._Cholmod}
    if factorisation._mkl_library() is None:
        yield Absent("MKL", "the package mkl is not installed")
    else:
        libraries["MKL"] = factorisation._Pardiso  # type: ignore[assignment]
    _built_carrier(0.1)  # compiles the kernels
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        _write(folder, *_built_carrier(size), form)
        case = f"carrier of {_rows(folder)} unknowns by {form}"
        for name, kind in libraries.items():
            if library not in ("", name):
                continue
            usual = factorisation._factoriser
            factorisation._factoriser = lambda kind=kind: kind  # type: ignore[assignment]
            try:
                ours = measured(lambda: _reduced_own(size))
                given = measured(lambda: _reduced_given(folder, form))
            finally:
                factorisation._factoriser = usual
            peer = f"own mesh, {name}"
            yield Ratio(case, TIME, given.wall, peer, ours.wall, _WANTED)
            yield Ratio(case, PROCESSOR_TIME, given.processor, peer, ours.processor, _WANTED)
            difference = _difference(given.result, ours.result)
            yield Ratio(case, DIFFERENCE, difference, peer, wanted=at_most(1e-8))


def _built_carrier(size: float) -> tuple[TetMesh, StructuralModel]:
    mesh, structure = body_structure("flexible_carrier", read_parameters(None), size)
    return mesh, with_equal_node_weights(structure, mesh)


def _reduced_own(size: float) -> ReducedModel:
    return craig_bampton(_built_carrier(size)[1], _N_MODES).model


def _reduced_given(folder: Path, form: str) -> ReducedModel:
    files = (folder / f"k.{form}", folder / f"m.{form}", folder / "interfaces.toml")
    body = given_body(*files)
    return craig_bampton(body.structure, _N_MODES, body=sound_grounding(body)).model


def _write(folder: Path, mesh: TetMesh, structure: StructuralModel, form: str) -> None:
    write_mesh(mesh, folder / "m.inp")
    pilots = [_PILOT.format(name=p.name, point=p.point.tolist()) for p in structure.pilots]
    (folder / "interfaces.toml").write_text(_HEADER + "".join(pilots), encoding="utf-8")
    for name, A in (("k", structure.K), ("m", structure.M)):
        if form == "npz":
            sp.save_npz(folder / f"{name}.npz", A, compressed=False)
        else:
            _op4_words(name, sp.csc_array(A)).tofile(folder / f"{name}.op4")


def _rows(folder: Path) -> int:
    text = (folder / "m.inp").read_text(encoding="utf-8")
    return 3 * (text.split("*ELEMENT")[0].count("\n") - 2)


def _difference(a: ReducedModel, b: ReducedModel) -> float:
    """Largest relative difference of the pilots' stiffness and of the frequencies."""
    m = 6 * len(b.pilots)
    scale = np.sqrt(np.outer(b.K.diagonal()[:m], b.K.diagonal()[:m]))
    stiffness = float((np.abs(a.K - b.K)[:m, :m] / scale).max())
    return max(stiffness, float(np.abs(a.K.diagonal()[m:] / b.K.diagonal()[m:] - 1.0).max()) / 2.0)


def _op4_words(name: str, A: sp.csc_array) -> NDArray[np.int32]:
    """Binary output4, double precision, sparse columns with row numbers (bigmat)."""
    A.sort_indices()
    n = A.shape[0]
    column = np.repeat(np.arange(n), np.diff(A.indptr))
    row = A.indices.astype(np.int64)
    starts = np.append(True, (np.diff(column) != 0) | (np.diff(row) != 1))
    strings = np.flatnonzero(starts)
    lengths = np.diff(np.append(strings, len(row)))
    per_column = np.bincount(column[strings], minlength=n)
    words = 2 * np.diff(A.indptr) + 2 * per_column
    # A column's record: length, column, 0, words, strings, length; the first is the header's.
    at = 8 + np.append(0, np.cumsum(words + 5))
    out = np.zeros(at[-1] + 7, dtype=np.int32)
    out[:8] = [24, n, -n, 6, 2, *np.frombuffer(f"{name.upper():8s}".encode(), "<i4"), 24]
    out[at[:-1]] = out[at[1:] - 1] = 4 * (words + 3)
    out[at[:-1] + 1], out[at[:-1] + 3] = np.arange(1, n + 1), words
    first = np.searchsorted(column[strings], np.arange(n))
    before = np.append(0, np.cumsum(2 * lengths + 2))
    string_start = at[column[strings]] + 4 + before[:-1] - before[first[column[strings]]]
    out[string_start], out[string_start + 1] = 2 * lengths + 1, row[strings] + 1
    value = np.repeat(string_start + 2 - 2 * strings, lengths) + 2 * np.arange(len(row))
    pairs = A.data.view("<i4").reshape(-1, 2)
    out[value], out[value + 1] = pairs[:, 0], pairs[:, 1]
    out[at[-1] :] = [20, n + 1, 1, 2, 0, 0, 20]
    return out


if __name__ == "__main__":
    run_alone(ratios)
