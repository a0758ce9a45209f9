"""Residuals of the runs of a simulated problem, and their derivatives by differences in threads."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.comparison.problem import BoolArray, FloatArray, Parameter, SegmentSums

#: A difference is taken over a share of a parameter, or of this part of its scale if that is more.
_LEAST_SHARE = 0.1


class _SegmentedRecord(Protocol):
    """Record of a run, cut into segments."""

    @property
    def name(self) -> str:
        """Name of the run."""

    @property
    def block(self) -> NDArray[Any]:
        """Segment of every sample, -1 where it is in none; shape (n,)."""

    @property
    def n_blocks(self) -> int:
        """Number of segments."""


R = TypeVar("R", bound=_SegmentedRecord)


@dataclass(frozen=True, eq=False)
class DifferencedResiduals(Generic[R]):
    """Measured less predicted signals of all runs as a function of the parameters.

    Parameters
    ----------
    records : sequence of SegmentedRecord
        Runs.
    residual : callable
        Residual of a record at a parameter set, shape (n,) or (n, n_channels); zero where nothing
        was measured, infinite where the motion diverges. Called from several threads.
    parameters : sequence of Parameter
        Unknowns, shape (p,).
    relative_step : float
        Step of the differences, relative to a parameter.
    n_threads : int
        Threads; one does without.
    """

    records: Sequence[R]
    residual: Callable[[R, FloatArray], FloatArray]
    parameters: Sequence[Parameter]
    relative_step: float
    n_threads: int

    def chosen(
        self, theta: FloatArray, chosen: BoolArray
    ) -> list[tuple[R, NDArray[np.int64], FloatArray]]:
        """Runs with a chosen segment.

        Parameters
        ----------
        theta : ndarray, shape (p,)
            Parameter set.
        chosen : ndarray of bool, shape (n_segments,)
            Segments of all runs.

        Returns
        -------
        list of tuple
            Record, indices of all its segments, its residual.
        """
        runs = _runs_with_segments(self.records, chosen)
        residuals = self._in_threads(lambda k: self.residual(runs[k][0], theta), len(runs))
        return [
            (record, segments, residual)
            for (record, segments), residual in zip(runs, residuals, strict=True)
        ]

    def sums(self, theta: FloatArray, chosen: BoolArray) -> SegmentSums:
        """Gauss-Newton sums by segment; infinite squares where the motion diverges.

        Parameters
        ----------
        theta : ndarray, shape (p,)
            Parameter set.
        chosen : ndarray of bool, shape (n_segments,)
            Segments; the sums of runs without a chosen one stay zero.
        """
        n = chosen.size
        p = theta.size
        matrix = np.zeros((n, p, p))
        right = np.zeros((n, p))
        square = np.zeros(n)
        for record, segments, residual in self.chosen(theta, chosen):
            if not np.isfinite(residual).all():
                square[segments] = np.inf
                continue
            rows = self._derivatives(record, theta, residual)
            for block, segment in enumerate(segments):
                samples = record.block == block
                block_rows = rows[:, samples].reshape(p, -1)
                block_residual = residual[samples].ravel()
                matrix[segment] = block_rows @ block_rows.T
                right[segment] = block_rows @ block_residual
                square[segment] = block_residual @ block_residual
        return SegmentSums(matrix, right, square)

    def slopes(self, theta: FloatArray) -> Iterator[tuple[FloatArray, FloatArray]]:
        """Residual and change of the prediction by every parameter, record by record.

        Parameters
        ----------
        theta : ndarray, shape (p,)
            Parameter set.

        Yields
        ------
        tuple of (ndarray) and (ndarray, shape (p, ...))
            Of the shape of the residual.
        """
        for record in self.records:
            residual = self.residual(record, theta)
            yield residual, self._derivatives(record, theta, residual)

    def _derivatives(self, record: R, theta: FloatArray, residual: FloatArray) -> FloatArray:
        """Change of the prediction by every parameter, shape (p, *residual.shape)."""
        rows = self._in_threads(lambda k: self._derivative(record, theta, residual, k), theta.size)
        return np.array(rows)

    def _derivative(self, record: R, theta: FloatArray, residual: FloatArray, k: int) -> FloatArray:
        """Change of the prediction by parameter k; zero where the changed motion diverges."""
        parameter = self.parameters[k]
        if parameter.run is not None and parameter.run != record.name:
            return np.zeros(residual.shape)
        step = self.relative_step * max(abs(theta[k]), _LEAST_SHARE * parameter.scale)
        if theta[k] + step > parameter.upper:
            step = -step
        changed_theta = theta.copy()
        changed_theta[k] += step
        changed = self.residual(record, changed_theta)
        if not np.isfinite(changed).all():
            return np.zeros(residual.shape)
        return (residual - changed) / step

    def _in_threads(self, work: Callable[[int], FloatArray], count: int) -> list[FloatArray]:
        """Results for every number; the compiled motion runs without the interpreter's lock."""
        if self.n_threads == 1:
            return list(map(work, range(count)))
        with ThreadPoolExecutor(self.n_threads) as threads:
            return list(threads.map(work, range(count)))


def _runs_with_segments(
    records: Iterable[R], chosen: BoolArray
) -> list[tuple[R, NDArray[np.int64]]]:
    """Runs with a chosen segment."""
    first = 0
    runs = []
    for record in records:
        segments = np.arange(first, first + record.n_blocks)
        if chosen[segments].any():
            runs.append((record, segments))
        first += record.n_blocks
    return runs


def step_halving_error(records: Iterable[R], predicted: Callable[[R, int], FloatArray]) -> float:
    """RMS change of a prediction, a function of record and refinement, with half the step."""
    changes = [predicted(record, 2) - predicted(record, 1) for record in records]
    return float(np.sqrt(np.mean(np.concatenate(changes) ** 2)))
