"""A thousand parameter sets of the 520 s nonlinear mounting run on two cores, and 1e5 s of record streamed to a file.

Run as `python benchmarks/mounting_batch_and_record.py FOLDER`; FOLDER takes the Parquet files (1 GB
each) and is left empty. Set OMP_NUM_THREADS and OPENBLAS_NUM_THREADS to 1.
"""

import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from benchmarks.measured import measured, peak_gb, print_ratios
from carrierflex.simulation.mounting.batch import rms_of_sensors, simulate_batch
from carrierflex.simulation.mounting.bushings import (
    HydrodynamicBushing,
    LinearBushing,
    NonlinearBushing,
)
from carrierflex.simulation.mounting.inputs import MountingInputs
from carrierflex.simulation.mounting.load_history import LoadHistory
from carrierflex.simulation.mounting.parameters import INDEX, parameter_array
from carrierflex.simulation.mounting.record_files import marched_pieces, write_record
from carrierflex.simulation.mounting.rig import MountingRig
from carrierflex.simulation.mounting.simulate import simulate

RIG = MountingRig()


def batch():
    inputs = LoadHistory().inputs(40.0, 560.0)
    base = parameter_array(RIG, {**NonlinearBushing().parameters(), "C1": 3e4})
    sets = np.tile(base, (1000, 1))
    rng = np.random.default_rng(3)
    for name in ("K1", "K3", "K5", "C1"):
        sets[:, INDEX[name]] *= rng.uniform(0.8, 1.2, 1000)
    simulate(RIG, base, inputs)
    with ThreadPoolExecutor(2) as executor:
        run = measured(
            lambda: list(
                simulate_batch(RIG, sets, inputs, summary=rms_of_sensors, executor=executor)
            )
        )
    return (
        "1000 sets of the nonlinear 520 s run, two threads",
        "< 60 s",
        f"{run}, {len(run.result)} summaries",
    )


def repeated(cycle, seconds):
    """Pieces of one load history over and over, as long as asked for."""
    columns = list(cycle.columns().values())[1:]
    length = cycle.time.size * cycle.step
    for number in range(round(seconds / length)):
        yield MountingInputs(cycle.time - cycle.time[0] + number * length, *columns)


def record(folder, name, values, seconds):
    # One cycle of 500 s that begins and ends without load.
    cycle = LoadHistory(torque_from=420.0, full_speed=400.0).inputs(0.0, 500.0)
    fade = np.clip((500.0 - cycle.time) / 10.0, 0.0, 1.0)
    cycle = MountingInputs(
        cycle.time,
        cycle.torque * fade,
        cycle.speed * fade,
        cycle.carrier_angle,
        cycle.ntl_y * fade,
        cycle.ntl_z * fade,
    )
    path = folder / "record.parquet"
    pieces = marched_pieces(
        RIG, parameter_array(RIG, values), repeated(cycle, seconds), largest_loads=cycle.loads
    )
    run = measured(lambda: write_record(pieces, path))
    size = path.stat().st_size / 1e9
    path.unlink()
    what = f"{run}, {run.result} samples, {size:.2f} GB file, memory so far {peak_gb():.2f} GB"
    return f"{seconds:.0e} s of record to Parquet, {name}", "< 10 s" if seconds == 1e5 else "", what


def main(folder):
    rows = []
    # Short before long: the memory of the long record shows as a rise.
    for seconds in (1e4, 1e5):
        rows.append(record(folder, "linear", LinearBushing().parameters(), seconds))
        rows.append(
            record(folder, "nonlinear", {**NonlinearBushing().parameters(), "C1": 3e4}, seconds)
        )
        rows.append(
            record(folder, "hydro-dynamic", HydrodynamicBushing(m=0.0).parameters(), seconds)
        )
    rows.append(batch())
    print_ratios(rows)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
