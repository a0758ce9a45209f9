"""Normal equations of a linear model, accumulated revolution by revolution and channel by channel.

One pass over the record gives every sum that fits, held-out scores and the jackknife need; memory
does not grow with the length of the record. With columns scaled to unit length the condition number
of the carrier models is below 100, so that squaring it costs four digits of sixteen;
:mod:`carrierflex.identification.estimation.least_squares` checks it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.identification.campaign.declarations import Channel
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign.revolutions import whole_revolutions
from carrierflex.identification.carrier.models import CarrierModel


@dataclass(frozen=True, eq=False)
class NormalEquations:
    """Sums over the samples of one run; p coefficients.

    Parameters
    ----------
    run : str
        Name of the run.
    channels : tuple of str
        Names of the channels.
    matrix : ndarray, shape (n_revolutions, n_channels, p, p)
        ``X.T X`` of the design X of each revolution and channel.
    right_side : ndarray, shape (n_revolutions, n_channels, p)
        ``X.T y``.
    square_sum : ndarray, shape (n_revolutions, n_channels)
        ``y.T y`` [m²].
    n_samples : ndarray of int, shape (n_revolutions, n_channels)
        Samples that are not missing.
    """

    run: str
    channels: tuple[str, ...]
    matrix: NDArray[np.float64]
    right_side: NDArray[np.float64]
    square_sum: NDArray[np.float64]
    n_samples: NDArray[np.int64]

    @classmethod
    def empty(
        cls, run: str, channels: Sequence[Channel], n_revolutions: int, n_coefficients: int
    ) -> "NormalEquations":
        """Sums of no samples."""
        shape = (n_revolutions, len(channels))
        return cls(
            run,
            tuple(channel.name for channel in channels),
            np.zeros((*shape, n_coefficients, n_coefficients)),
            np.zeros((*shape, n_coefficients)),
            np.zeros(shape),
            np.zeros(shape, dtype=np.int64),
        )

    def add(
        self,
        channel: int,
        samples: Sequence[NDArray[np.int64]],
        design: NDArray[np.float64],
        signal: NDArray[np.float64],
        weight: NDArray[np.float64] | None = None,
    ) -> None:
        """Add samples of one channel.

        `samples[r]` are the rows that belong to revolution r; missing ones are skipped.
        """
        present = np.isfinite(signal)
        for r, rows in enumerate(samples):
            valid = rows[present[rows]]
            if valid.size == 0:
                continue
            X, y = design[valid], signal[valid]
            Xw, yw = (X, y) if weight is None else (X * weight[valid, None], y * weight[valid])
            self.matrix[r, channel] += X.T @ Xw
            self.right_side[r, channel] += Xw.T @ y
            self.square_sum[r, channel] += y @ yw
            self.n_samples[r, channel] += valid.size

    def refuse_empty(self) -> None:
        """Raise ValueError where every sample is missing."""
        if self.n_samples.sum() == 0:
            raise ValueError(
                f"run {self.run}: every sample of {', '.join(self.channels)} is missing"
            )

    @property
    def n_revolutions(self) -> int:
        """Number of whole revolutions."""
        return len(self.square_sum)

    def squared_error(self, coefficients: NDArray[np.float64]) -> NDArray[np.float64]:
        """Sum of squared residuals by revolution and channel [m²].

        Shape (n_revolutions, n_channels).
        """
        linear = self.right_side @ coefficients
        quadratic = np.einsum("rcij,i,j->rc", self.matrix, coefficients, coefficients)
        # A perfect fit leaves rounding of either sign.
        return np.maximum(self.square_sum - 2.0 * linear + quadratic, 0.0)

    def with_columns(self, columns: Sequence[int]) -> "NormalEquations":
        """Equations of the model that keeps only some coefficients, in the order of `columns`."""
        if list(columns) == list(range(self.matrix.shape[-1])):
            return self
        chosen = np.asarray(columns, dtype=np.int64)
        matrix = self.matrix[:, :, chosen[:, None], chosen[None, :]]
        return replace(self, matrix=matrix, right_side=self.right_side[:, :, chosen])


def normal_equations(
    run: Run,
    channels: Sequence[Channel],
    model: CarrierModel,
    weights: Mapping[str, NDArray[np.float64]] | None = None,
) -> NormalEquations:
    """Accumulate the normal equations of one run over its whole revolutions.

    Parameters
    ----------
    run : Run
        Record.
    channels : sequence of Channel
        Rim channels to fit.
    model : CarrierModel
        Model with p coefficients.
    weights : mapping of str to ndarray, shape (n,), optional
        Weight of every squared residual, by channel; 1 without it.

    Returns
    -------
    NormalEquations
        Sums by revolution and channel.

    Raises
    ------
    ValueError
        Where the carrier turns by less than one revolution, or every sample is missing.
    """
    revolutions = whole_revolutions(run)
    n_revolutions, n_coefficients = revolutions.n_revolutions, len(model.coefficients)
    sums = NormalEquations.empty(run.name, channels, n_revolutions, n_coefficients)
    for c, channel in enumerate(channels):
        weight = None if weights is None else weights[channel.name]
        sums.add(
            c,
            revolutions.samples,
            model.design(run.inputs, channel),
            run.signals[channel.name],
            weight,
        )
    sums.refuse_empty()
    return sums
