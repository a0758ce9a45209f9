"""From simply supported to rigid pins.

Command: study pin-fit, carrier
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from carrierflex.workflows.fe import study_pin_fit

picture = Path(sys.argv[1]) / f"{Path(__file__).stem}.png"

with TemporaryDirectory() as folder:
    out = Path(folder)
    study_pin_fit.main(out=out, size=0.08, points_per_decade=2, quiet=True)
    picture.write_bytes((out / "pin_fit.png").read_bytes())
