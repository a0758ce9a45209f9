"""Nastran DMIG bulk data: stiffness, mass and damping in text, with what its ten digits cost."""

import io
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from carrierflex.files.pyyeti_modules import bulk
from carrierflex.files.whole_files import whole_file
from carrierflex.reduction.exports.op4_files import FIRST_SPOINT, grid_cards, grid_numbers
from carrierflex.reduction.exports.ordered_body import OrderedBody, comments, header, ordered_body
from carrierflex.reduction.reduced_model import ReducedModel
from carrierflex.reduction.rigid_body_checks import geometric_rigid_modes


def write_dmig(model: ReducedModel, path: Path) -> float:
    """Write matrices KAAX, MAAX and BAAX with the GRID and SPOINT entries they refer to.

    A matrix that is zero, the damping of a body without modes, is not written.

    Parameters
    ----------
    model : ReducedModel
        A single body.
    path : Path
        File to include in the bulk data; ``K2GG = KAAX``, ``M2GG = MAAX``, ``B2GG = BAAX`` in the
        case control.

    Returns
    -------
    float
        Grounding of the stiffness as written: ``max |K R| / max |K|`` with R the six rigid motions
        about the origin, unit translations and rotations. The format keeps ten digits; in double
        precision it is about 1e-16.

    Raises
    ------
    ValueError
        Where the body is an assembly.
    """
    body = ordered_body(model)
    index = coordinate_index(body)
    cards = io.StringIO()
    frames = {
        name: pd.DataFrame(A, index=index, columns=index)
        for name, A in (("KAAX", body.K), ("MAAX", body.M), ("BAAX", body.D))
        # Readers stop at a matrix of no column.
        if A.any()
    }
    bulk.wtdmig(cards, frames)
    R = geometric_rigid_modes(model)[body.rows]
    K = written_matrix(cards.getvalue(), "KAAX", index)
    figure = grounding_of(K, R)
    lines = [
        *header(model),
        f"Grounding, max |K R| / max |K|, as written: {figure:.2e}",
        f"Grounding before writing: {grounding_of(body.K, R):.2e}",
        "Case control: " + ", ".join(f"{name[0]}2GG = {name}" for name in frames),
        *(f"Grid {grid}: pilot {name}" for grid, name in enumerate(body.pilots, start=1)),
        *(
            f"Spoint {FIRST_SPOINT + i}: {label}"
            for i, label in enumerate(body.labels[body.n_pilot_coordinates :])
        ),
    ]
    points = io.StringIO()
    points.write(grid_cards(body.points))
    if body.n_modal:
        bulk.wtspoints(points, np.arange(FIRST_SPOINT, FIRST_SPOINT + body.n_modal))
    text = "\n".join(comments("$", lines)) + "\n" + points.getvalue() + cards.getvalue()
    with whole_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return figure


def coordinate_index(body: OrderedBody) -> pd.MultiIndex:
    """Grid or scalar point and component of every coordinate; scalar points have component 0."""
    pilots = [
        (grid, component + 1)
        for grid, components in zip(grid_numbers(len(body.pilots)), body.components, strict=True)
        for component in components
    ]
    modal = [(FIRST_SPOINT + i, 0) for i in range(body.n_modal)]
    return pd.MultiIndex.from_tuples(pilots + modal, names=["id", "dof"])


def written_matrix(cards: str, name: str, index: pd.MultiIndex) -> NDArray[np.float64]:
    """Matrix as a reader of the cards gets it.

    Columns and rows that are zero are not in the file.
    """
    matrix = bulk.rddmig(io.StringIO(cards))[name.lower()]
    full = matrix.reindex(index=index, columns=index, fill_value=0.0).to_numpy(dtype=np.float64)
    return full


def grounding_of(K: NDArray[np.float64], R: NDArray[np.float64]) -> float:
    """``max |K R| / max |K|``: zero for a free body.

    K of shape (n, n) [N/m], rigid-body modes R of shape (n, 6).
    """
    return float(np.abs(K @ R).max() / np.abs(K).max())
