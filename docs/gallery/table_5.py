"""Aligned and misaligned simulations beside a reference.

Command: papers table-5, stage
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from carrierflex.workflows.simulation import simulate_table_5

picture = Path(sys.argv[1]) / f"{Path(__file__).stem}.png"

with TemporaryDirectory() as folder:
    out = Path(folder)
    simulate_table_5.main(out=out, size=0.08, only=("LC1", "LC2"), quiet=True)
    picture.write_bytes((out / "table_5.png").read_bytes())
