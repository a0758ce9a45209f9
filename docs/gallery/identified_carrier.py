"""Parameters of M1 and M2 with their 95 % intervals.

Command: identify, carrier
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import carrierflex as cf
from carrierflex.workflows.identification import identify_parameters

picture = Path(sys.argv[1]) / f"{Path(__file__).stem}.png"

with TemporaryDirectory() as folder:
    out = Path(folder)
    campaign = cf.simulated_campaign("carrier_lc1_to_lc4").write(out / "campaign")
    identify_parameters.main(campaign, model="m2", out=out / "found", per_run=True, quiet=True)
    picture.write_bytes((out / "found" / "parameters.png").read_bytes())
