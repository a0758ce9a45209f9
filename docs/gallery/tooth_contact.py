"""Pressure on the teeth with and without misalignment of shaft and carrier.

Command: study gear-life, stage
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from carrierflex.workflows.simulation import estimate_gear_life

picture = Path(sys.argv[1]) / f"{Path(__file__).stem}.png"

with TemporaryDirectory() as folder:
    out = Path(folder)
    estimate_gear_life.main(out=out, size=0.08, quiet=True)
    picture.write_bytes((out / "stage_contact.png").read_bytes())
