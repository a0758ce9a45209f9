"""The project's body file.

One HDF5 file a reduced body, self-describing, versioned, read back defensively.
"""

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import h5py
import numpy as np
from numpy.typing import NDArray

from carrierflex.files.whole_files import whole_file
from carrierflex.reduction.certificate import Certificate, Check
from carrierflex.reduction.ffrf_data import FfrfData
from carrierflex.reduction.interface_mass import effective_interface_mass
from carrierflex.reduction.orthonormal_form import orthonormal_form
from carrierflex.reduction.reduced_model import MassProperties, ReducedModel

T = TypeVar("T")

FORMAT = "carrierflex-body"
VERSION = 1
#: Larger matrices than this are refused before memory is taken for them.
_MOST_COORDINATES = 20_000
_MOST_SENSORS = 100_000
_UNITS = (
    "SI: m, kg, s, N, rad; frame: x downwind along the rotation axis, z up, right-handed, "
    "origin on the upwind face of the upwind plate"
)
_FFRF_PARTS = ("mass", "first_moment", "second_moment", "N", "P", "Q")
_FFRF_MEANING = (
    "inertia invariants about the frame's origin: mass, int rho x, int rho x x^T, N = int rho T, P[a, b] = int rho x_a T_b, "
    "Q = int rho T_a^T T_b for xx yy zz xy yz xz; T is the displacement field of each coordinate"
)

_ORTHONORMAL_MEANING = "q = X p: mass identity, stiffness diag(omega^2) [rad^2/s^2], rigid-body modes first; damping is D"


class BodyFileError(ValueError):
    """A body file is not what it should be.

    The message names the file, what was found and what is expected.
    """


def write_body(model: ReducedModel, path: Path, certificate: Certificate | None = None) -> None:
    """Write a reduced body; an interrupted write leaves the old file or none.

    Parameters
    ----------
    model : ReducedModel
        The body.
    path : Path
        File to write.
    certificate : Certificate, optional
        What was checked of it against the full body.

    Raises
    ------
    OSError
        Where the folder cannot be written.
    """
    with whole_file(path) as temporary, h5py.File(temporary, "w") as file:
        _fill(file, model)
        if certificate is not None:
            _fill_certificate(file.create_group("certificate"), certificate)


def _fill(file: h5py.File, model: ReducedModel) -> None:
    file.attrs.update(format=FORMAT, version=VERSION, name=model.name, units=_UNITS)
    for letter, matrix in (("K", model.K), ("M", model.M), ("D", model.D)):
        file[letter] = matrix
    file["labels"] = list(model.labels)
    pilots = file.create_group("pilots")
    pilots["names"] = list(model.pilots)
    pilots["points"] = np.array([model.pilots[name] for name in model.pilots]).reshape(-1, 3)
    pilots["coordinates"] = np.array(
        [model.pilot_coordinates[name] for name in model.pilots]
    ).reshape(-1, 6)
    sensors = file.create_group("sensors")
    sensors.create_dataset("names", data=list(model.sensor_names), dtype=h5py.string_dtype())
    sensors["rows"] = model.sensor_rows
    mass = file.create_group("mass_properties")
    mass["mass"], mass["centre"], mass["inertia_about_centre"] = (
        model.mass_properties.mass,
        model.mass_properties.centre,
        model.mass_properties.inertia,
    )
    if model.ffrf is not None:
        # One free body: the form that floating-frame codes of the Adams type take, and what each
        # mode carries along.
        orthonormal = orthonormal_form(model)
        group = file.create_group("orthonormal_form")
        group["X"], group["omega"] = orthonormal.X, orthonormal.omega
        group.attrs.update(meaning=_ORTHONORMAL_MEANING, n_rigid=orthonormal.n_rigid)
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


def _read(path: Path, part: Callable[[h5py.File, Path], T]) -> T:
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such file; expected a body file (.h5)")
    try:
        with h5py.File(path, "r") as file:
            _check_header(file, path)
            return part(file, path)
    except BodyFileError:
        raise
    except (OSError, KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
        raise BodyFileError(
            f"{path}: not a complete body file ({_one_line(error)}); expected HDF5 of format {FORMAT}"
        ) from error


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())


def _check_header(file: h5py.File, path: Path) -> None:
    found = file.attrs.get("format")
    if found != FORMAT:
        raise BodyFileError(f"{path}: format is {found!r}; expected {FORMAT!r}")
    version = int(file.attrs["version"])
    if version > VERSION:
        raise BodyFileError(
            f"{path}: written by a newer version (file version {version}, this program reads up to {VERSION}); "
            "expected a file of this version: update carrierflex"
        )


def _model(file: h5py.File, path: Path) -> ReducedModel:
    n, n_sensors = file["labels"].shape[0], file["sensors/names"].shape[0]
    if max(n, file["pilots/names"].shape[0]) > _MOST_COORDINATES or n_sensors > _MOST_SENSORS:
        raise BodyFileError(
            f"{path}: {n} coordinates and {n_sensors} sensors; expected at most {_MOST_COORDINATES} and {_MOST_SENSORS}"
        )
    n_pilots = file["pilots/names"].shape[0]
    names = _strings(file["pilots/names"])
    points = _array(file["pilots/points"], (n_pilots, 3), path)
    coordinates = _array(file["pilots/coordinates"], (n_pilots, 6), path).astype(np.int64)
    if coordinates.size and not (0 <= coordinates.min() and coordinates.max() < n):
        raise BodyFileError(
            f"{path}: a pilot refers to coordinate {coordinates.max()}; expected numbers below {n}"
        )
    if len(set(names)) != len(names):
        raise BodyFileError(
            f"{path}: pilots are named {', '.join(names)}; expected different names"
        )
    mass = file["mass_properties"]
    return ReducedModel(
        name=str(file.attrs["name"]),
        K=_array(file["K"], (n, n), path),
        M=_array(file["M"], (n, n), path),
        D=_array(file["D"], (n, n), path),
        labels=_strings(file["labels"]),
        pilots=dict(zip(names, points, strict=True)),
        pilot_coordinates=dict(zip(names, coordinates, strict=True)),
        sensor_names=_strings(file["sensors/names"]),
        sensor_rows=_array(file["sensors/rows"], (n_sensors, n), path),
        mass_properties=MassProperties(
            float(_array(mass["mass"], (), path)),
            _array(mass["centre"], (3,), path),
            _array(mass["inertia_about_centre"], (3, 3), path),
        ),
        provenance={key: str(value) for key, value in file["provenance"].attrs.items()},
        ffrf=_ffrf(file["ffrf"], n, path) if "ffrf" in file else None,
    )


def _ffrf(group: h5py.Group, n: int, path: Path) -> FfrfData:
    return FfrfData(
        float(_array(group["mass"], (), path)),
        _array(group["first_moment"], (3,), path),
        _array(group["second_moment"], (3, 3), path),
        _array(group["N"], (3, n), path),
        _array(group["P"], (3, 3, n), path),
        _array(group["Q"], (6, n, n), path),
    )


def _certificate(file: h5py.File, path: Path) -> Certificate | None:
    if "certificate" not in file:
        return None
    group = file["certificate"]
    n = group["names"].shape[0]
    if n > _MOST_COORDINATES:
        raise BodyFileError(
            f"{path}: {n} checks in the certificate; expected at most {_MOST_COORDINATES}"
        )
    columns = (
        _strings(group["names"]),
        _strings(group["wanted"]),
        _array(group["reached"], (n,), path),
        _array(group["met"], (n,), path),
    )
    checks = tuple(
        Check(name, wanted, float(reached), bool(met))
        for name, wanted, reached, met in zip(*columns, strict=True)
    )
    return Certificate(float(group.attrs["cut_off_hz"]), checks)


def _strings(dataset: h5py.Dataset) -> tuple[str, ...]:
    return tuple(dataset.asstr()[:]) if dataset.shape[0] else ()


def _array(dataset: h5py.Dataset, shape: tuple[int, ...], path: Path) -> NDArray[np.float64]:
    if dataset.shape != shape:
        raise BodyFileError(f"{path}: {dataset.name} has shape {dataset.shape}; expected {shape}")
    values = dataset[()]
    if not np.isfinite(values).all():
        raise BodyFileError(f"{path}: {dataset.name} holds a value that is not finite")
    return np.asarray(values, dtype=np.float64)
