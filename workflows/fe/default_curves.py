"""The default carrier's deflection curves, shipped: no one waits for finite elements to identify.

The file is what ``carrierflex curves`` writes for the default parameters and mesh size; a test
computes it again.
"""

from collections.abc import Mapping
from dataclasses import replace
from importlib.resources import as_file, files
from pathlib import Path

import numpy as np

from carrierflex.fe.curve_files import read_curves, read_derivatives
from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.files.json_files import read_json

#: File beside curves that holds the error of their mesh.
MESH_ERROR_FILE = "mesh_error.json"
#: Difference of RMS up to which curves are the default carrier's on another mesh.
_SAME_CARRIER = 0.1
#: Error of the largest wave of the curves of pins that give way and of stiff ones: limits of 0.2105
#: for 0.1992 and of 0.0267 for 0.0255 um per kN m (docs/cad.md).
_MESH_ERROR = {"f": 0.057, "s": 0.047}


def default_curves() -> dict[str, DeflectionCurve]:
    """``delta_s, delta_f`` (1 kN m) and ``g_s, g_f`` (1 N) of the default carrier."""
    with as_file(files("carrierflex.workflows") / "data" / "default_deflection_curves.csv") as path:
        curves = read_curves(path)
    return {
        name: replace(curve, mesh_error=_MESH_ERROR[name.partition("_")[2]])
        for name, curve in curves.items()
    }


def with_mesh_error(
    curves: Mapping[str, DeflectionCurve], path: Path
) -> dict[str, DeflectionCurve]:
    """Curves with the error of their mesh, which ``carrierflex curves --mesh-error`` writes.

    Parameters
    ----------
    curves : mapping of str to DeflectionCurve
        Curves of a file.
    path : Path
        ``mesh_error.json`` beside it; the errors are not known where it is absent.

    Raises
    ------
    ValueError
        Where the file is damaged.
    """
    if not path.is_file():
        return dict(curves)
    expected = "the errors that carrierflex curves --mesh-error writes"
    document = read_json(path, expected)
    largest: dict[str, tuple[float, float]] = {}
    try:
        for one in document["errors"]:
            pair = float(one["amplitude"]), float(one["error"])
            largest[one["curve"]] = max(pair, largest.get(one["curve"], pair))
        shares = {name: error / amplitude for name, (amplitude, error) in largest.items()}
        if not np.isfinite([*shares.values()]).all() or min(shares.values(), default=0.0) < 0.0:
            raise ValueError(f"errors over amplitudes are {shares}")
    except (LookupError, TypeError, ValueError, ArithmeticError) as error:
        raise ValueError(f"{path}: 'errors': {error}; expected {expected}") from error
    return {
        name: replace(curve, mesh_error=shares.get(name, 0.0)) for name, curve in curves.items()
    }


def with_derivatives(curves: Mapping[str, DeflectionCurve]) -> dict[str, DeflectionCurve]:
    """Curves with what the default carrier's drawing allows: pin fit, derivatives by its causes.

    Parameters
    ----------
    curves : mapping of str to DeflectionCurve
        Curves of the default carrier, by any mesh.

    Raises
    ------
    ValueError
        Where they are not those of the default carrier.
    """
    nominal, given = default_curves()["delta_f"], curves["delta_f"]
    ratio = given.rms / nominal.rms
    if abs(ratio - 1.0) > _SAME_CARRIER:
        raise ValueError(
            f"[rig.tolerances] needs the derivatives of this carrier: its delta_f is {ratio:.2f} "
            "times that of the default carrier, whose derivatives are known; write the curves with "
            "carrierflex curves --derivatives"
        )
    path_of = files("carrierflex.workflows") / "data" / "default_curve_derivatives.csv"
    with as_file(path_of) as path:
        return {**curves, **read_derivatives(path)}
