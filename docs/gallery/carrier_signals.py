"""Six sensors at the rim in load case LC1.

Command: simulate, carrier
"""

import sys
from pathlib import Path

import carrierflex as cf

picture = Path(sys.argv[1]) / f"{Path(__file__).stem}.png"

records = cf.simulated_campaign("carrier_lc1_to_lc4")
figure = records.plot("LC1")
for panel in figure.axes:
    panel.set_xlim(0.0, 6.0)  # two turns
figure.savefig(picture, dpi=110)
