"""Held-out RMS as given effects are added in a given order, and each alone.

Effects are added whether they pay or not.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from carrierflex.diagnosis.comparison.problem import Effects, FloatArray
from carrierflex.diagnosis.inference.law_fits import (
    explained_share,
    law_fits,
)
from carrierflex.diagnosis.inference.thresholds import Thresholds
from carrierflex.diagnosis.kind.comparison_problem import ComparisonProblem


@dataclass(frozen=True, eq=False)
class EffectsInTurn:
    """What every effect of a list is worth on held-out records.

    Parameters
    ----------
    effects : tuple of str
        Effect ids in the order they are added; n_effects.
    rms : ndarray, shape (n_effects + 1,)
        Held-out RMS: baseline, then after each addition, in the unit of the channels.
    rms_alone : ndarray, shape (n_effects,)
        Held-out RMS of the baseline and one effect.
    phi : ndarray, shape (n_effects + 1,)
        Share of the mean square above the noise floor that is explained.
    noise_floor : float
        RMS that no model can go below.
    """

    effects: Effects
    rms: FloatArray
    rms_alone: FloatArray
    phi: FloatArray
    noise_floor: float

    @property
    def rho(self) -> FloatArray:
        """RMS over the baseline's, shape (n_effects + 1,)."""
        return self.rms / self.rms[0]


def effects_in_turn(problem: ComparisonProblem, effects: Sequence[str]) -> EffectsInTurn:
    """Score the effects of a list on held-out records.

    As :func:`carrierflex.diagnosis.diagnose.diagnose` scores its sets.

    Parameters
    ----------
    problem : ComparisonProblem
        Records, simulator and library.
    effects : sequence of str
        Effects in the order they are added.

    Returns
    -------
    EffectsInTurn
        A rise of the RMS says that an effect predicts held-out records worse, however it fits its
        own.

    Raises
    ------
    ValueError
        Where an effect is not a candidate of the problem.
    """
    unknown = [effect for effect in effects if effect not in problem.cards]
    if unknown:
        raise ValueError(
            f"effects {', '.join(unknown)}; expected candidates of the problem: "
            f"{', '.join(problem.cards)}"
        )
    search = law_fits(problem, Thresholds())
    squares = np.array([search.mean_square(tuple(effects[:k])) for k in range(len(effects) + 1)])
    return EffectsInTurn(
        effects=tuple(effects),
        rms=np.sqrt(squares),
        rms_alone=np.sqrt([search.mean_square((effect,)) for effect in effects]),
        phi=np.array([explained_share(squares[0], square, search.floor) for square in squares]),
        noise_floor=float(np.sqrt(search.floor)),
    )
