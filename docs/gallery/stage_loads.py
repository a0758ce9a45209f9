"""Teeth, pins and bearings of the planetary stage in time.

Command: simulate, stage
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from carrierflex.workflows.simulation import simulate_load_case

picture = Path(sys.argv[1]) / f"{Path(__file__).stem}.png"

with TemporaryDirectory() as folder:
    out = Path(folder)
    simulate_load_case.main(Path("stage_lc1"), out=out / "stage", loads=out / "loads", quiet=True)
    picture.write_bytes((out / "loads/LC1_loads.png").read_bytes())
