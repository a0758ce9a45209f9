"""Factors between SI and the units of printed tables and of mesh files."""

from typing import Literal

#: Micrometres in a metre: deflections are printed in um.
MICROMETRES = 1e6
#: Units that coordinates of a mesh file may have, in metres.
METRES = {"m": 1.0, "mm": 1e-3, "inch": 0.0254}
LengthUnit = Literal["m", "mm", "inch"]
