"""The library leaves the printing of numbers in the user's process as it was."""

import re
import subprocess
import sys
from pathlib import Path

import carrierflex

PACKAGES = ("files", "geometry", "fe", "reduction", "simulation", "identification", "workflows")


def test_modules_that_use_pyyeti_round_no_printed_number():
    root = Path(carrierflex.__file__).parent
    modules = [
        ".".join(("carrierflex", *path.relative_to(root).with_suffix("").parts))
        for package in PACKAGES
        for path in (root / package).rglob("*.py")
        if re.search(r"pyyeti(_modules)? import", path.read_text(encoding="utf-8"))
    ]
    assert len(modules) > 4
    program = (
        "import importlib, sys, numpy\n"
        "for name in sys.argv[1:]:\n"
        "    importlib.import_module(name)\n"
        "    assert str(numpy.float64(1.0) / 3.0) == '0.3333333333333333', name\n"
    )
    subprocess.run([sys.executable, "-c", program, *modules], check=True)
