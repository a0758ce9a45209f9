"""One measured record: time, inputs and signals of a run."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.files.problems import refuse
from carrierflex.files.temporary_store import StoredColumns, TemporaryStore, stored_columns
from carrierflex.identification.campaign.declarations import PREDICTION_SUFFIX

#: Largest size of a sample, in any unit: squares and fifth powers of it are numbers still.
_LARGEST = 1e30


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
    use : tuple of (float, float)
        Windows of time [s] whose samples count, ends included; all samples where empty.

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
    use: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        if self.time.ndim != 1 or self.time.size == 0:
            raise ValueError(
                f"run {self.name}: column 'time' holds {self.time.size} samples; expected at least "
                "one"
            )
        for name, values in self.columns().items():
            if values.shape != self.time.shape:
                raise ValueError(
                    f"run {self.name}: column '{name}' holds {values.size} samples; expected "
                    f"{self.time.size} as 'time'"
                )
        refuse(f"run {self.name}: {defect}" for defect in self._defects())

    def _defects(self) -> Iterator[str]:
        """One text for every column that holds what it must not."""
        for name, values in {"time": self.time, **self.columns()}.items():
            if (np.abs(values) <= _LARGEST).all():
                continue
            if name == "time" or name in self.inputs:
                yield from _first_wrong(name, ~np.isfinite(values), values, "a finite number")
            else:
                expected = "a finite number, or an empty cell where the sample is missing"
                yield from _first_wrong(name, np.isinf(values), values, expected)
            too_large = (np.abs(values) > _LARGEST) & np.isfinite(values)
            yield from _first_wrong(name, too_large, values, f"a number of {_LARGEST:g} at most")
        not_later = np.concatenate([[False], self.time[1:] <= self.time[:-1]])
        yield from _first_wrong("time", not_later, self.time, "strictly increasing time")
        yield from self._wrapped_angle()

    @property
    def in_use(self) -> NDArray[np.bool_]:
        """Which samples lie in a window that counts, shape (n,); all where there is no window."""
        if not self.use:
            return np.ones(self.time.size, dtype=bool)
        inside = [(self.time >= start) & (self.time <= end) for start, end in self.use]
        return np.any(inside, axis=0)

    def within_use(self) -> "Run":
        """Copy whose signals and predictions are missing outside the windows that count."""
        if not self.use:
            return self
        out = ~self.in_use
        signals = {name: np.where(out, np.nan, values) for name, values in self.signals.items()}
        predictions = {
            name: np.where(out, np.nan, values) for name, values in self.predictions.items()
        }
        return replace(self, predictions=predictions).with_signals(signals)

    def thinned(self, every: int) -> "Run":
        """Copy with one sample of every `every` of all columns."""

        def thin(columns: Mapping[str, NDArray[np.float64]]) -> dict[str, NDArray[np.float64]]:
            """Columns without the samples between."""
            return {name: values[::every] for name, values in columns.items()}

        if every == 1:
            return self
        return replace(
            self,
            time=self.time[::every],
            inputs=thin(self.inputs),
            signals=thin(self.signals),
            predictions=thin(self.predictions),
        )

    def of_channels(self, names: Collection[str]) -> "Run":
        """Copy with some of its channels."""
        return replace(
            self,
            signals=_chosen(self.signals, names),
            predictions=_chosen(self.predictions, names),
        )

    def with_signals(self, signals: Mapping[str, NDArray[np.float64]]) -> "Run":
        """Copy with other signals, on disk where the present ones are."""
        if isinstance(self.signals, StoredColumns):
            signals = stored_columns(signals, self.signals.store)
        return replace(self, signals=signals)

    def on_disk(self, store: TemporaryStore) -> "Run":
        """Copy whose signals and predictions are in a store, read where they are asked for."""
        return replace(
            self,
            signals=stored_columns(self.signals, store),
            predictions=stored_columns(self.predictions, store),
        )

    def columns(self) -> dict[str, NDArray[np.float64]]:
        """All columns of the run file after ``time``, by name."""
        predictions = {
            name + PREDICTION_SUFFIX: values for name, values in self.predictions.items()
        }
        return {**self.inputs, **self.signals, **predictions}

    def _wrapped_angle(self) -> Iterator[str]:
        """Text where an angle jumps back by a turn while it runs forward."""
        angle = self.inputs.get("carrier_angle")
        if angle is None or angle.size < 2 or not (np.abs(angle) <= _LARGEST).all():
            # Steps between numbers that are refused anyway are no numbers.
            return
        step = np.diff(angle)
        if (np.abs(step) < np.pi).all():
            return
        jump_back = step * np.sign(np.median(step)) < -np.pi
        wrong = np.concatenate([[False], jump_back])
        yield from _first_wrong("carrier_angle", wrong, angle, "no jump back; unwrap it")


def _chosen(
    columns: Mapping[str, NDArray[np.float64]], names: Collection[str]
) -> Mapping[str, NDArray[np.float64]]:
    """Some of the columns, on disk where all of them are."""
    if isinstance(columns, StoredColumns):
        offsets = {name: index for name, index in columns.offsets.items() if name in names}
        return replace(columns, offsets=offsets)
    return {name: values for name, values in columns.items() if name in names}


def _first_wrong(
    column: str, wrong: NDArray[np.bool_], values: NDArray[np.float64], expected: str
) -> Iterator[str]:
    """Text for the first sample of a column that is wrong."""
    if wrong.any():
        sample = int(np.argmax(wrong))
        yield (
            f"column '{column}' is {values[sample]} at sample {sample} (counted from 0); expected "
            f"{expected}"
        )
