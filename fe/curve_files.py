"""Deflection curves as CSV.

``deflection_curves.csv`` of the command line and of measurement campaigns.
"""

import csv
import io
import math
import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.deflection_curves import DeflectionCurve, resampled
from carrierflex.files.plain_files import plain_content
from carrierflex.files.shown_values import shown
from carrierflex.files.whole_files import refuse_foreign, whole_file

#: Curve names and the unit load each column's values belong to [N m or N].
UNIT_LOADS = {"delta_s": 1000.0, "delta_f": 1000.0, "g_s": 1.0, "g_f": 1.0}
#: What a rigid pin fit adds to ``delta_f``.
PIN_FIT = "pin_fit"
#: Derivatives of ``delta_f`` and of what a rigid pin fit adds, by a dimension or material constant.
_DERIVATIVE = re.compile(rf"(?:delta_f|{PIN_FIT})/[A-Za-z]\w*")
#: Body, constant and unit of each cause that is of a material; the others are dimensions [m].
MATERIAL_CAUSES = {
    "E": ("carrier", "E", "Pa"),
    "nu": ("carrier", "nu", "1"),
    "pin_E": ("pins", "E", "Pa"),
}
_RADIAL = "_radial"
_MOST_ROWS = 100_000
_MOST_BYTES = 20_000_000
#: Sensor radius of the 2012 paper [m], for files without a radius of their own.
_PAPER_RADIUS = 0.412


def write_curves(path: Path, curves: Mapping[str, DeflectionCurve]) -> None:
    """Write curves side by side.

    Columns: ``theta_deg`` (carrier frame, from pin 1), then by curve the axial displacement [m per
    kN m for delta_s, delta_f and `PIN_FIT`, m per N for g_s and g_f; of a derivative per unit of
    its cause], then the radial ones as ``<name>_radial``.

    Raises
    ------
    ValueError
        Where the curves differ in length.
    OSError
        Where the folder cannot be written.
    """
    lengths = {curve.axial.size for curve in curves.values()}
    if len(lengths) != 1:
        raise ValueError(f"deflection curves have {sorted(lengths)} samples; expected one length")
    angle = next(iter(curves.values())).angle
    columns = {"theta_deg": np.rad2deg(angle)}
    columns |= {name: curve.axial for name, curve in curves.items()}
    columns |= {f"{name}{_RADIAL}": curve.radial for name, curve in curves.items()}
    refuse_foreign(path, "theta_deg")
    with whole_file(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        for row in zip(*columns.values(), strict=True):
            writer.writerow([f"{value:.12g}" for value in row])


def read_curves(path: Path, *, radius: float = _PAPER_RADIUS) -> dict[str, DeflectionCurve]:
    """Read the four curves by name; radial columns that are absent count as zero.

    Parameters
    ----------
    path : Path
        File with the columns of :func:`write_curves`, angles equally spaced over one turn from 0.
    radius : float
        Radius of the material circle [m].

    Raises
    ------
    ValueError
        Where a column is missing or unknown, a value is not a finite number, or the angles are not
        equally spaced.
    """
    columns = _checked_columns(path, UNIT_LOADS)
    return {name: _curve(name, columns, radius) for name in UNIT_LOADS}


def read_derivatives(path: Path, *, radius: float = _PAPER_RADIUS) -> dict[str, DeflectionCurve]:
    """Read `PIN_FIT` and the derivatives by name; nothing of a file that has none.

    Parameters and errors as of :func:`read_curves`, but that the four curves may be missing.
    """
    columns = _checked_columns(path, ())
    names = [name for name in columns if name == PIN_FIT or _DERIVATIVE.fullmatch(name)]
    return {name: _curve(name, columns, radius) for name in names if not name.endswith(_RADIAL)}


def _curve(name: str, columns: Mapping[str, np.ndarray], radius: float) -> DeflectionCurve:
    axial = columns[name]
    radial = columns.get(name + _RADIAL, np.zeros_like(axial))
    unit_load = UNIT_LOADS.get(name, UNIT_LOADS["delta_f"])
    return DeflectionCurve(name, radius, unit_load, axial, radial)


def _checked_columns(path: Path, required: Iterable[str]) -> dict[str, np.ndarray]:
    """Columns of a file over one turn; refused without those that are required."""
    columns = _read_columns(path)
    names = [name.removesuffix(_RADIAL) for name in columns]
    known = {"theta_deg", *UNIT_LOADS, PIN_FIT, *filter(_DERIVATIVE.fullmatch, names)}
    unknown = [column for column, name in zip(columns, names, strict=True) if name not in known]
    missing = [name for name in ("theta_deg", *required) if name not in columns]
    if unknown or missing:
        what = f"unknown column {shown(unknown[0])}" if unknown else f"no column {missing[0]!r}"
        raise ValueError(
            f"{path}: {what}; expected {', '.join(('theta_deg', *UNIT_LOADS))} and, optionally, "
            f"*{_RADIAL}"
        )
    theta = columns["theta_deg"]
    expected = 360.0 * np.arange(theta.size) / theta.size
    if not np.allclose(theta, expected, rtol=0.0, atol=1e-3):
        raise ValueError(
            f"{path}: theta_deg is not one turn in equal steps from 0; expected 0, "
            f"{expected[1]:.4g}, ... deg"
        )
    return columns


def axial_of_fit(
    curves: Mapping[str, DeflectionCurve], w: float, n: int, *, cause: str = ""
) -> NDArray[np.float64]:
    """Axial curve ``delta_f + w d`` at n angles, shape (n,) [m per kN m].

    Parameters
    ----------
    curves : mapping of str to DeflectionCurve
        With `PIN_FIT`.
    w : float
        Share of a rigid pin fit, from 0 to 1.
    n : int
        Angles.
    cause : str
        By which the curve is derived; itself without one.
    """
    suffix = f"/{cause}" if cause else ""
    free, by_fit = (resampled(curves[f"{name}{suffix}"], n) for name in ("delta_f", PIN_FIT))
    return np.asarray(free.axial + w * by_fit.axial)


def causes_of(curves: Iterable[str]) -> tuple[str, ...]:
    """Dimensions and material constants whose derivatives are among some curves."""
    start = f"{PIN_FIT}/"
    return tuple(name.removeprefix(start) for name in curves if name.startswith(start))


def _read_columns(path: Path) -> dict[str, np.ndarray]:
    try:
        text = plain_content(path, "a CSV file of deflection curves", _MOST_BYTES).decode("utf-8")
        header, rows = _parsed(csv.reader(io.StringIO(text, newline="")), path)
    except FileNotFoundError as error:
        raise ValueError(str(error)) from error
    except (csv.Error, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: not a CSV file of deflection curves ({error})") from error
    repeated = [name for name in header if header.count(name) > 1]
    if repeated:
        raise ValueError(
            f"{path}: column {shown(repeated[0])} occurs twice; expected different names"
        )
    if len(rows) < 8:
        raise ValueError(f"{path}: {len(rows)} rows of numbers; expected at least eight angles")
    return dict(zip(header, np.array(rows).T, strict=True))


def _parsed(reader: Iterator[list[str]], path: Path) -> tuple[list[str], list[list[float]]]:
    header = next(reader, [])
    rows = []
    for line, cells in enumerate(reader, start=2):
        if len(cells) != len(header):
            raise ValueError(f"{path}: line {line} has {len(cells)} cells; expected {len(header)}")
        if line > _MOST_ROWS:
            raise ValueError(
                f"{path}: more than {_MOST_ROWS} rows; expected one turn of a deflection curve"
            )
        rows.append([_number(cell, path, line) for cell in cells])
    return header, rows


def _number(cell: str, path: Path, line: int) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ValueError(f"{path}: line {line} holds {shown(cell)}; expected a finite number")
    return value
