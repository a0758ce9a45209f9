"""Preview of a reduction of a carrier from STEP, beside what the reduction then takes.

    python -m benchmarks.previews_of_cad_carriers [SIZE ...]

The parametric carrier is written as STEP and reduced whole (a CAD carrier has no symmetry to use),
through the command line, certificate included. No peer: the truth is the clock of the processor.
"""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from benchmarks.ratio import MEMORY, PROCESSOR_TIME, Quantity, Ratio, at_most
from benchmarks.run import run_alone

QUICK = {"sizes": (0.1,)}

#: Of the preview from what was measured, relative to that.
ERROR = Quantity("error of the preview")
_PROGRAM = (sys.executable, "-m", "carrierflex.workflows.command_line")


def ratios(sizes: Sequence[float] = (0.08, 0.04, 0.026)) -> Iterator[Ratio]:
    """Processor time and memory of each size, those of its preview, and by how much they differ.

    Parameters
    ----------
    sizes
        Element edge lengths [m]; these make 50 000, 250 000 and 700 000 unknowns.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        subprocess.run([*_PROGRAM, "cad", "--out", name, "--quiet"], check=True)
        for size in sizes:
            yield from _one_size(folder, size)


def _one_size(folder: Path, size: float) -> Iterator[Ratio]:
    body = folder / "carrier.h5"
    files = ["--step", str(folder / "carrier.step"), "--surfaces", str(folder / "surfaces.toml")]
    line = [*_PROGRAM, "reduce", "--body", "carrier", *files, "--size", str(size), "--no-cache"]
    line += ["--out", str(body)]
    said = json.loads(subprocess.check_output([*line, "--preview", "--json"]))["result"]
    with subprocess.Popen([*line, "--quiet"]) as process:
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode not in (0, 1):
        raise RuntimeError(f"the reduction ended with exit code {process.returncode}")
    body.unlink()
    seconds, memory = used.ru_utime + used.ru_stime, used.ru_maxrss * 1024 / 1e9
    case = f"{said['n_dofs']} unknowns previewed, elements of {1e3 * size:.3g} mm"
    for quantity, value, previewed in (
        (PROCESSOR_TIME, seconds, said["seconds"]),
        (MEMORY, memory, said["memory_gb"]),
    ):
        yield Ratio(case, quantity, value, "preview", previewed)
        error = abs(previewed / value - 1.0)
        yield Ratio(f"{case}: {quantity.name}", ERROR, error, wanted=at_most(0.5))


if __name__ == "__main__":
    run_alone(ratios)
