"""Peak memory and time of a command over many short runs of many channels.

    python -m benchmarks.many_runs [RUNS] [CHANNELS] [SAMPLES] [COMMAND]

Writes a carrier campaign of RUNS runs with CHANNELS axial sensors and SAMPLES rows a run (500, 64
and 3125: 1e8 values) into a temporary folder, and identifies or diagnoses it through the command
line in a process of its own.
"""

import resource
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from benchmarks.measured import measured
from benchmarks.ratio import MEMORY, TIME, Ratio, at_most
from benchmarks.run import run_alone
from carrierflex.identification.campaign.campaign_files import write_campaign
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign.simulated_campaign import simulated_campaign
from carrierflex.simulation.carrier.case_files import read_case, shipped_case
from carrierflex.simulation.carrier.motion import simulate_run
from carrierflex.workflows.fe.default_curves import default_curves

QUICK = {"runs": 20, "channels": 16, "samples": 1000}

#: What the command line is asked for.
_OPTIONS = {"identify": ["--model", "m2"], "diagnose": []}


def ratios(
    runs: int = 500,
    channels: int = 64,
    samples: int = 3125,
    command: Literal["identify", "diagnose"] = "identify",
) -> Iterator[Ratio]:
    """Memory beside that of the records, and seconds.

    Parameters
    ----------
    runs, channels, samples
        Size of the campaign.
    command
        What is done with it.
    """
    with tempfile.TemporaryDirectory() as folder:
        campaign = Path(folder) / "campaign"
        _write(campaign, runs, channels, samples)
        program = [sys.executable, "-m", "carrierflex.workflows.command_line", command]
        options = [*_OPTIONS[command], "--quiet", "--out", str(Path(folder) / "out")]
        run = measured(
            lambda: subprocess.run(
                [*program, str(campaign), *options], check=True, stdout=subprocess.DEVNULL
            )
        )
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * 1024 / 1e9
    case = f"{command}: {runs} runs of {channels} channels and {samples} samples"
    yield Ratio(case, MEMORY, peak, wanted=at_most(2))
    yield Ratio(case, MEMORY, peak, "the records", runs * samples * (channels + 5) * 8 / 1e9)
    yield Ratio(case, TIME, run.wall)


def _write(folder: Path, n_runs: int, n_channels: int, n_samples: int) -> None:
    """Write runs of the first load case at five torques, each with noise of its own."""
    curves = default_curves()
    case = read_case(shipped_case(), curves["delta_f"])
    first = next(s for s in case.sensors if s.quantity == "axial_displacement")
    angles = 2.0 * np.pi * np.arange(n_channels) / n_channels
    sensors = tuple(
        replace(first, name=f"s{number}", angle=float(angle)) for number, angle in enumerate(angles)
    )
    rng = np.random.default_rng(0)
    records = []
    for level in range(5):
        run = replace(
            case.runs[0],
            name=f"level_{level}",
            condition=f"torque {level}",
            torque=(0.2 + 0.2 * level) * case.runs[0].torque,
            duration=n_samples / case.runs[0].sample_rate,
        )
        response = simulate_run(
            run, sensors, curves["delta_s"], curves["delta_f"], noise_std=0.0, rng=rng
        )
        records.append((run, response))
    rig: dict[str, Any] = {"nominal_torque": 360e3, "sensor_radius": 0.412, "n_planets": 3}
    levels = simulated_campaign("many", sensors, records, rig=rig, noise_std=5e-6)
    runs = tuple(_noisy(levels.runs[number % 5], number, rng) for number in range(n_runs))
    write_campaign(replace(levels, rig=rig, runs=runs), folder, simulated=True)


def _noisy(run: Run, number: int, rng: np.random.Generator) -> Run:
    """Copy of a run under another name, with noise."""
    signals = {
        name: signal + 5e-6 * rng.standard_normal(signal.size)
        for name, signal in run.signals.items()
    }
    return replace(run, name=f"run_{number}", file=f"run_{number}.parquet", signals=signals)


if __name__ == "__main__":
    run_alone(ratios)
