"""What decides the once-a-revolution signal.

Command: study order-one, stage
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from carrierflex.workflows.simulation import study_order_one

picture = Path(sys.argv[1]) / f"{Path(__file__).stem}.png"

with TemporaryDirectory() as folder:
    out = Path(folder)
    study_order_one.main(out=out, size=0.08, quiet=True)
    picture.write_bytes((out / "order_one.png").read_bytes())
