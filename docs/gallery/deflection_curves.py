"""The rim under torque: three peaks without pins, six with bonded pins.

Command: curves, carrier
"""

import sys
from pathlib import Path

import carrierflex as cf

picture = Path(sys.argv[1]) / f"{Path(__file__).stem}.png"

curves = cf.deflection_curves(size=0.06)  # element edge length [m]
curves.plot().savefig(picture, dpi=110)
