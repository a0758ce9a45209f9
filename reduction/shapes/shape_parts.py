"""The group ``shapes`` of a body file."""

import h5py
import numpy as np

from carrierflex.files.hdf5_datasets import PartError, length, names, number_attribute, numbers
from carrierflex.reduction.shapes.body_shapes import BodyShapes

#: Version of the group; a reader refuses newer ones.
VERSION = 1
_MOST_POINTS = 5_000_000
_MEANING = (
    "boundary of the body: corner nodes [m], triangles, number of the named surface of each (-1: "
    "none), and T[node, axis, coordinate], the displacement for one unit of each coordinate"
)


def fill_shapes(group: h5py.Group, shapes: BodyShapes) -> None:
    """Write shapes; fields with single precision, which a picture needs no more than."""
    group.attrs.update(version=VERSION, meaning=_MEANING)
    group["points"] = shapes.points
    group["triangles"] = shapes.triangles.astype(np.int32)
    group.create_dataset(
        "surface_names", data=list(shapes.surface_names), dtype=h5py.string_dtype()
    )
    group["surface_of"] = shapes.surface_of.astype(np.int32)
    group["T"] = shapes.T.astype(np.float32)


def shapes_of(group: h5py.Group, n_coordinates: int) -> BodyShapes:
    """Read shapes of a body with so many coordinates.

    Raises
    ------
    PartError
        Where the group is of a newer version, or its parts are not what they should be.
    """
    version = int(number_attribute(group, "version"))
    if version > VERSION:
        raise PartError(f"shapes are of version {version}; expected {VERSION}: update carrierflex")
    n, k = (_rows(group, name) for name in ("points", "triangles"))
    length(group, "surface_names", _MOST_POINTS)
    try:
        return BodyShapes(
            points=numbers(group, "points", (n, 3)),
            triangles=numbers(group, "triangles", (k, 3), "iu").astype(np.int64),
            surface_names=names(group, "surface_names"),
            surface_of=numbers(group, "surface_of", (k,), "iu").astype(np.int64),
            T=numbers(group, "T", (n, 3, n_coordinates)),
        )
    except ValueError as error:
        raise PartError(f"shapes: {error}") from error


def _rows(group: h5py.Group, name: str) -> int:
    """Rows of a table, looked at before anything of it is read."""
    part = group.get(name)
    rows = part.shape[0] if isinstance(part, h5py.Dataset) and part.ndim == 2 else 0
    if not 0 < rows <= _MOST_POINTS:
        raise PartError(
            f"shapes/{name} is no table of 1 to {_MOST_POINTS} rows; expected one a "
            f"{name.removesuffix('s')}"
        )
    return int(rows)
