"""The project's body file.

One HDF5 file a reduced body, self-describing, versioned, read back defensively.
"""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TypeVar

import h5py
import numpy as np
from numpy.typing import NDArray

from carrierflex.files.hdf5_datasets import (
    PartError,
    checked_name,
    length,
    names,
    number_attribute,
    numbers,
)
from carrierflex.files.hdf5_trial import skip_trial, try_hdf5
from carrierflex.files.plain_files import check_plain_file
from carrierflex.files.shown_values import shortened, shown
from carrierflex.files.whole_files import whole_file
from carrierflex.reduction.certificate import Certificate, Check
from carrierflex.reduction.ffrf_data import FfrfData
from carrierflex.reduction.interface_mass import effective_interface_mass, has_fixed_interface_modes
from carrierflex.reduction.orthonormal_form import orthonormal_form
from carrierflex.reduction.reduced_model import MassProperties, ReducedModel
from carrierflex.reduction.rigid_body_checks import (
    geometric_rigid_modes,
    grounding,
    rigid_mass_properties,
)
from carrierflex.reduction.shapes.body_shapes import BodyShapes
from carrierflex.reduction.shapes.body_stresses import BodyStresses
from carrierflex.reduction.shapes.shape_parts import (
    fill_shapes,
    fill_stresses,
    refuse_other_fields,
    shapes_of,
    stresses_of,
)

T = TypeVar("T")

FORMAT = "carrierflex-body"
VERSION = 2
#: Version of files without pilots of fewer components than six: earlier programs read them.
_VERSION_OF_SIX = 1
#: Row of a component that a pilot does not have.
_NO_ROW = -1
#: Larger matrices than this are refused before memory is taken for them.
_MOST_COORDINATES = 20_000
_MOST_SENSORS = 100_000
_MOST_FILE_BYTES = 20_000_000_000
_UNITS = (
    "SI: m, kg, s, N, rad; frame: x downwind along the rotation axis, z up, right-handed, "
    "origin on the upwind face of the upwind plate"
)
_FFRF_PARTS = ("mass", "first_moment", "second_moment", "N", "P", "Q")
_FFRF_MEANING = (
    "inertia invariants about the frame's origin: mass, int rho x, int rho x x^T, N = int rho T, "
    "P[a, b] = int rho x_a T_b, Q = int rho T_a^T T_b for xx yy zz xy yz xz; T is the displacement "
    "field of each coordinate"
)

_ORTHONORMAL_MEANING = (
    "q = X p: mass identity, stiffness diag(omega^2) [rad^2/s^2], rigid-body modes first; "
    "damping is D"
)


#: Rounding of sums over finite elements, over the largest entry.
_SYMMETRIC = 1e-8
#: Eigenvalues of matrices scaled to unit diagonal: zero is met to this.
_NOT_NEGATIVE = -1e-6
#: Relative difference between the mass of M and the stated one, as of a wrong unit or another
#: body; the certificate tells smaller ones.
_SAME_MASS = 0.05
#: Force against a rigid motion [m or rad] above which geometry does not tell the rigid motion.
_FREE = 1e-3
#: Matrices up to this size are asked for their eigenvalues: seconds.
_MOST_EIGENVALUES = 3000


class BodyFileError(ValueError):
    """A body file is not what it should be.

    The message names the file, what was found and what is expected.
    """


def write_body(
    model: ReducedModel,
    path: Path,
    certificate: Certificate | None = None,
    shapes: BodyShapes | None = None,
    stresses: BodyStresses | None = None,
) -> None:
    """Write a reduced body; an interrupted write leaves the old file or none.

    Parameters
    ----------
    model : ReducedModel
        The body.
    path : Path
        File to write.
    certificate : Certificate, optional
        What was checked of it against the full body.
    shapes : BodyShapes, optional
        What its coordinates look like.
    stresses : BodyStresses, optional
        Stress on its surface by coordinate.

    Raises
    ------
    OSError
        Where the folder cannot be written.
    """
    with whole_file(path) as temporary, h5py.File(temporary, "w") as file:
        _fill(file, model)
        if certificate is not None:
            _fill_certificate(file.create_group("certificate"), certificate)
        if shapes is not None:
            fill_shapes(file.create_group("shapes"), shapes)
        if stresses is not None:
            fill_stresses(file.create_group("stresses"), stresses)
    skip_trial(path)


def _fill(file: h5py.File, model: ReducedModel) -> None:
    version = VERSION if model.pilot_components else _VERSION_OF_SIX
    file.attrs.update(format=FORMAT, version=version, name=model.name, units=_UNITS)
    for letter, matrix in (("K", model.K), ("M", model.M), ("D", model.D)):
        file[letter] = matrix
    file["labels"] = list(model.labels)
    pilots = file.create_group("pilots")
    pilots["names"] = list(model.pilots)
    pilots["points"] = np.array([model.pilots[name] for name in model.pilots]).reshape(-1, 3)
    coordinates = np.full((len(model.pilots), 6), _NO_ROW)
    for row, name in zip(coordinates, model.pilots, strict=True):
        row[list(model.components_of(name))] = model.rows_of(name)
    pilots["coordinates"] = coordinates
    sensors = file.create_group("sensors")
    sensors.create_dataset("names", data=list(model.sensor_names), dtype=h5py.string_dtype())
    sensors["rows"] = model.sensor_rows
    mass = file.create_group("mass_properties")
    mass["mass"] = model.mass_properties.mass
    mass["centre"] = model.mass_properties.centre
    mass["inertia_about_centre"] = model.mass_properties.inertia
    if model.ffrf is not None:
        # One free body: the form that floating-frame codes of the Adams type take, and what each
        # mode carries along.
        orthonormal = orthonormal_form(model)
        group = file.create_group("orthonormal_form")
        group["X"], group["omega"] = orthonormal.X, orthonormal.omega
        group.attrs.update(meaning=_ORTHONORMAL_MEANING, n_rigid=orthonormal.n_rigid)
        if has_fixed_interface_modes(model):
            file["effective_interface_mass"] = effective_interface_mass(model)
        ffrf = file.create_group("ffrf")
        ffrf.attrs["meaning"] = _FFRF_MEANING
        for name in _FFRF_PARTS:
            ffrf[name] = getattr(model.ffrf, name)
    file.create_group("provenance").attrs.update(model.provenance)


def _fill_certificate(group: h5py.Group, certificate: Certificate) -> None:
    group.attrs["cut_off_hz"] = certificate.cut_off_hz
    group["names"] = [check.name for check in certificate.checks]
    group["wanted"] = [check.wanted for check in certificate.checks]
    group["reached"] = np.array([check.reached for check in certificate.checks])
    group["met"] = np.array([check.met for check in certificate.checks])


def read_body(path: Path) -> ReducedModel:
    """Read a reduced body.

    Raises
    ------
    FileNotFoundError
        Where there is no such file.
    BodyFileError
        Where the file is not HDF5, not a body file, of a newer version, truncated or inconsistent.
    """
    return _read(path, _model)


def read_certificate(path: Path) -> Certificate | None:
    """Read the certificate that a body file holds, None where it has none.

    Errors as in :func:`read_body`.
    """
    return _read(path, _certificate)


def read_shapes(path: Path) -> BodyShapes | None:
    """Read what the coordinates of a body look like, None where the file does not hold it.

    Errors as in :func:`read_body`.
    """
    return _read(path, _shapes)


def read_stresses(path: Path) -> BodyStresses | None:
    """Read the stress rows of a body, None where the file does not hold them.

    Errors as in :func:`read_body`.
    """
    return _read(path, _stresses)


def has_fields(path: Path, name: str) -> bool:
    """Whether a body file holds its ``shapes`` or its ``stresses``; none of them is read.

    Errors as in :func:`read_body`.
    """

    def stated(file: h5py.File) -> bool:
        if name in file:
            refuse_other_fields(file[name], length(file, "labels", _MOST_COORDINATES))
        return name in file

    return _read(path, stated)


def _read(path: Path, reader: Callable[[h5py.File], T]) -> T:
    check_plain_file(path, "a body file (.h5)", _MOST_FILE_BYTES)
    try:
        try_hdf5(path)
    except ValueError as error:
        raise BodyFileError(str(error)) from error
    try:
        with h5py.File(path, "r") as file:
            _check_header(file, path)
            return reader(file)
    except BodyFileError:
        raise
    except PartError as error:
        raise BodyFileError(f"{path}: {error}") from error
    except (OSError, KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
        raise BodyFileError(
            f"{path}: not a complete body file ({_one_line(error)}); expected HDF5 of format "
            f"{FORMAT}"
        ) from error
    except (RuntimeError, ArithmeticError, MemoryError) as error:
        # HDF5 tells damaged trees and heaps so.
        raise BodyFileError(f"{path}: damaged ({_one_line(error)}); expected HDF5") from error


def _one_line(error: Exception) -> str:
    return shortened(" ".join(str(error).split()), 400)


def _check_header(file: h5py.File, path: Path) -> None:
    file_format = file.attrs.get("format")
    if file_format != FORMAT:
        raise BodyFileError(f"{path}: format is {shown(file_format)}; expected {FORMAT!r}")
    version = int(number_attribute(file, "version"))
    if version > VERSION:
        raise BodyFileError(
            f"{path}: written by a newer version (file version {version}, this program reads up to "
            f"{VERSION}); expected a file of this version: update carrierflex"
        )


def _model(file: h5py.File) -> ReducedModel:
    n = length(file, "labels", _MOST_COORDINATES)
    n_pilots = length(file, "pilots/names", _MOST_COORDINATES)
    n_sensors = length(file, "sensors/names", _MOST_SENSORS)
    pilots = names(file, "pilots/names")
    points = numbers(file, "pilots/points", (n_pilots, 3))
    coordinates = numbers(file, "pilots/coordinates", (n_pilots, 6)).astype(np.int64)
    least = _NO_ROW if number_attribute(file, "version") > _VERSION_OF_SIX else 0
    if coordinates.size and not (least <= coordinates.min() and coordinates.max() < n):
        raise PartError(
            f"a pilot refers to coordinate {coordinates.max()}; expected numbers below {n}"
        )
    if (coordinates == _NO_ROW).all(axis=1).any():
        raise PartError("a pilot has no coordinate; expected one at least")
    components = {
        name: tuple(np.flatnonzero(row != _NO_ROW).tolist())
        for name, row in zip(pilots, coordinates, strict=True)
        if (row == _NO_ROW).any()
    }
    if len(set(pilots)) != len(pilots):
        raise PartError(f"pilots are named {shown(', '.join(pilots))}; expected different names")
    model = ReducedModel(
        name=checked_name(str(file.attrs["name"]), "attribute name"),
        K=numbers(file, "K", (n, n)),
        M=numbers(file, "M", (n, n)),
        D=numbers(file, "D", (n, n)),
        labels=names(file, "labels"),
        pilots=dict(zip(pilots, points, strict=True)),
        pilot_coordinates={
            name: row[row != _NO_ROW] for name, row in zip(pilots, coordinates, strict=True)
        },
        pilot_components=components,
        sensor_names=names(file, "sensors/names"),
        sensor_rows=numbers(file, "sensors/rows", (n_sensors, n)),
        mass_properties=MassProperties(
            float(numbers(file, "mass_properties/mass", ())),
            numbers(file, "mass_properties/centre", (3,)),
            numbers(file, "mass_properties/inertia_about_centre", (3, 3)),
        ),
        provenance={key: str(value) for key, value in file["provenance"].attrs.items()},
        ffrf=_ffrf(file, n) if "ffrf" in file else None,
    )
    _refuse_unsound(model)
    return model


def _ffrf(file: h5py.File, n: int) -> FfrfData:
    return FfrfData(
        float(numbers(file, "ffrf/mass", ())),
        numbers(file, "ffrf/first_moment", (3,)),
        numbers(file, "ffrf/second_moment", (3, 3)),
        numbers(file, "ffrf/N", (3, n)),
        numbers(file, "ffrf/P", (3, 3, n)),
        numbers(file, "ffrf/Q", (6, n, n)),
    )


def _shapes(file: h5py.File) -> BodyShapes | None:
    if "shapes" not in file:
        return None
    return shapes_of(file["shapes"], length(file, "labels", _MOST_COORDINATES))


def _stresses(file: h5py.File) -> BodyStresses | None:
    if "stresses" not in file:
        return None
    return stresses_of(file["stresses"], length(file, "labels", _MOST_COORDINATES))


def _certificate(file: h5py.File) -> Certificate | None:
    if "certificate" not in file:
        return None
    n = length(file, "certificate/names", _MOST_COORDINATES)
    columns = (
        names(file, "certificate/names"),
        names(file, "certificate/wanted"),
        numbers(file, "certificate/reached", (n,)),
        numbers(file, "certificate/met", (n,), "b"),
    )
    checks = tuple(
        Check(name, wanted, float(reached), bool(met))
        for name, wanted, reached, met in zip(*columns, strict=True)
    )
    return Certificate(number_attribute(file["certificate"], "cut_off_hz"), checks)


def _refuse_unsound(model: ReducedModel) -> None:
    """Refuse matrices that no elastic body has."""
    for problem in _problems(model):
        raise PartError(problem)


def _problems(model: ReducedModel) -> Iterator[str]:
    for letter, matrix in (("K", model.K), ("M", model.M), ("D", model.D)):
        largest = np.abs(matrix).max(initial=0.0)
        asymmetry = np.abs(matrix - matrix.T).max(initial=0.0)
        if asymmetry > _SYMMETRIC * largest:
            yield (
                f"{letter} differs from its transpose by {asymmetry:.3g}, its largest entry is "
                f"{largest:.3g}; expected a symmetric matrix"
            )
    mass = model.mass_properties.mass
    if not mass > 0.0:
        yield f"mass_properties/mass is {mass:.6g} kg; expected a positive mass"
    for letter, matrix in (("K", model.K), ("M", model.M)):
        least = _least_eigenvalue(matrix)
        if least < _NOT_NEGATIVE:
            yield (
                f"{letter}, scaled to unit diagonal, has the eigenvalue {least:.3g}; expected none "
                "below zero"
            )
    if model.pilots and (model.K.diagonal() > 0.0).all() and grounding(model) < _FREE:
        R = geometric_rigid_modes(model)
        moved = rigid_mass_properties(R.T @ model.M @ R).mass
        if abs(moved / mass - 1.0) > _SAME_MASS:
            yield (
                f"M moved as a rigid body has the mass {moved:.6g} kg, mass_properties/mass is "
                f"{mass:.6g} kg; expected the same"
            )


def _least_eigenvalue(matrix: NDArray[np.float64]) -> float:
    """Least eigenvalue of a matrix scaled to unit diagonal; of large ones the least sign of it."""
    diagonal = matrix.diagonal()
    if matrix.size == 0:
        return 0.0
    if (diagonal < 0.0).any() or len(matrix) > _MOST_EIGENVALUES:
        return float(np.sign(diagonal).min())
    scale = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    return float(np.linalg.eigvalsh(matrix * np.outer(scale, scale))[0])
