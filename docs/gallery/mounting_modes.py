"""Modes, frequency response and Campbell diagram of the housing.

Command: simulate, mounting
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from carrierflex.workflows.simulation import simulate_load_case

picture = Path(sys.argv[1]) / f"{Path(__file__).stem}.png"

with TemporaryDirectory() as folder:
    out = Path(folder)
    case = Path("mounting_2011")
    simulate_load_case.main(case, out=out / "housing", linearised=out / "modes", quiet=True)
    picture.write_bytes(next((out / "modes").glob("*_linearised.png")).read_bytes())
