"""What the digits of the printed tables determine.

Command: papers printed-tables, papers
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from carrierflex.workflows.identification import read_printed_tables

picture = Path(sys.argv[1]) / f"{Path(__file__).stem}.png"

with TemporaryDirectory() as folder:
    out = Path(folder)
    read_printed_tables.main(out=out)
    picture.write_bytes((out / "printed_tables.png").read_bytes())
