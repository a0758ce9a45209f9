"""The default carrier's deflection curves, shipped: no one waits for finite elements to identify.

The file is what ``carrierflex curves`` writes for the default parameters and mesh size; a test
computes it again.
"""

from collections.abc import Mapping
from importlib.resources import as_file, files

from carrierflex.fe.curve_files import read_curves, read_derivatives
from carrierflex.fe.deflection_curves import DeflectionCurve

#: Difference of RMS up to which curves are the default carrier's on another mesh.
_SAME_CARRIER = 0.1


def default_curves() -> dict[str, DeflectionCurve]:
    """``delta_s, delta_f`` (1 kN m) and ``g_s, g_f`` (1 N) of the default carrier."""
    with as_file(files("carrierflex.workflows") / "data" / "default_deflection_curves.csv") as path:
        return read_curves(path)


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
