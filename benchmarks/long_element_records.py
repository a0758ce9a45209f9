"""Processor time and peak memory of the diagnosis of element records of three lengths.

    python -m benchmarks.long_element_records [SAMPLES ...]

Writes campaigns of a mass on a spring and damper with an extra force under random forces of
four levels, SAMPLES values of the deflection in all, and diagnoses each through the command line in
a process of its own. The last row is the exponent of the time over the samples.
"""

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numba import njit
from numpy.typing import NDArray

from benchmarks.ratio import MEMORY, PROCESSOR_TIME, Quantity, Ratio, at_most
from benchmarks.run import run_alone
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.campaign_files import write_campaign
from carrierflex.identification.campaign.declarations import Baseline, Channel
from carrierflex.identification.campaign.records import Run

QUICK = {"samples": (2e4, 5e4)}

EXPONENT = Quantity("exponent of the time over the samples")

_LEVELS = (1.0, 2.0, 3.0, 4.0)
_STEP, _SUBSTEPS = 5e-3, 8
_MASS, _STIFFNESS, _DAMPING = 2.0, 8.0e3, 12.0
_CUBIC, _NOISE = 1.0e9, 2e-6


@dataclass(frozen=True)
class _Used:
    """Processor time [s] and peak memory [GB] of a process."""

    processor: float
    memory: float


def ratios(samples: Sequence[float] = (5e4, 2e5, 1e6)) -> Iterator[Ratio]:
    """Processor seconds and peak memory by length, and how the time grows.

    Parameters
    ----------
    samples
        Lengths of the records, all runs together.
    """
    times = []
    for length in samples:
        with tempfile.TemporaryDirectory() as folder:
            campaign = Path(folder) / "campaign"
            write_campaign(_campaign(int(length)), campaign, simulated=True)
            used = _diagnosed(campaign, Path(folder) / "out")
        case = f"{length:.2g} samples"
        yield Ratio(case, PROCESSOR_TIME, used.processor, wanted=at_most(60))
        yield Ratio(case, MEMORY, used.memory, wanted=at_most(1.5))
        times.append(used.processor)
    exponent = np.log(times[-1] / times[0]) / np.log(samples[-1] / samples[0])
    case = f"{samples[0]:.2g} to {samples[-1]:.2g} samples"
    yield Ratio(case, EXPONENT, float(exponent), wanted=at_most(1.1))


def _diagnosed(campaign: Path, out: Path) -> _Used:
    """What `carrierflex diagnose` of a campaign takes, in a process of its own."""
    program = [sys.executable, "-m", "carrierflex.workflows.command_line", "diagnose"]
    process = subprocess.Popen([*program, str(campaign), "--quiet", "--out", str(out)])
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise RuntimeError(f"the diagnosis ended with exit code {process.returncode}")
    return _Used(used.ru_utime + used.ru_stime, used.ru_maxrss * 1024 / 1e9)


def _campaign(n_samples: int) -> Campaign:
    """Runs at every level, each with noise."""
    rng = np.random.default_rng(0)
    n = n_samples // len(_LEVELS)
    time = _STEP * np.arange(n, dtype=np.float64)
    runs = []
    for number, level in enumerate(_LEVELS, start=1):
        force = level * _band_noise(n, rng)
        q = _motion(force, _STEP, _SUBSTEPS) + _NOISE * rng.standard_normal(n)
        runs.append(
            Run(
                f"R{number}", f"R{number}.parquet", f"{level:g} N", time, {"force": force}, {"q": q}
            )
        )
    channel = Channel("q", "displacement", "m", noise_std=_NOISE)
    return Campaign(
        "element", "long", Baseline("model"), {"drive": "force"}, (channel,), tuple(runs)
    )


def _band_noise(n: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """Random force of RMS one up to 30 Hz."""
    spectrum = rng.standard_normal(n // 2 + 1) + 1j * rng.standard_normal(n // 2 + 1)
    spectrum[np.fft.rfftfreq(n, _STEP) > 30.0] = 0.0
    force = np.fft.irfft(spectrum, n)
    return np.asarray(force / force.std(), dtype=np.float64)


@njit(cache=True)
def _motion(force: NDArray[np.float64], step: float, substeps: int) -> NDArray[np.float64]:
    """Deflection of the mass by Runge and Kutta's method, the force linear within a step."""
    h = step / substeps
    q, v = 0.0, 0.0
    motion = np.empty(force.size)
    for k in range(force.size):
        motion[k] = q
        slope = (force[min(k + 1, force.size - 1)] - force[k]) / step
        for j in range(substeps):
            t = j * h
            k1q, k1v = v, _acceleration(force[k] + slope * t, q, v)
            middle = force[k] + slope * (t + 0.5 * h)
            k2q, k2v = (
                v + 0.5 * h * k1v,
                _acceleration(middle, q + 0.5 * h * k1q, v + 0.5 * h * k1v),
            )
            k3q, k3v = (
                v + 0.5 * h * k2v,
                _acceleration(middle, q + 0.5 * h * k2q, v + 0.5 * h * k2v),
            )
            k4q, k4v = (
                v + h * k3v,
                _acceleration(force[k] + slope * (t + h), q + h * k3q, v + h * k3v),
            )
            q += h / 6.0 * (k1q + 2.0 * k2q + 2.0 * k3q + k4q)
            v += h / 6.0 * (k1v + 2.0 * k2v + 2.0 * k3v + k4v)
    return motion


@njit(cache=True)
def _acceleration(force: float, q: float, v: float) -> float:
    return (force - _STIFFNESS * q - _DAMPING * v - _CUBIC * q**3) / _MASS


if __name__ == "__main__":
    run_alone(ratios)
