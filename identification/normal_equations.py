"""Normal equations of a linear model, accumulated revolution by revolution and channel by channel.

One pass over the record gives every sum that fits, held-out scores and the jackknife need; memory does not grow
with the length of the record. With columns scaled to unit length the condition number of the carrier models is
below 100, so that squaring it costs four digits of sixteen; :mod:`identification.least_squares` checks it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.campaign import Channel
from identification.carrier_models import CarrierModel
from identification.records import Run
from identification.revolutions import whole_revolutions


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

    @property
    def n_revolutions(self) -> int:
        """Number of whole revolutions."""
        return len(self.square_sum)

    def squared_error(self, coefficients: NDArray[np.float64]) -> NDArray[np.float64]:
        """Sum of squared residuals by revolution and channel [m²], shape (n_revolutions, n_channels)."""
        linear = self.right_side @ coefficients
        quadratic = np.einsum("rcij,i,j->rc", self.matrix, coefficients, coefficients)
        # A perfect fit leaves rounding of either sign.
        return np.maximum(self.square_sum - 2.0 * linear + quadratic, 0.0)

    def with_columns(self, columns: Sequence[int]) -> "NormalEquations":
        """Equations of the model that keeps only some coefficients, in the order of `columns`."""
        kept = np.asarray(columns, dtype=np.int64)
        matrix = self.matrix[:, :, kept[:, None], kept[None, :]]
        return NormalEquations(
            self.run, self.channels, matrix, self.right_side[:, :, kept], self.square_sum, self.n_samples
        )

    def with_revolutions(self, chosen: NDArray[np.bool_]) -> "NormalEquations":
        """Equations of some of the revolutions; `chosen` has shape (n_revolutions,)."""
        return NormalEquations(
            self.run,
            self.channels,
            self.matrix[chosen],
            self.right_side[chosen],
            self.square_sum[chosen],
            self.n_samples[chosen],
        )


def normal_equations(run: Run, channels: Sequence[Channel], model: CarrierModel) -> NormalEquations:
    """Accumulate the normal equations of one run over its whole revolutions.

    Parameters
    ----------
    run : Run
        Record.
    channels : sequence of Channel
        Axial channels to fit, each sample with the same weight.
    model : CarrierModel
        Model with p coefficients.

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
    n_coefficients = len(model.coefficients)
    shape = (revolutions.n_revolutions, len(channels))
    matrix = np.zeros((*shape, n_coefficients, n_coefficients))
    right_side = np.zeros((*shape, n_coefficients))
    square_sum = np.zeros(shape)
    n_samples = np.zeros(shape, dtype=np.int64)
    for r, samples in enumerate(revolutions.samples):
        for c, channel in enumerate(channels):
            signal = run.signals[channel.name][samples]
            present = samples[np.isfinite(signal)]
            signal = run.signals[channel.name][present]
            design = model.design({name: values[present] for name, values in run.inputs.items()}, channel)
            matrix[r, c] = design.T @ design
            right_side[r, c] = design.T @ signal
            square_sum[r, c] = signal @ signal
            n_samples[r, c] = present.size
    if n_samples.sum() == 0:
        raise ValueError(f"run {run.name}: every sample of {', '.join(c.name for c in channels)} is missing")
    return NormalEquations(
        run.name, tuple(channel.name for channel in channels), matrix, right_side, square_sum, n_samples
    )
