"""A page on which the rim turns in space, as a browser shows it.

Command: view, deflection curves
"""

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from carrierflex.workflows.fe import compute_curves
from carrierflex.workflows.view3d import view_file

picture = Path(sys.argv[1]).resolve() / f"{Path(__file__).stem}.png"
browser = "chromium --headless --no-sandbox --hide-scrollbars --window-size=1000,640".split()
webgl = "--use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader".split()

with TemporaryDirectory() as folder:
    out = Path(folder) / "coarse carrier"
    compute_curves.main(out=out, size=0.08, quiet=True)
    page = view_file.main(out, quiet=True).path
    shot = ["--timeout=8000", f"--screenshot={picture}", page.as_uri()]
    subprocess.run([*browser, *webgl, *shot], check=True, capture_output=True)
