"""Superelements in matrices: Nastran's OP4 or DMIG with grids and scalar points, Simscape's MAT.

A grid's components are a pilot, a scalar point is a modal coordinate. Where the bulk data links the
grids by RBE2 or RBE3, the reference nodes of the links are the pilots in the grids' place.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io
import scipy.sparse as sp
from numpy.typing import NDArray

from carrierflex.fe.matrices.dof_layout import DofLayout
from carrierflex.fe.matrices.given_structure import linked_interface
from carrierflex.fe.matrices.interface_tables import UnitsTable
from carrierflex.fe.matrices.matrix_files import read_matrix
from carrierflex.fe.matrices.nastran_links import linked_pilots
from carrierflex.fe.matrices.node_files import NodeTable, read_nodes
from carrierflex.fe.matrices.numbered_model import NumberedModel, numbered_model
from carrierflex.fe.matrices.rigid_freedom import free_motions
from carrierflex.fe.matrices.stored_matrix import StoredMatrix
from carrierflex.files.child_process import in_child, limited
from carrierflex.files.plain_files import check_plain_file, plain_content
from carrierflex.reduction.imports.imported_body import (
    MOST_COORDINATES,
    ImportedBody,
    origin_of,
    pilot_labels,
)
from carrierflex.reduction.imports.pilot_form import pilot_form
from carrierflex.reduction.reduced_model import (
    FREE_MOTIONS,
    MassProperties,
    ReducedModel,
)
from carrierflex.reduction.rigid_body_checks import geometric_rigid_modes, mass_properties_from

#: Lines in which this program names what the numbers of grids and scalar points are.
_NAMED = re.compile(r"^\$ (Grid|Spoint) (\d{1,12}): (?:pilot )?(.+?)\s*$", re.MULTILINE)
_TITLE = re.compile(r"^\$ Reduced body (.{1,200}?), Craig-Bampton, written by carrierflex", re.M)
_MOST_BYTES = 4_000_000_000
#: Beside .op4 and .OP4: grids, and the order of the rows.
_PARTNERS = (".asm", ".pch"), (".ASM", ".PCH")
_NO_INVARIANTS = (
    "matrices alone hold no inertia invariants: mbdyn and sid cannot be written of them"
)
_NO_MASS = MassProperties(0.0, np.zeros(3), np.zeros((3, 3)))
_SIX = 6


@dataclass(frozen=True, eq=False)
class _Matrices:
    """Stiffness, mass and damping, dense, of named degrees of freedom."""

    K: NDArray[np.float64]
    M: NDArray[np.float64]
    D: NDArray[np.float64]
    layout: DofLayout


def partners_of(path: Path) -> tuple[Path, ...]:
    """Files that belong to a .op4: its grids and the order of its rows; none of another file."""
    if path.suffix.lower() != ".op4":
        return ()
    return tuple(map(path.with_suffix, _PARTNERS[path.suffix.isupper()]))


def read_superelement(path: Path) -> ImportedBody:
    """Body of a Nastran superelement.

    Parameters
    ----------
    path : Path
        ``.op4`` with ``.asm`` and ``.pch`` beside it, or DMIG entries with their GRID entries in
        one file. Stiffness, mass and damping are the matrices whose names begin with K, M and B.

    Raises
    ------
    FileNotFoundError, ValueError
        Where a file is missing or damaged, or they make no body; one line that names the file.
    """
    deck, files = path, str(path)
    is_op4 = bool(partners := partners_of(path))
    if partners:
        deck, order = partners
        files = f"{path} with {deck.name} and {order.name}"
    stored = [read_matrix(path, quantity) for quantity in ("stiffness", "mass")]
    if stored[0].A.shape == stored[1].A.shape and not (stored[0].A - stored[1].A).nnz:
        raise ValueError(
            f"{path}: one matrix; expected the stiffness and the mass, whose names begin with K "
            "and M, in one file"
        )
    damping = _damping(path, stored[0])
    nodes = read_nodes(deck)
    words = plain_content(deck, "bulk data", _MOST_BYTES)[:100_000].decode("latin-1")
    try:
        matrices = _matrices(stored[0], stored[1], damping, nodes)
        links = [] if is_op4 else linked_pilots(path, nodes)
        body = _linked(matrices, nodes, links) if links else _by_grids(matrices, _names(words))
    except ValueError as error:
        raise ValueError(f"{files}: {error}") from error
    title = _TITLE.search(words)
    name = title[1] if title and title[1].isprintable() else path.stem
    R = matrices.layout.rigid_modes(np.zeros(3))
    n_free = free_motions(sp.csr_array(matrices.K), R)[0].shape[1]
    return _completed(body, name, path, "op4" if is_op4 else "dmig", n_free)


def read_simscape(path: Path) -> ImportedBody:
    """Body of a MAT file with P, K, M and C, on the top level or in one structure.

    The convention of Simscape Multibody's reduced-order flexible solid: six rows a frame (Tx Ty Tz
    Rx Ry Rz) in the order of P, axes as the body's, then modal coordinates.

    Raises
    ------
    FileNotFoundError, ValueError
        Where there is no such file, it is damaged, or the sizes contradict each other.
    """
    size = check_plain_file(path, "a MAT file with P, K, M and C", _MOST_BYTES)
    content = in_child(_mat_content, path, size, about=path, what="scipy")
    P, K, M, C = (content[name] for name in "PKMC")
    # The partial differential equation toolbox has one column a frame.
    P = P.T if P.shape[0] == 3 != P.shape[1] else P
    n = len(K)
    if P.ndim != 2 or P.shape[1] != 3 or not _SIX * len(P) <= n <= MOST_COORDINATES:
        raise ValueError(
            f"{path}: P of shape {P.shape} with K of {n} rows; expected one row of three a frame, "
            "six rows of K each and modal coordinates"
        )
    if {K.shape, M.shape, C.shape} != {(n, n)}:
        raise ValueError(
            f"{path}: K, M and C of shapes {K.shape}, {M.shape} and {C.shape}; expected one square "
            "shape"
        )
    if not all(np.isfinite(A).all() for A in (P, K, M, C)):
        raise ValueError(f"{path}: a number is not finite; expected finite ones")
    names = content["pilots"] or [f"frame_{i}" for i in range(1, len(P) + 1)]
    if len(names) != len(P) or len(set(names)) < len(names):
        raise ValueError(f"{path}: {len(names)} names of {len(P)} frames; expected different ones")
    n_pilots = _SIX * len(P)
    labels = content["coordinates"]
    if len(labels) != n:
        pilots = [(name, tuple(range(_SIX))) for name in names]
        labels = (*pilot_labels(pilots), *(f"mode {i}" for i in range(1, n - n_pilots + 1)))
    rows = {name: np.arange(_SIX * i, _SIX * (i + 1)) for i, name in enumerate(names)}
    body = _body(K, M, C, tuple(labels), dict(zip(names, P, strict=True)), rows)
    n_free = free_motions(sp.csr_array(K), geometric_rigid_modes(body))[0].shape[1]
    return _completed(body, content["name"] or path.stem, path, "simscape", n_free)


def _mat_content(path: Path, size: int) -> dict[str, Any]:
    try:
        with limited(60 + size // 1_000_000, 1_000_000_000 + 40 * size):
            stored = scipy.io.loadmat(path, simplify_cells=True)
            holders = [stored, *(value for value in stored.values() if isinstance(value, dict))]
            holder = next((each for each in holders if {"P", "K", "M"} <= each.keys()), None)
            if holder is None:
                listed = ", ".join(name for name in stored if not name.startswith("__"))[:200]
                raise ValueError(f"it holds {listed or 'nothing'}; expected P, K, M and C")
            content: dict[str, Any] = {
                name: np.array(holder[name], dtype=np.float64, ndmin=2) for name in "PKM"
            }
            has_damping = "C" in holder
            content["C"] = (
                np.array(holder["C"], dtype=np.float64, ndmin=2)
                if has_damping
                else np.zeros_like(content["K"])
            )
            for key in ("pilots", "coordinates"):
                listed_names = np.atleast_1d(holder.get(key, [])).ravel().tolist()
                texts = [str(text) for text in listed_names]
                content[key] = texts if all(t.isprintable() for t in texts) else []
            name = str(holder.get("name", ""))
            content["name"] = name if name.isprintable() and len(name) < 200 else ""
            return content
    except Exception as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise ValueError(f"{path}: no MAT file of a reduced body ({reason})") from error


def _damping(path: Path, stiffness: StoredMatrix) -> StoredMatrix | None:
    """Damping of a file, None where no matrix's name begins with B."""
    try:
        return read_matrix(path, "damping")
    except ValueError as error:
        if "whose name begins with" not in str(error):
            raise
        return None


def _matrices(
    stiffness: StoredMatrix, mass: StoredMatrix, damping: StoredMatrix | None, nodes: NodeTable
) -> _Matrices:
    units = UnitsTable(length=1.0, force=1.0)

    def numbered(K: StoredMatrix, M: StoredMatrix) -> NumberedModel:
        return numbered_model(K, M, nodes, dofs=None, dofs_per_node=None, units=units)

    model = numbered(stiffness, mass)
    n = len(model.layout)
    if n > MOST_COORDINATES:
        raise ValueError(
            f"{n} degrees of freedom; expected a reduced body of at most {MOST_COORDINATES}: "
            "reduce it by carrierflex reduce --stiffness --mass --interfaces"
        )
    D = np.zeros((n, n))
    if damping is not None and damping.A.nnz:
        other = numbered(damping, mass)
        keys = model.layout.names.keys
        order = np.argsort(keys)
        at = order[np.searchsorted(keys, other.layout.names.keys, sorter=order).clip(max=n - 1)]
        if not np.array_equal(keys[at], other.layout.names.keys):
            raise ValueError("the damping has rows that stiffness and mass have not; expected none")
        D[np.ix_(at, at)] = other.K.toarray()
    return _Matrices(model.K.toarray(), model.M.toarray(), D, model.layout)


def _names(words: str) -> dict[int, str]:
    """What this program's comments call the numbers of grids and scalar points."""
    return {int(number): name for _, number, name in _NAMED.findall(words) if name.isprintable()}


def _by_grids(matrices: _Matrices, names: Mapping[int, str]) -> ReducedModel:
    """Every grid is a pilot; numbers and order of the file stay, pilots first."""
    layout = matrices.layout
    order = np.concatenate([np.flatnonzero(~layout.is_scalar), np.flatnonzero(layout.is_scalar)])
    nodes = layout.names.nodes[order].tolist()
    components = layout.names.components[order].tolist()
    pilots: dict[str, NDArray[np.float64]] = {}
    listed: dict[str, list[tuple[int, int]]] = {}
    labels = []
    for row, (node, component) in enumerate(zip(nodes, components, strict=True)):
        if component < 0:
            labels.append(names.get(node, f"scalar point {node}"))
            continue
        name = names.get(node, f"grid_{node}")
        pilots[name] = layout.points[order[row]]
        listed.setdefault(name, []).append((component, row))
        labels.append(pilot_labels([(name, (component,))])[0])
    rows_of = {name: sorted(rows) for name, rows in listed.items()}
    if not pilots:
        raise ValueError("scalar points alone; expected the matrices of grids, which are pilots")
    K, M, D = (A[np.ix_(order, order)] for A in (matrices.K, matrices.M, matrices.D))
    return _body(
        K,
        M,
        D,
        tuple(labels),
        pilots,
        {name: np.array([row for _, row in rows]) for name, rows in rows_of.items()},
        {
            name: tuple(component for component, _ in rows)
            for name, rows in rows_of.items()
            if len(rows) < _SIX
        },
    )


def _linked(matrices: _Matrices, nodes: NodeTable, links: Sequence[Any]) -> ReducedModel:
    """The reference nodes of RBE2 and RBE3 are pilots; the grids' other motions become modes."""
    model = NumberedModel(sp.csr_array(matrices.K), sp.csr_array(matrices.M), matrices.layout)
    L, coupled = linked_interface(model, nodes, links)
    dense = L.toarray()
    K, M, D = (dense.T @ A @ dense for A in (matrices.K, matrices.M, matrices.D))
    G = np.concatenate([pilot.G.toarray() for pilot in coupled])
    form = pilot_form(K, M, D, G)
    starts = np.cumsum([0, *(len(pilot.components) for pilot in coupled)])
    pilots = {pilot.name: pilot.point for pilot in coupled}
    rows = {
        pilot.name: np.arange(start, start + len(pilot.components))
        for pilot, start in zip(coupled, starts, strict=False)
    }
    components_of = {p.name: p.components for p in coupled if len(p.components) < _SIX}
    labels = (
        *pilot_labels([(pilot.name, pilot.components) for pilot in coupled]),
        *(f"mode {i} ({w / (2.0 * np.pi):.1f} Hz)" for i, w in enumerate(form.omega, start=1)),
    )
    return _body(form.K, form.M, form.D, labels, pilots, rows, components_of)


def _body(
    K: NDArray[np.float64],
    M: NDArray[np.float64],
    D: NDArray[np.float64],
    labels: tuple[str, ...],
    pilots: Mapping[str, NDArray[np.float64]],
    rows: Mapping[str, NDArray[np.int64]],
    components: Mapping[str, tuple[int, ...]] | None = None,
) -> ReducedModel:
    n = len(K)
    return ReducedModel(
        name="body",
        K=K,
        M=M,
        D=D,
        labels=labels,
        pilots=pilots,
        pilot_coordinates=rows,
        sensor_names=(),
        sensor_rows=np.zeros((0, n)),
        mass_properties=_NO_MASS,
        pilot_components=components or {},
    )


def _completed(
    model: ReducedModel, name: str, path: Path, format: str, n_free: int
) -> ImportedBody:
    """The body with its name, its mass by rigid motions, and how many of these are free."""
    R = geometric_rigid_modes(model)
    provenance = origin_of(path.name, format)
    if n_free < _SIX:
        provenance[FREE_MOTIONS] = str(n_free)
    masses = np.einsum("nk,nk->k", R[:, :3], model.M @ R[:, :3])
    if not (masses > 0.0).any():
        raise ValueError(
            f"{path}: no mass moves with the pilots; expected the mass matrix of the body"
        )
    with_mass = replace(
        model,
        name=name,
        mass_properties=mass_properties_from(model, R),
        provenance=provenance,
    )
    return ImportedBody(with_mass, (_NO_INVARIANTS,))
