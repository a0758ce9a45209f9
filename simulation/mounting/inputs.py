"""Measured loads of a run, checked and brought to a uniform time grid once."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

#: Relative deviation of the time steps from their mean below which a grid counts as uniform: time
#: printed with nine digits over a thousand seconds stays far below.
_UNIFORM = 1e-4


@dataclass(frozen=True, eq=False)
class MountingInputs:
    """Inputs of one run; between samples they are linear in time (first-order hold).

    Parameters
    ----------
    time : ndarray, shape (n,)
        Time [s], strictly increasing, at least two samples.
    torque : ndarray, shape (n,)
        Torque on the main shaft about +x [N m].
    speed, carrier_angle : ndarray, shape (n,)
        Speed [rad/s] and angle [rad] of the main shaft; the motion of the housing does not depend
        on them.
    ntl_y, ntl_z : ndarray, shape (n,)
        Radial load at the dynamometer coupling [N].

    Raises
    ------
    ValueError
        Where a length differs, a value is not finite, or time does not increase.
    """

    time: NDArray[np.float64]
    torque: NDArray[np.float64]
    speed: NDArray[np.float64]
    carrier_angle: NDArray[np.float64]
    ntl_y: NDArray[np.float64]
    ntl_z: NDArray[np.float64]

    def __post_init__(self) -> None:
        if self.time.ndim != 1 or self.time.size < 2:
            raise ValueError(
                f"inputs: time has shape {self.time.shape}; "
                "expected at least two samples in one row"
            )
        for name, values in self.columns().items():
            if values.shape != self.time.shape:
                raise ValueError(
                    f"inputs: {name} has shape {values.shape}; expected {self.time.shape} as time"
                )
            if not np.isfinite(values).all():
                sample = int(np.argmin(np.isfinite(values)))
                raise ValueError(
                    f"inputs: {name} is {values[sample]} at time {self.time[sample]:g} s (sample "
                    f"{sample}); expected a finite number"
                )
        if not (np.diff(self.time) > 0.0).all():
            sample = int(np.argmin(np.diff(self.time) > 0.0)) + 1
            raise ValueError(
                f"inputs: time is {self.time[sample]:g} s at sample {sample}, not later than the "
                "one before"
            )

    @classmethod
    def from_columns(
        cls, time: NDArray[np.float64], columns: Mapping[str, NDArray[np.float64]]
    ) -> "MountingInputs":
        """Inputs from a run's columns by name."""
        return cls(
            time,
            *(columns[name] for name in ("torque", "speed", "carrier_angle", "ntl_y", "ntl_z")),
        )

    def columns(self) -> dict[str, NDArray[np.float64]]:
        """Every column by name, time first."""
        return {
            "time": self.time,
            "torque": self.torque,
            "speed": self.speed,
            "carrier_angle": self.carrier_angle,
            "ntl_y": self.ntl_y,
            "ntl_z": self.ntl_z,
        }

    @cached_property
    def step(self) -> float:
        """Sampling interval [s]: the median one where samples are missing or unevenly spaced."""
        return float(
            (self.time[-1] - self.time[0]) / (self.time.size - 1)
            if self.uniform
            else np.median(np.diff(self.time))
        )

    @cached_property
    def uniform(self) -> bool:
        """Whether the samples are evenly spaced."""
        steps = np.diff(self.time)
        return bool(np.abs(steps - steps.mean()).max() <= _UNIFORM * steps.mean())

    @cached_property
    def grid(self) -> NDArray[np.float64]:
        """Evenly spaced time that covers the record [s]: the samples' own where they are even."""
        if self.uniform:
            return self.time
        count = int(np.ceil((self.time[-1] - self.time[0]) / self.step)) + 1
        return self.time[0] + self.step * np.arange(count)

    @cached_property
    def loads(self) -> NDArray[np.float64]:
        """Torque, ntl_y, ntl_z on the even grid, shape (n_grid, 3)."""
        columns = [self.torque, self.ntl_y, self.ntl_z]
        if not self.uniform:
            columns = [np.interp(self.grid, self.time, values) for values in columns]
        return np.ascontiguousarray(np.stack(columns, axis=1))

    def shortened(self, count: int) -> "MountingInputs":
        """Inputs of the first `count` samples."""
        return MountingInputs(*(values[:count] for values in self.columns().values()))

    def refined(self, factor: int) -> "MountingInputs":
        """Inputs on a grid `factor` times finer, on the same straight lines between samples."""
        fine = np.interp(
            np.arange((self.time.size - 1) * factor + 1) / factor,
            np.arange(self.time.size),
            self.time,
        )
        return MountingInputs(
            *(
                fine if name == "time" else np.interp(fine, self.time, values)
                for name, values in self.columns().items()
            )
        )
