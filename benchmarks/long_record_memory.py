"""Peak memory and time of M2 on a record that does not fit into memory.

    python benchmarks/long_record_memory.py [SAMPLES] [csv|parquet]

Writes a Parquet campaign of SAMPLES rows (default 1e8: eleven days at 100 Hz, four sensors) into a
temporary folder, identifies it through the command line in a process of its own, and prints what
that took. Wanted: under 2 GB.
"""

import json
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv as pa_csv
import pyarrow.parquet as pa_parquet

from carrierflex.identification.campaign.campaign_files import write_campaign
from carrierflex.identification.campaign.simulated_campaign import simulated_campaign
from carrierflex.simulation.carrier.case_files import read_case, shipped_case
from carrierflex.simulation.carrier.motion import simulate_run
from carrierflex.workflows.support.default_curves import default_curves

PIECE_SECONDS = 5000.0


def main() -> None:
    n_samples = int(float(sys.argv[1])) if len(sys.argv) > 1 else 100_000_000
    suffix = sys.argv[2] if len(sys.argv) > 2 else "parquet"
    with tempfile.TemporaryDirectory() as folder:
        campaign = Path(folder) / "campaign"
        truth = _written(campaign, n_samples, suffix)
        size = (campaign / f"LC1.{suffix}").stat().st_size
        start = time.perf_counter()
        command = [
            sys.executable,
            "-m",
            "carrierflex.workflows.command_line",
            "identify",
            str(campaign),
            "--model",
            "m2",
            "--quiet",
        ]
        subprocess.run([*command, "--out", folder + "/out"], check=True, stdout=subprocess.DEVNULL)
        seconds = time.perf_counter() - start
        peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024**2
        shared = json.loads((Path(folder) / "out" / "identification.json").read_text())["shared"]
    print(f"{n_samples:.2g} samples of 9 columns, {size / 1024**3:.2f} GiB of {suffix}")
    print(
        f"peak memory {peak:.2f} GiB (wanted under 2), {seconds:.0f} s, {n_samples / seconds / 1e6:.2f} million samples a second"
    )
    for name in ("phi_PLC", "rho_s", "rho_f"):
        low, high = shared[name]["ci95"]
        print(
            f"{name}: {shared[name]['value']:.6g} in [{low:.6g}, {high:.6g}], truth {getattr(truth, name):.6g}"
        )


def _written(folder: Path, n_samples: int, suffix: str):
    """Write the campaign: a first short record through the contract's writer, then the long one in its place."""
    curves = default_curves()
    case = read_case(shipped_case(), curves["delta_f"])
    sensors = tuple(sensor for sensor in case.sensors if sensor.quantity == "axial_displacement")
    rate = case.runs[0].sample_rate
    run = replace(case.runs[0], duration=min(PIECE_SECONDS, n_samples / rate))
    rng = np.random.default_rng(0)
    response = simulate_run(
        run, sensors, curves["delta_s"], curves["delta_f"], noise_std=0.0, rng=rng
    )
    rig = {"nominal_torque": 360e3, "sensor_radius": 0.412, "n_planets": 3}
    campaign = simulated_campaign("long", sensors, [(run, response)], rig=rig, noise_std=5e-6)
    campaign = replace(
        campaign,
        rig=rig,
        runs=tuple(replace(one, file=f"{one.name}.{suffix}") for one in campaign.runs),
    )
    write_campaign(campaign, folder)
    one = campaign.runs[0]
    _repeated(folder / one.file, {"time": one.time, **one.columns()}, n_samples, rng)
    return run.motion


def _repeated(path: Path, columns, n_samples: int, rng) -> None:
    """Write the record over and over, time and angle running on, each time with noise of its own."""
    length = columns["time"].size
    step, turn = (
        columns["time"][1],
        2.0 * np.pi * np.ceil(columns["carrier_angle"][-1] / 2.0 / np.pi),
    )
    schema = pa.schema([(name, pa.float64()) for name in columns])
    opened = (
        pa_parquet.ParquetWriter(path, schema)
        if path.suffix == ".parquet"
        else pa_csv.CSVWriter(path, schema)
    )
    with opened as writer:
        for k in range(-(-n_samples // length)):
            count = min(length, n_samples - k * length)
            piece = {name: values[:count].copy() for name, values in columns.items()}
            piece["time"] += k * length * step
            piece["carrier_angle"] += k * turn
            for name in piece:
                if name.startswith("s"):
                    piece[name] += 5e-6 * rng.standard_normal(count)
            writer.write_table(pa.table(piece))


if __name__ == "__main__":
    main()
