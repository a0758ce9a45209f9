"""Peak memory and time of M2 on a record that does not fit into memory.

    python -m benchmarks.long_record_memory [SAMPLES] [SUFFIX]

Writes a campaign of SAMPLES rows (1e8: eleven days at 100 Hz, four sensors) into a temporary
folder and identifies it through the command line in a process of its own.
"""

import json
import resource
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pyarrow as pa
import pyarrow.csv as pa_csv
import pyarrow.parquet as pa_parquet
from numpy.typing import NDArray

from benchmarks.measured import measured
from benchmarks.ratio import MEMORY, Quantity, Ratio, at_most
from benchmarks.run import run_alone
from carrierflex.identification.campaign.campaign_files import write_campaign
from carrierflex.identification.campaign.simulated_campaign import simulated_campaign
from carrierflex.simulation.carrier.case_files import read_case, shipped_case
from carrierflex.simulation.carrier.motion import simulate_run
from carrierflex.simulation.carrier.run_cases import CarrierMotion
from carrierflex.workflows.fe.default_curves import default_curves

QUICK = {"samples": 1.5e6}

_CHUNK_SECONDS = 5000.0
_N_COLUMNS = 9
RATE = Quantity("samples a second", "1/s", larger_is_better=True)
#: Distance to the truth; of three parameters one is beyond 1 in every seventh record.
DEVIATION = Quantity("deviation over half the 95 % interval")


def ratios(samples: float = 1e8, suffix: Literal["parquet", "csv"] = "parquet") -> Iterator[Ratio]:
    """Memory beside that of the record itself, samples a second, and the estimate's deviation.

    Parameters
    ----------
    samples
        Rows of the record.
    suffix
        Format of the record's file.
    """
    with tempfile.TemporaryDirectory() as folder:
        campaign = Path(folder) / "campaign"
        out = Path(folder) / "out"
        truth = _written(campaign, int(samples), suffix)
        size = (campaign / f"LC1.{suffix}").stat().st_size / 1e9
        command = [
            sys.executable,
            "-m",
            "carrierflex.workflows.command_line",
            "identify",
            str(campaign),
        ]
        options = ["--model", "m2", "--quiet", "--out", str(out)]
        run = measured(
            lambda: subprocess.run([*command, *options], check=True, stdout=subprocess.DEVNULL)
        )
        peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * 1024 / 1e9
        shared = json.loads((out / "identification.json").read_text())["shared"]
    case = f"{samples:.2g} samples of {_N_COLUMNS} columns"
    record = samples * _N_COLUMNS * 8 / 1e9
    note = f"{size:.2f} GB of {suffix}"
    yield Ratio(case, MEMORY, peak, wanted=at_most(2), note=note)
    yield Ratio(case, MEMORY, peak, "the record itself", record)
    yield Ratio(case, RATE, samples / run.wall, note=f"{run.wall:.0f} s")
    for name in ("phi_PLC", "rho_s", "rho_f"):
        low, high = shared[name]["ci95"]
        deviation = abs(shared[name]["value"] - getattr(truth, name)) / ((high - low) / 2.0)
        yield Ratio(name, DEVIATION, deviation, "truth")


def _written(folder: Path, n_samples: int, suffix: str) -> CarrierMotion:
    """Write the campaign: a short record by the contract's writer, then the long one over it."""
    curves = default_curves()
    case = read_case(shipped_case(), curves["delta_f"])
    sensors = tuple(s for s in case.sensors if s.quantity == "axial_displacement")
    rate = case.runs[0].sample_rate
    run = replace(case.runs[0], duration=min(_CHUNK_SECONDS, n_samples / rate))
    rng = np.random.default_rng(0)
    response = simulate_run(
        run, sensors, curves["delta_s"], curves["delta_f"], noise_std=0.0, rng=rng
    )
    rig: dict[str, Any] = {"nominal_torque": 360e3, "sensor_radius": 0.412, "n_planets": 3}
    campaign = simulated_campaign("long", sensors, [(run, response)], rig=rig, noise_std=5e-6)
    record = replace(campaign.runs[0], file=f"{campaign.runs[0].name}.{suffix}")
    write_campaign(replace(campaign, rig=rig, runs=(record,)), folder, simulated=True)
    columns = {"time": record.time, **record.columns()}
    _write_repeated(folder / record.file, columns, n_samples, rng)
    return run.motion


def _write_repeated(
    path: Path,
    columns: Mapping[str, NDArray[np.float64]],
    n_samples: int,
    rng: np.random.Generator,
) -> None:
    """Write the record over and over, time and angle running on, the noise new each time."""
    length = columns["time"].size
    step = columns["time"][1]
    turn = 2.0 * np.pi * np.ceil(columns["carrier_angle"][-1] / 2.0 / np.pi)
    schema = pa.schema([(name, pa.float64()) for name in columns])
    writer_type = pa_parquet.ParquetWriter if path.suffix == ".parquet" else pa_csv.CSVWriter
    with writer_type(path, schema) as writer:
        for k in range(-(-n_samples // length)):
            count = min(length, n_samples - k * length)
            chunk = {name: values[:count].copy() for name, values in columns.items()}
            chunk["time"] += k * length * step
            chunk["carrier_angle"] += k * turn
            for name in chunk:
                if name.startswith("s"):
                    chunk[name] += 5e-6 * rng.standard_normal(count)
            writer.write_table(pa.table(chunk))


if __name__ == "__main__":
    run_alone(ratios)
