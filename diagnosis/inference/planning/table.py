"""Products of signatures over every run and channel that is planned or could be added."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.identification.estimation.scaled_least_squares import normal_inverse

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

#: Columns whose square is below this share of the largest do not act.
_ABSENT = 1e-24


@dataclass(frozen=True)
class Signature:
    """Columns of one effect at one value of its shape, or on one channel.

    Parameters
    ----------
    effect : str
        Effect id.
    variant : tuple of float
        Shape or channel; empty without.
    columns : tuple of int
        Numbers of the columns in the table.
    """

    effect: str
    variant: tuple[float, ...]
    columns: tuple[int, ...]


@dataclass(frozen=True)
class ScaledParameter:
    """What an amplitude is called, in which unit, and the size of it that is worth noticing."""

    name: str
    unit: str
    scale: float


@dataclass(frozen=True, eq=False)
class PlannedTable:
    """Products of target, baseline's regressors and signatures, over the noise's variance.

    A part is one channel of one run; signals of parts that were not measured are zero. Columns are
    those of unit parameters times their scale: the amplitudes count in sizes worth noticing.

    Parameters
    ----------
    gram : ndarray, shape (n_parts, n, n)
        Products ``X' X / sigma²``: the target first, then `n_base` regressors, then signatures.
    n_base : int
        Regressors of the baseline.
    known : ndarray, shape (n_base,)
        Precision of what is known of each baseline parameter, in the units of its column; zero
        where nothing is.
    signatures : tuple of Signature
        Columns by effect and variant.
    parameters : mapping of str to ScaledParameter
        First amplitude of every effect.
    runs, channels : ndarray of int, shape (n_parts,)
        Run and channel of every part.
    n_samples : ndarray, shape (n_parts,)
        Samples of every part.
    run_names, channel_names : tuple of str
        Names by number.
    noise_std : float
        Root of the mean variance of the noise, in the unit of the channels.
    """

    gram: FloatArray
    n_base: int
    known: FloatArray
    signatures: tuple[Signature, ...]
    parameters: Mapping[str, ScaledParameter]
    runs: IntArray
    channels: IntArray
    n_samples: FloatArray
    run_names: tuple[str, ...]
    channel_names: tuple[str, ...]
    noise_std: float

    @property
    def effects(self) -> tuple[str, ...]:
        """Effects, in the order of the table."""
        return tuple(dict.fromkeys(signature.effect for signature in self.signatures))

    def of(self, effect: str) -> tuple[Signature, ...]:
        """Signatures of one effect."""
        return tuple(signature for signature in self.signatures if signature.effect == effect)

    def weights(
        self,
        minutes: Mapping[str, float],
        channels: Sequence[str],
    ) -> FloatArray:
        """How often every part is measured.

        Parameters
        ----------
        minutes : mapping of str to float
            Length of every run that is made, over that in the table.
        channels : sequence of str
            Channels that are there.

        Returns
        -------
        ndarray, shape (n_parts,)
            Zero for what is not measured.
        """
        of_run = np.array([minutes.get(name, 0.0) for name in self.run_names])
        of_channel = np.array([float(name in channels) for name in self.channel_names])
        return np.asarray(of_run[self.runs] * of_channel[self.channels])

    def measured(self, weights: FloatArray) -> "MeasuredGram":
        """Products over the parts that are measured, the baseline's regressors taken out.

        Parameters
        ----------
        weights : ndarray, shape (n_parts,)
            How often every part is measured.
        """
        some = np.flatnonzero(weights)
        products = np.einsum("p,pij->ij", weights[some], self.gram[some])
        base = np.arange(1, 1 + self.n_base)
        products[base, base] += self.known
        acts = [k for k in base.tolist() if products[k, k] > _ABSENT * np.max(products[base, base])]
        return MeasuredGram(
            _projected(products, acts),
            np.diag(products).copy(),
            float(weights @ self.n_samples),
        )


@dataclass(frozen=True, eq=False)
class MeasuredGram:
    """What a campaign tells of the signatures.

    Parameters
    ----------
    projected : ndarray, shape (n, n)
        Products of what the baseline leaves of the columns, over the noise's variance.
    square : ndarray, shape (n,)
        Squares of the whole columns.
    n_samples : float
        Samples of all channels.
    """

    projected: FloatArray
    square: FloatArray
    n_samples: float


def _projected(gram: FloatArray, columns: list[int]) -> FloatArray:
    """Gram matrix once some columns are taken out of all others (Schur complement)."""
    if not columns:
        return gram
    inverse = normal_inverse(gram[np.ix_(columns, columns)])
    return gram - gram[:, columns] @ inverse @ gram[columns, :]
