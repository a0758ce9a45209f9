"""Fixed-interface modes of a reduced planet pin.

Command: reduce, pin
"""

import sys
from pathlib import Path

from matplotlib.figure import Figure

import carrierflex as cf

picture = Path(sys.argv[1]) / f"{Path(__file__).stem}.png"

pin = cf.reduced_body("pin", size=0.06, modes=8)
figure = Figure(figsize=(6.4, 3.2), layout="constrained")
axes = figure.subplots()
axes.stem(range(1, len(pin.omega) + 1), pin.omega / 6.283185307179586 / 1e3)
axes.set(xlabel="mode", ylabel="frequency [kHz]", title="pin between rigid ends")
figure.savefig(picture, dpi=110)
