"""Frame, housing angle, carrier angle and pin 1.

Command: simulate, conventions
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

picture = Path(sys.argv[1]) / f"{Path(__file__).stem}.png"
BLUE, ORANGE, GREY = "#0072b2", "#d55e00", "#586069"
arrow = {"arrowstyle": "-|>", "lw": 1.5, "shrinkA": 0, "shrinkB": 0}
figure = Figure(figsize=(7.2, 5.8), layout="constrained")
axes = figure.subplots(subplot_kw={"aspect": "equal", "xlim": (-1.5, 1.8), "ylim": (-1.1, 1.6)})
axes.axis("off")


def e(angle_deg):
    """Unit vectors seen downwind: z is up and y to the left, so that angles turn clockwise."""
    return np.array([np.sin(np.deg2rad(angle_deg)), np.cos(np.deg2rad(angle_deg))])


axes.plot(*e(np.arange(361.0)), color=GREY)
for angle, radius, colour, text in ((35.0, 1.1, ORANGE, "theta"), (137.0, 1.3, BLUE, "v, sensor")):
    axes.plot(*np.array([(0, 0), radius * e(angle)]).T, color=colour, lw=1)
    axes.plot(*(radius * e(np.linspace(0.0, angle - 3.0))), color=colour)
    end, start = radius * e(angle), radius * e(angle - 4.0)
    axes.annotate("", end, start, arrowprops=arrow | {"color": colour})
    axes.text(*((radius + 0.06) * e(0.5 * angle)), text, color=colour)
for k in range(3):
    axes.plot(*(0.68 * e(35.0 + 120.0 * k)), "o", ms=32, mfc="white", mec=GREY)
    axes.text(*(0.68 * e(35.0 + 120.0 * k)), f"pin {k + 1}", ha="center", va="center", fontsize=8)
axes.plot(*e(137.0), "s", ms=9, color=BLUE)
for end, text in (((0.0, 1.5), "z, up"), ((-1.4, 0.0), "y"), ((0.0, 0.0), "⊗ x")):
    axes.annotate("", end, (0, 0), arrowprops=arrow)
    axes.text(end[0] + 0.05, end[1] - 0.13 * (end[1] == 0.0), text)
figure.savefig(picture, dpi=110)
