"""One measured record: time, inputs and signals of a run."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

#: Column of a run file that holds another simulator's prediction of a channel.
PREDICTION_SUFFIX = "_sim"


@dataclass(frozen=True, eq=False)
class Run:
    """One record.

    Parameters
    ----------
    name, file, condition : str
        Name, file name in the campaign folder, and free text that repeats of one another share.
    time : ndarray, shape (n,)
        Time [s], strictly increasing.
    inputs, signals : mapping of str to ndarray, shape (n,)
        Input columns by name, finite; channels by name, missing samples NaN.
    predictions : mapping of str to ndarray, shape (n,)
        Another simulator's prediction by channel name.

    Raises
    ------
    ValueError
        Where the run is empty, columns differ in length, time does not increase, an input is not
        finite, a signal is infinite, or the carrier angle is wrapped.
    """

    name: str
    file: str
    condition: str
    time: NDArray[np.float64]
    inputs: Mapping[str, NDArray[np.float64]]
    signals: Mapping[str, NDArray[np.float64]]
    predictions: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.time.ndim != 1 or self.time.size == 0:
            raise ValueError(
                f"run {self.name}: column 'time' holds {self.time.size} samples; expected at least one"
            )
        for name, values in self.columns().items():
            if values.shape != self.time.shape:
                raise ValueError(
                    f"run {self.name}: column '{name}' holds {values.size} samples; expected {self.time.size} as 'time'"
                )
        for name, values in {"time": self.time, **self.inputs}.items():
            _refuse(
                ~np.isfinite(values), values, f"run {self.name}: column '{name}'", "a finite number"
            )
        for name, values in {**self.signals, **self.predictions}.items():
            expected = "a finite number, or an empty cell where the sample is missing"
            _refuse(np.isinf(values), values, f"run {self.name}: column '{name}'", expected)
        not_later = np.concatenate([[False], np.diff(self.time) <= 0.0])
        _refuse(not_later, self.time, f"run {self.name}: column 'time'", "strictly increasing time")
        self._refuse_wrapped_angle()

    def columns(self) -> dict[str, NDArray[np.float64]]:
        """All columns of the run file after ``time``, by name."""
        predictions = {
            name + PREDICTION_SUFFIX: values for name, values in self.predictions.items()
        }
        return {**self.inputs, **self.signals, **predictions}

    def _refuse_wrapped_angle(self) -> None:
        """Refuse an angle that jumps back by a turn while it runs forward.

        It was never unwrapped.
        """
        angle = self.inputs.get("carrier_angle")
        if angle is None or angle.size < 2:
            return
        step = np.diff(angle)
        jump_back = step * np.sign(np.median(step)) < -np.pi
        _refuse(
            np.concatenate([[False], jump_back]),
            angle,
            f"run {self.name}: column 'carrier_angle'",
            "no jump back",
        )


def _refuse(
    wrong: NDArray[np.bool_], values: NDArray[np.float64], where: str, expected: str
) -> None:
    """Raise for the first sample that is wrong."""
    if wrong.any():
        sample = int(np.argmax(wrong))
        hint = "; unwrap it" if expected == "no jump back" else ""
        raise ValueError(
            f"{where} is {values[sample]} at sample {sample} (counted from 0); expected {expected}{hint}"
        )
