"""The baseline's own refit where it is linear in its parameters.

What is left of a signal, in sample and held out.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LinearBaseline:
    """Regressors of a baseline, run by run.

    Parameters
    ----------
    columns : sequence of ndarray, shape (n_channels n, p)
        Regressors that all runs share.
    own_offset : bool
        Whether every run has an offset of its own besides.
    not_negative : tuple of int
        At most one column whose factor cannot be negative (the share of a deflection).
    """

    columns: Sequence[FloatArray]
    own_offset: bool
    not_negative: tuple[int, ...] = ()

    def left(self, signals: Sequence[FloatArray]) -> list[FloatArray]:
        """What a refit to all runs leaves of the signals, each shape (n_channels, n)."""
        every = range(len(signals))
        return self._left_of(signals, fitted=every, scored=every)

    def held_out(self, signals: Sequence[FloatArray]) -> list[FloatArray]:
        """What is left of each run where what runs share was fitted to the other runs, its own offset to itself.

        A single run is scored by quarters, each left out in turn.
        """
        if len(signals) == 1:
            return self._left_by_quarters(signals[0])
        every = range(len(signals))
        return [
            self._left_of(signals, fitted=[k for k in every if k != run], scored=[run])[0]
            for run in every
        ]

    def _left_of(
        self, signals: Sequence[FloatArray], *, fitted: Sequence[int], scored: Sequence[int]
    ) -> list[FloatArray]:
        """Residual of the runs `scored` with shared parameters from the runs `fitted`."""
        matrix = np.concatenate([self._centred(self.columns[run]) for run in fitted])
        target = np.concatenate([self._centred(signals[run].reshape(-1)) for run in fitted])
        shared = self._solution(matrix, target)
        left = []
        for run in scored:
            residual = signals[run].reshape(-1) - self.columns[run] @ shared
            left.append(self._centred(residual).reshape(signals[run].shape))
        return left

    def _left_by_quarters(self, signal: FloatArray) -> list[FloatArray]:
        offset = np.ones((signal.size, 1 if self.own_offset else 0))
        matrix = np.concatenate([self.columns[0], offset], axis=1)
        quarter = np.broadcast_to(
            np.arange(signal.shape[1]) * 4 // signal.shape[1], signal.shape
        ).reshape(-1)
        target, left = signal.reshape(-1), np.empty(signal.size)
        for k in range(4):
            out = quarter == k
            left[out] = target[out] - matrix[out] @ self._solution(matrix[~out], target[~out])
        return [left.reshape(signal.shape)]

    def _centred(self, values: FloatArray) -> FloatArray:
        return values - values.mean(axis=0) if self.own_offset else values

    def _solution(self, matrix: FloatArray, target: FloatArray) -> FloatArray:
        solution = self._free_solution(matrix, target)
        for column in self.not_negative:
            if solution[column] < 0.0:
                # With one bound, the constrained optimum lies on it.
                solution = self._free_solution(
                    np.where(np.arange(matrix.shape[1]) == column, 0.0, matrix), target
                )
        return solution

    @staticmethod
    def _free_solution(matrix: FloatArray, target: FloatArray) -> FloatArray:
        size = np.linalg.norm(matrix, axis=0)
        size[size == 0.0] = 1.0
        return np.asarray(np.linalg.lstsq(matrix / size, target, rcond=1e-9)[0] / size)
