"""Records of certification length, written piece by piece to Parquet in constant memory."""

from collections.abc import Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from itertools import product
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pa_parquet
from numpy.typing import NDArray

from carrierflex.files.whole_files import whole_file
from carrierflex.simulation.mounting.inputs import MountingInputs
from carrierflex.simulation.mounting.parameter_arrays import ParameterArray
from carrierflex.simulation.mounting.parameters import INDEX
from carrierflex.simulation.mounting.rig import SENSORS, MountingRig
from carrierflex.simulation.mounting.time_integration import (
    DivergedError,
    marched,
    mounting_model,
    state_at_rest,
)

Array = NDArray[np.float64]

#: Signals of one piece with the time of their first sample.
Piece = tuple[MountingInputs, Array]


def marched_pieces(
    rig: MountingRig,
    parameters: ParameterArray,
    pieces: Iterable[MountingInputs],
    *,
    largest_loads: Array,
    step: float | None = None,
) -> Iterator[Piece]:
    """Inputs and zeroed signals of a record that is given in pieces.

    Equal to those of the whole record.

    Parameters
    ----------
    rig : MountingRig
        Geometry and masses.
    parameters : ndarray
        Flat parameter set, without a sensor delay.
    pieces : iterable of MountingInputs
        Consecutive pieces on one even grid; the first holds the zeroing samples.
    largest_loads : ndarray, shape (n, 3)
        Extremes of torque, ntl_y, ntl_z in the whole record (:func:`extreme_loads`): they decide
        the step of nonlinear bushings.
    step : float, optional
        Largest step [s]; chosen from the nonlinear stiffness where not given.

    Yields
    ------
    inputs, signals : MountingInputs, ndarray, shape (n, 6)
        As they come; where the run diverges, the good samples come before the error.

    Raises
    ------
    ValueError
        Where the pieces are not consecutive, loads exceed `largest_loads`, or there is a delay.
    DivergedError
        Where the run leaves the model.
    """
    if parameters[INDEX["delay"]] != 0.0:
        raise ValueError("a sensor delay is not possible piece by piece; expected delay 0")
    gains, zeros = (
        np.array([parameters[INDEX[f"{kind}_{name}"]] for name in SENSORS])
        for kind in ("gain", "zero")
    )
    model = state = last = None
    zero = np.zeros(6)
    for piece in pieces:
        _check_piece(piece, largest_loads, last)
        if model is None or state is None or last is None:
            model = mounting_model(rig, parameters, largest_loads, piece.step, step=step)
            state = state_at_rest(model, piece.loads[0], float(piece.time[0]))
            loads = piece.loads
        else:
            loads = np.concatenate([last.loads[-1:], piece.loads])
        skip = 0 if last is None else 1
        try:
            signals, state = marched(model, state, loads)
        except DivergedError as error:
            good = error.signals[skip:] - zero
            if len(good) >= 2:
                yield piece.shortened(len(good)), good * gains + zeros
            raise
        if last is None:
            zero = signals[: rig.zeroing_samples].mean(axis=0)
        yield piece, (signals[skip:] - zero) * gains + zeros
        last = piece


def extreme_loads(pieces: Iterable[MountingInputs]) -> Array:
    """Corners of the box that holds torque [N m], ntl_y, ntl_z [N] of all pieces, shape (8, 3)."""
    loads = [np.array([piece.loads.min(axis=0), piece.loads.max(axis=0)]) for piece in pieces]
    low, high = np.min(loads, axis=(0, 1)), np.max(loads, axis=(0, 1))
    return np.array(list(product(*zip(low, high, strict=True))))


def _check_piece(piece: MountingInputs, largest_loads: Array, last: MountingInputs | None) -> None:
    limits = np.abs(largest_loads).max(axis=0)
    largest = np.abs(piece.loads).max(axis=0)
    if (largest > limits * (1.0 + 1e-9)).any():
        raise ValueError(
            f"loads from {piece.time[0]:g} s reach {largest} (torque, ntl_y, ntl_z); "
            f"expected at most {limits} as announced"
        )
    if not piece.uniform:
        raise ValueError(
            f"the piece from {piece.time[0]:g} s is not evenly sampled; expected an even grid"
        )
    if last is not None and not np.isclose(piece.time[0] - last.time[-1], last.step, rtol=1e-3):
        raise ValueError(
            f"a piece begins at {piece.time[0]:g} s after one that ended at {last.time[-1]:g} s; "
            "expected one interval between"
        )


def write_record(pieces: Iterable[Piece], path: Path) -> int:
    """Write pieces to a Parquet file with the columns of a campaign run.

    A run that stops keeps what was good.

    Parameters
    ----------
    pieces : iterable
        Result of :func:`marched_pieces`.
    path : Path
        File; it appears when the last piece is written.

    Returns
    -------
    int
        Samples written.

    Raises
    ------
    DivergedError, KeyboardInterrupt
        After the good samples are safe in the file.
    """
    samples = 0
    stopped: BaseException | None = None
    pending: Future[None] | None = None
    with whole_file(path) as temporary, ThreadPoolExecutor(1) as thread:
        # Numbers of a simulation hardly repeat: a dictionary and compression cost time and save
        # nothing.
        writer = pa_parquet.ParquetWriter(
            temporary, _schema(), compression="none", use_dictionary=False
        )
        try:
            for inputs, signals in pieces:
                columns = [*inputs.columns().values(), *signals.T]
                if pending is not None:
                    pending.result()
                # One piece is written while the next one is marched.
                pending = thread.submit(_write_piece, writer, columns)
                samples += len(signals)
        except (DivergedError, KeyboardInterrupt) as error:
            stopped = error
        finally:
            if pending is not None:
                pending.result()
            writer.close()
    if stopped is not None:
        raise stopped
    return samples


def _schema() -> pa.Schema:
    names = ("time", "torque", "speed", "carrier_angle", "ntl_y", "ntl_z", *SENSORS)
    return pa.schema([(name, pa.float64()) for name in names])


def _write_piece(writer: pa_parquet.ParquetWriter, columns: list[Array]) -> None:
    arrays = [pa.array(np.ascontiguousarray(column)) for column in columns]
    writer.write_table(pa.Table.from_arrays(arrays, schema=_schema()))
