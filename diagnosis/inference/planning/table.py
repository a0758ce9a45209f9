"""Products of signatures over every run and channel that is planned or could be added."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from carrierflex.identification.estimation.scaled_least_squares import normal_inverse

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

#: Columns whose square is below this share of the largest do not act.
_ABSENT = 1e-24


@dataclass(frozen=True)
class Signature:
    """Columns of one effect at one value of its shape, or on one channel."""

    effect: Annotated[str, "Effect id"]
    variant: Annotated[tuple[float, ...], "Shape or channel; empty without"]
    columns: Annotated[tuple[int, ...], "Numbers of the columns in the table"]


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
    """

    gram: Annotated[
        FloatArray,
        "Products ``X' X / sigma²``: the target first, then `n_base` regressors, then "
        "signatures, shape (n_parts, n, n)",
    ]
    n_base: Annotated[int, "Regressors of the baseline"]
    known: Annotated[
        FloatArray,
        "Precision of what is known of each baseline parameter, in the units of its column; "
        "zero where nothing is, shape (n_base,)",
    ]
    signatures: Annotated[tuple[Signature, ...], "Columns by effect and variant"]
    parameters: Annotated[Mapping[str, ScaledParameter], "First amplitude of every effect"]
    runs: Annotated[IntArray, "Run of every part"]
    channels: Annotated[IntArray, "Channel of every part"]
    n_samples: Annotated[FloatArray, "Samples of every part, shape (n_parts,)"]
    run_names: Annotated[tuple[str, ...], "Runs by number"]
    channel_names: Annotated[tuple[str, ...], "Channels by number"]
    noise_std: Annotated[
        float, "Root of the mean variance of the noise, in the unit of the channels"
    ]

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
    """What a campaign tells of the signatures."""

    projected: Annotated[
        FloatArray,
        "Products of what the baseline leaves of the columns, over the noise's variance, shape "
        "(n, n)",
    ]
    square: Annotated[FloatArray, "Squares of the whole columns, shape (n,)"]
    n_samples: Annotated[float, "Samples of all channels"]


def _projected(gram: FloatArray, columns: list[int]) -> FloatArray:
    """Gram matrix once some columns are taken out of all others (Schur complement)."""
    if not columns:
        return gram
    inverse = normal_inverse(gram[np.ix_(columns, columns)])
    return gram - gram[:, columns] @ inverse @ gram[columns, :]
