"""Figure 4 of the 2011 paper: the hydro-dynamic bushing and three laws of bushings.

Command: figures, papers
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from carrierflex.workflows.figures import draw_figures

picture = Path(sys.argv[1]) / f"{Path(__file__).stem}.png"

with TemporaryDirectory() as folder:
    out = Path(folder)
    drawn = draw_figures.main(out=out, only=("2011-4",), quiet=True)
    picture.write_bytes((out / drawn.figures[0].file).read_bytes())
