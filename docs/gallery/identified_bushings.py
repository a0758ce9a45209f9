"""Bushings of the housing from its six sensors.

Command: identify, mounting
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import carrierflex as cf
from carrierflex.workflows.identification import identify_parameters

picture = Path(sys.argv[1]) / f"{Path(__file__).stem}.png"

with TemporaryDirectory() as folder:
    out = Path(folder)
    campaign = cf.simulated_campaign("mounting_2011").write(out / "campaign")
    model = "nonlinear_bushing"
    identify_parameters.main(campaign, model=model, out=out / "found", quiet=True)
    picture.write_bytes((out / "found" / "signals.png").read_bytes())
