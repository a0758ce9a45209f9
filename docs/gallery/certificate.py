"""How much of each limit a reduced carrier uses.

Command: certificate, carrier
"""

import sys
from pathlib import Path

from matplotlib.figure import Figure

import carrierflex as cf

picture = Path(sys.argv[1]) / f"{Path(__file__).stem}.png"

body = cf.reduced_body("carrier", size=0.06, modes=12)
checks = [check for check in body.certificate.checks if check.share_of_limit]
figure = Figure(figsize=(7.2, 4.2), layout="constrained")
axes = figure.subplots()
axes.barh([check.name for check in checks], [100.0 * check.share_of_limit for check in checks])
axes.set(xscale="log", xlabel="used of the limit [%]", xlim=(None, 200.0))
axes.axvline(100.0, color="black", linewidth=1.0)
axes.invert_yaxis()
figure.savefig(picture, dpi=110)
