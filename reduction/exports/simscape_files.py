"""MATLAB data of a reduced-order flexible solid of Simscape Multibody."""

from pathlib import Path

import numpy as np
import scipy.io

from carrierflex.files.whole_files import whole_file
from carrierflex.reduction.exports.ordered_body import FRAME, UNITS, ordered_body
from carrierflex.reduction.reduced_model import ReducedModel


def write_simscape(model: ReducedModel, path: Path) -> None:
    """Write the structure ``body`` with P, K, M, C, and names in words.

    ``P`` (n_pilots, 3) holds the interface frames' origins [m], axes as the body's; ``K``, ``M``,
    ``C`` (n, n) are exactly symmetric, six rows a frame (Tx Ty Tz Rx Ry Rz) in the order of P, then
    the modal coordinates. No frame is held: the six rigid motions remain, as the block expects.

    Parameters
    ----------
    model : ReducedModel
        A single body.
    path : Path
        File of suffix .mat.

    Raises
    ------
    ValueError
        Where the body is an assembly or the suffix is another.
    """
    if path.suffix != ".mat":
        raise ValueError(f"{path}: suffix {path.suffix!r}; expected .mat")
    body = ordered_body(model)
    content = {
        "P": body.points,
        "K": body.K,
        "M": body.M,
        "C": body.D,
        "pilots": np.array(body.pilots, dtype=object),
        "coordinates": np.array(body.labels, dtype=object),
        "name": model.name,
        "units": UNITS,
        "frame": FRAME,
    }
    with whole_file(path) as temporary:
        scipy.io.savemat(temporary, {"body": content}, appendmat=False, oned_as="column")
