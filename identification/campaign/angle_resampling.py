"""Records at equal steps of the carrier angle.

What orders and averages over revolutions are computed from.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from carrierflex.identification.campaign.records import Run

#: Fewer samples a revolution cannot show the sixth order.
FEWEST_SAMPLES = 16


def resampled_to_angle(run: Run, samples_per_revolution: int) -> Run:
    """Interpolate a record at equal carrier angles, over its whole revolutions.

    Parameters
    ----------
    run : Run
        Record with the input ``carrier_angle`` [rad], which may turn either way but not back.
    samples_per_revolution : int
        Samples of each revolution of the result.

    Returns
    -------
    Run
        Record of ``n_revolutions * samples_per_revolution`` samples whose angle begins where the
        record begins. Cubic splines over the samples that are there; a point beside a missing
        sample is missing.

    Raises
    ------
    ValueError
        Where too few samples are asked for, the carrier stands still or turns back, or does not
        turn once.
    """
    if samples_per_revolution < FEWEST_SAMPLES:
        raise ValueError(
            f"run {run.name}: {samples_per_revolution} samples a revolution; expected at least "
            f"{FEWEST_SAMPLES}"
        )
    angle = run.inputs["carrier_angle"]
    direction = float(np.sign(angle[-1] - angle[0]))
    travel = (angle - angle[0]) * direction
    if not (np.diff(travel) > 0.0).all():
        sample = int(np.argmin(np.diff(travel) > 0.0)) + 1
        raise ValueError(
            f"run {run.name}: the carrier stops or turns back at {run.time[sample]:g} s; "
            "expected an angle that keeps turning, cut the record there"
        )
    n_revolutions = int(np.floor(travel[-1] / (2.0 * np.pi) + 1e-9)) if travel.size else 0
    if n_revolutions < 1:
        raise ValueError(
            f"run {run.name}: the carrier turns by {travel[-1] / (2.0 * np.pi):.3f} revolutions; "
            "expected at least one"
        )
    grid = 2.0 * np.pi * np.arange(n_revolutions * samples_per_revolution) / samples_per_revolution
    inputs = {name: _interpolated(travel, values, grid) for name, values in run.inputs.items()}
    return replace(
        run,
        time=_interpolated(travel, run.time, grid),
        inputs={**inputs, "carrier_angle": angle[0] + direction * grid},
        signals={name: _interpolated(travel, values, grid) for name, values in run.signals.items()},
        predictions={
            name: _interpolated(travel, values, grid) for name, values in run.predictions.items()
        },
    )


def _interpolated(
    travel: NDArray[np.float64], values: NDArray[np.float64], grid: NDArray[np.float64]
) -> NDArray[np.float64]:
    present = np.isfinite(values)
    if present.sum() < 4:
        return np.full(grid.size, np.nan)
    result = np.asarray(CubicSpline(travel[present], values[present])(grid), dtype=np.float64)
    if present.all():
        return result
    after = np.clip(np.searchsorted(travel, grid), 1, travel.size - 1)
    exact = travel[after - 1] == grid
    missing = ~present[after] & ~exact | ~present[after - 1]
    return np.where(missing, np.nan, result)
