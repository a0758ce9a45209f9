"""The groups ``shapes`` and ``stresses`` of a body file."""

import h5py
import numpy as np

from carrierflex.fe.stress_recovery import COMPONENTS
from carrierflex.files.hdf5_datasets import (
    PartError,
    length,
    names,
    number_attribute,
    numbers,
    refuse_other_numbers,
)
from carrierflex.reduction.shapes.body_shapes import BodyShapes
from carrierflex.reduction.shapes.body_stresses import BodyStresses

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
    _fill_boundary(group, shapes)
    group["T"] = shapes.T.astype(np.float32)


def shapes_of(group: h5py.Group, n_coordinates: int) -> BodyShapes:
    """Read shapes of a body with so many coordinates.

    Raises
    ------
    PartError
        Where the group is of a newer version, or its parts are not what they should be.
    """
    _refuse_newer(group, "shapes")
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


def fill_stresses(group: h5py.Group, stresses: BodyStresses) -> None:
    """Write stress rows with single precision: seven digits of a stress."""
    group.attrs.update(
        version=VERSION,
        meaning="corner nodes of the body's boundary [m], triangles, number of the named surface "
        "of each node (-1: none), nodes at re-entrant edges, and S[node, component, coordinate], "
        f"the stress {', '.join(COMPONENTS)} [Pa] for one unit of each coordinate",
    )
    _fill_boundary(group, stresses)
    group["singular"] = stresses.singular
    group["S"] = stresses.S.astype(np.float32)


def stresses_of(group: h5py.Group, n_coordinates: int) -> BodyStresses:
    """Read stress rows of a body with so many coordinates; errors as :func:`shapes_of`."""
    _refuse_newer(group, "stresses")
    n, k = (_rows(group, name) for name in ("points", "triangles"))
    length(group, "surface_names", _MOST_POINTS)
    try:
        return BodyStresses(
            points=numbers(group, "points", (n, 3)),
            triangles=numbers(group, "triangles", (k, 3), "iu").astype(np.int64),
            surface_names=names(group, "surface_names"),
            surface_of=numbers(group, "surface_of", (n,), "iu").astype(np.int64),
            singular=numbers(group, "singular", (n,), "b").astype(bool),
            S=numbers(group, "S", (n, len(COMPONENTS), n_coordinates)),
        )
    except ValueError as error:
        raise PartError(f"stresses: {error}") from error


def refuse_other_fields(group: h5py.Group, n_coordinates: int) -> None:
    """Look at the fields of a group of shapes or stresses, and read none of them.

    Raises
    ------
    PartError
        Where the group is of a newer version, or its fields have another shape.
    """
    name = str(group.name).strip("/")
    _refuse_newer(group, name)
    field, components = ("T", 3) if name == "shapes" else ("S", len(COMPONENTS))
    refuse_other_numbers(group, field, (_rows(group, "points"), components, n_coordinates))


def _fill_boundary(group: h5py.Group, boundary: BodyShapes | BodyStresses) -> None:
    group["points"] = boundary.points
    group["triangles"] = boundary.triangles.astype(np.int32)
    group.create_dataset(
        "surface_names", data=list(boundary.surface_names), dtype=h5py.string_dtype()
    )
    group["surface_of"] = boundary.surface_of.astype(np.int32)


def _refuse_newer(group: h5py.Group, name: str) -> None:
    version = int(number_attribute(group, "version"))
    if version > VERSION:
        raise PartError(f"{name} are of version {version}; expected {VERSION}: update carrierflex")


def _rows(group: h5py.Group, name: str) -> int:
    """Rows of a table, looked at before anything of it is read."""
    stored = group.get(name)
    rows = stored.shape[0] if isinstance(stored, h5py.Dataset) and stored.ndim == 2 else 0
    if not 0 < rows <= _MOST_POINTS:
        raise PartError(
            f"{str(group.name).strip('/')}/{name} is no table of 1 to {_MOST_POINTS} rows; "
            f"expected one a {name.removesuffix('s')}"
        )
    return int(rows)
