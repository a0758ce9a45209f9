"""The gap at every sensor, before and after the named effects.

Command: diagnose, carrier
"""

import sys
from pathlib import Path

import carrierflex as cf
from carrierflex.diagnosis.report.machine_drawing import machine_figure

picture = Path(sys.argv[1]) / f"{Path(__file__).stem}.png"

records = cf.simulated_campaign("carrier_lc1_to_lc4")
answer = cf.diagnosed(records)
print(answer)
figure = machine_figure(records.campaign, answer.result.signals, "m", pattern=1)
figure.savefig(picture, dpi=110)
