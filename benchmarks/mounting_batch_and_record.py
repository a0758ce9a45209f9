"""A thousand parameter sets of the nonlinear mounting on two threads; long records into a file.

    python -m benchmarks.mounting_batch_and_record [FOLDER]

FOLDER takes the Parquet files (1 GB each) and is left empty; without it a temporary one does.
"""

import tempfile
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from benchmarks.measured import fastest, measured, peak_gb
from benchmarks.mounting_cases import MODERATE_NONLINEAR
from benchmarks.ratio import MEMORY, TIME, Ratio, at_least, at_most
from benchmarks.run import run_alone
from carrierflex.simulation.mounting.batch import rms_of_sensors, simulate_batch
from carrierflex.simulation.mounting.history_inputs import history_inputs
from carrierflex.simulation.mounting.inputs import MountingInputs
from carrierflex.simulation.mounting.load_history import LoadHistory
from carrierflex.simulation.mounting.parameter_arrays import parameter_array
from carrierflex.simulation.mounting.parameters import INDEX
from carrierflex.simulation.mounting.record_files import marched_pieces, write_record
from carrierflex.simulation.mounting.rig import MountingRig
from carrierflex.simulation.mounting.simulate import simulate
from carrierflex.simulation.mounting.table_3 import TABLE_3

QUICK = {"seconds": 1e4, "n_sets": 100}

RIG = MountingRig()
MODELS = {
    "linear": TABLE_3["linear"],
    "nonlinear": MODERATE_NONLINEAR,
    "hydro-dynamic": {**TABLE_3["hydrodynamic"], "m": 0.0},
}
#: Length of the record [s] that is wanted in ten seconds.
_WANTED_LENGTH = 1e5


def ratios(
    folder: Path | None = None, *, seconds: float = _WANTED_LENGTH, n_sets: int = 1000
) -> Iterator[Ratio]:
    """Time of the records beside the march alone, memory beside a shorter record, and the batch.

    Parameters
    ----------
    folder
        Folder for the records.
    seconds
        Length of the long record [s]; the short one is a tenth of it.
    n_sets
        Parameter sets of the batch.
    """
    with threadpool_limits(1), tempfile.TemporaryDirectory(dir=folder) as temporary:
        path = Path(temporary) / "record.parquet"
        for name, values in MODELS.items():
            _write(path, values, seconds / 10.0)
            short = peak_gb()
            run = measured(partial(_write, path, values, seconds))
            n_samples, size = run.result
            case = f"{seconds:.0e} s of record, {name}"
            wanted = at_most(10) if seconds == _WANTED_LENGTH else None
            note = f"{n_samples} samples, {size:.2f} GB file"
            yield Ratio(case, TIME, run.wall, wanted=wanted, note=note)
            yield Ratio(case, MEMORY, peak_gb(), "a tenth of it", short, at_least(0.8))
        yield _batch(n_sets)


def _batch(n_sets: int) -> Ratio:
    """The 520 s run with many parameter sets, beside the same runs one after another."""
    inputs = history_inputs(LoadHistory(), 40.0, 560.0)
    base = parameter_array(RIG, MODERATE_NONLINEAR)
    sets = np.tile(base, (n_sets, 1))
    rng = np.random.default_rng(3)
    for name in ("K1", "K3", "K5", "C1"):
        sets[:, INDEX[name]] *= rng.uniform(0.8, 1.2, n_sets)
    single_run = fastest(lambda: rms_of_sensors(simulate(RIG, base, inputs)), 5)
    with ThreadPoolExecutor(2) as executor:
        run = measured(
            lambda: list(
                simulate_batch(RIG, sets, inputs, summary=rms_of_sensors, executor=executor)
            )
        )
    case = f"{n_sets} sets of the 520 s run"
    note = f"wanted of 1000 sets: at most 60 s; here {run.wall / n_sets * 1000:.1f} s a thousand"
    return Ratio(case, TIME, run.wall, "one at a time", n_sets * single_run.wall, note=note)


def _write(path: Path, values: Mapping[str, float], seconds: float) -> tuple[int, float]:
    """March a record into a file; its samples and its size [GB]."""
    cycle = _cycle()
    pieces = marched_pieces(
        RIG, parameter_array(RIG, values), _repeated(cycle, seconds), largest_loads=cycle.loads
    )
    n_samples = write_record(pieces, path)
    size = path.stat().st_size / 1e9
    path.unlink()
    return n_samples, size


def _cycle() -> MountingInputs:
    """One cycle of 500 s that begins and ends without load."""
    cycle = history_inputs(LoadHistory(torque_from=420.0, full_speed=400.0), 0.0, 500.0)
    fade = np.clip((500.0 - cycle.time) / 10.0, 0.0, 1.0)
    return MountingInputs(
        cycle.time,
        cycle.torque * fade,
        cycle.speed * fade,
        cycle.carrier_angle,
        cycle.ntl_y * fade,
        cycle.ntl_z * fade,
    )


def _repeated(cycle: MountingInputs, seconds: float) -> Iterator[MountingInputs]:
    """The cycle over and over, as long as asked for."""
    columns = list(cycle.columns().values())[1:]
    length = cycle.time.size * cycle.step
    for number in range(round(seconds / length)):
        yield MountingInputs(cycle.time - cycle.time[0] + number * length, *columns)


if __name__ == "__main__":
    run_alone(ratios)
