"""Every dimension of the stage, drawn.

Command: parameters, carrier
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from carrierflex.workflows.geometry import write_parameters

picture = Path(sys.argv[1]) / f"{Path(__file__).stem}.png"

with TemporaryDirectory() as folder:
    out = Path(folder)
    write_parameters.main(out=out / "carrier.toml")
    picture.write_bytes((out / "carrier.png").read_bytes())
