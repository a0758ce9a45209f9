"""The default carrier's deflection curves, shipped: no one waits for finite elements to identify.

The file is what ``carrierflex curves`` writes for the default parameters and mesh size; a test
computes it again.
"""

from importlib.resources import as_file, files

from carrierflex.fe.curve_files import read_curves
from carrierflex.fe.deflection_curves import DeflectionCurve


def default_curves() -> dict[str, DeflectionCurve]:
    """``delta_s, delta_f`` (1 kN m) and ``g_s, g_f`` (1 N) of the default carrier."""
    with as_file(files("carrierflex.workflows") / "data" / "default_deflection_curves.csv") as path:
        return read_curves(path)
