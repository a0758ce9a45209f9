"""Frame, carrier angle, sensor angle, pin 1, positive torque and positive probe signals.

Command: simulate, conventions
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

picture = Path(sys.argv[1]) / f"{Path(__file__).stem}.png"
figure = Figure(figsize=(10.4, 5.1), layout="constrained")
limits = {"aspect": "equal", "xlim": (-1.5, 2.0), "ylim": (-1.4, 1.65)}
face, side = figure.subplots(1, 2, subplot_kw=limits)
u = np.exp(-1j * np.deg2rad(np.arange(361))) * 1j  # angles: clockwise from z, which is up
face.plot(u.real, u.imag, color="grey")
face.plot(*[[0, 1.1 * u[35].real], [0, 1.1 * u[35].imag]], color="tab:orange", lw=1)
face.plot(u[137].real, u[137].imag, "s", color="tab:blue", ms=10)
side.barh(
    [0, 0, 0.68, -0.68], [0.2, 0.2, 0.8, 0.8], [2, 1.6, 0.2, 0.2], [0, 0.6, 0, 0], fc="silver"
)
side.plot([-0.15, 0.14], [0.92, -1.14], "s", color="tab:blue", ms=10)
for axes, points, colour, text, at in (
    (face, [0, 1.45j], "black", "z, up", 1.55j),
    (face, [0, -1.35], "black", "y", -1.45),
    (face, 1.1 * u[:36], "tab:orange", "theta", 1.21 * u[17]),
    (face, 1.35 * u[:138], "tab:blue", "angle v\nof a sensor", 1.74 * u[75]),
    (face, 1.15 * u[200:251], "tab:green", "positive torque", -0.95 - 1.22j),
    (side, [0, 1.45j], "black", "z, up", 1.55j),
    (side, [0, 1.3], "black", "x, downwind", 1.3 - 0.12j),
    (side, [0.92j, 0.45 + 0.92j], "tab:blue", "axial probe: +", -0.75 + 0.92j),
    (side, [-0.04 - 0.98j, -0.04 - 1.32j], "tab:blue", "radial probe: +", 0.85 - 1.14j),
):
    points, at = np.array(points, complex), complex(at)
    axes.plot(points.real, points.imag, color=colour)
    ends = [(p.real, p.imag) for p in points[-2:]]
    axes.annotate("", ends[1], ends[0], arrowprops={"arrowstyle": "-|>", "color": colour})
    axes.text(at.real, at.imag, text, color=colour, ha="center", va="center")
for pin in (1, 2, 3):
    at = 0.68 * u[120 * pin - 85]
    style = {"boxstyle": "circle", "fc": "white", "ec": "grey"}
    face.text(at.real, at.imag, f"pin {pin}", ha="center", va="center", bbox=style)
for axes, title in ((face, "seen downwind, along +x"), (side, "seen along +y")):
    axes.set_title(title, y=0.97)
    axes.axis("off")
figure.savefig(picture, dpi=110)
