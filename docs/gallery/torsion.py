"""Torque over rotation of shaft, gearbox and mounting.

Command: study torsion, stage
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from carrierflex.workflows.simulation import compute_torsion

picture = Path(sys.argv[1]) / f"{Path(__file__).stem}.png"

with TemporaryDirectory() as folder:
    out = Path(folder)
    compute_torsion.main(out=out, size=0.08, quiet=True)
    picture.write_bytes((out / "torque_sweep.png").read_bytes())
