"""How far the gap shrinks when effects are added in turn: fitted on some revolutions, scored on the others."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.noise_floor import noise_floor
from identification.campaign import Campaign, Channel
from identification.carrier_identification import axial_channels
from identification.carrier_models import CarrierModel, Effect, Inputs
from identification.least_squares import joint_fit
from identification.normal_equations import NormalEquations, normal_equations

#: Revolutions in a block; blocks serve training and scoring in turn, so that slow drift enters both alike.
BLOCK_REVOLUTIONS = 2
#: A larger model may cost more on its training data by rounding only; relative to the cost before any effect.
_COST_ROUNDING = 1e-9


class NestedCostError(ArithmeticError):
    """A model fitted its training data worse than a model it contains; the solution is not a minimum.

    Parameters
    ----------
    effect : str
        Effect whose addition raised the cost.
    before, after : float
        Sum of squared residuals without and with it [m²].
    """

    def __init__(self, effect: str, before: float, after: float) -> None:
        super().__init__(f"adding '{effect}' raised the training cost from {before:.6e} to {after:.6e} m²")
        self.effect, self.before, self.after = effect, before, after


@dataclass(frozen=True, eq=False)
class RevolutionLadder:
    """RMS on held-out revolutions as effects are added, in turn and each alone.

    Parameters
    ----------
    effects : tuple of str
        Effect ids in the order they are added; n_effects.
    runs : tuple of str
        Runs.
    rms : ndarray, shape (n_effects + 1,)
        Held-out RMS over all runs [m]: baseline, then after each addition.
    rms_by_run : ndarray, shape (n_effects + 1, n_runs)
        The same by run.
    rms_alone, rms_alone_by_run : ndarray, shape (n_effects,) and (n_effects, n_runs)
        Held-out RMS of the baseline and one effect [m].
    rho, rho_alone : ndarray, shape (n_effects + 1,) and (n_effects,)
        RMS over the RMS of the baseline.
    phi : ndarray, shape (n_effects + 1,)
        Share of the mean square above the noise floor that is explained.
    placebo_rho : float
        rho of an effect without physical meaning.
    noise_floor : float
        RMS that no model can go below [m].
    noise_floor_by_run : ndarray, shape (n_runs,)
        The same by run.
    """

    effects: tuple[str, ...]
    runs: tuple[str, ...]
    rms: NDArray[np.float64]
    rms_by_run: NDArray[np.float64]
    rms_alone: NDArray[np.float64]
    rms_alone_by_run: NDArray[np.float64]
    rho: NDArray[np.float64]
    rho_alone: NDArray[np.float64]
    phi: NDArray[np.float64]
    placebo_rho: float
    noise_floor: float
    noise_floor_by_run: NDArray[np.float64]


def _placebo_cosine(inputs: Inputs, channel: Channel) -> NDArray[np.float64]:
    return np.cos(5.0 * inputs["carrier_angle"])


def _placebo_sine(inputs: Inputs, channel: Channel) -> NDArray[np.float64]:
    return np.sin(5.0 * inputs["carrier_angle"])


#: Order 5, the same on every sensor: nothing on the carrier makes it (order 5 fixed to the carrier is m = +1).
PLACEBO = Effect("placebo", (_placebo_cosine, _placebo_sine), ("placebo_cos", "placebo_sin"), ("m", "m"))


def shrinkage(campaign: Campaign, base: Sequence[Effect], added: Sequence[Effect]) -> RevolutionLadder:
    """Add effects to a baseline one after the other and score each model on held-out revolutions.

    ``rho = RMS_after / RMS_before``, ``phi = 1 - (MSE_after - s²) / (MSE_before - s²)``, s the noise floor.

    Parameters
    ----------
    campaign : Campaign
        Campaign of kind ``carrier``.
    base : sequence of Effect
        The baseline.
    added : sequence of Effect
        Effects in the order they are added.

    Returns
    -------
    RevolutionLadder
        Overall and by run.

    Raises
    ------
    ValueError
        Where a run has too few revolutions for a training and a held-out block.
    NestedCostError
        Where adding an effect raises the training cost.
    """
    split = _split(campaign, CarrierModel("all effects", (*base, *added, PLACEBO)))
    names = [effect.name for effect in base]
    steps = [effect.name for effect in added]
    ladder = [_score(split, [*names, *steps[:k]]) for k in range(len(steps) + 1)]
    alone = [_score(split, [*names, step]) for step in steps]
    placebo = _score(split, [*names, PLACEBO.name])
    for step, before, after in zip(steps, ladder[:-1], ladder[1:], strict=True):
        check_nested(step, before.training_cost, after.training_cost, scale=ladder[0].training_cost)
    for step, after in zip([*steps, PLACEBO.name], [*alone, placebo], strict=True):
        check_nested(step, ladder[0].training_cost, after.training_cost, scale=ladder[0].training_cost)
    floor_by_run = np.array([noise_floor(run, axial_channels(campaign)) for run in campaign.runs])
    floor_square = float(np.average(floor_by_run**2, weights=split.n_held_out))
    mean_square = np.array([score.mean_square for score in ladder])
    rms_alone = np.sqrt([score.mean_square for score in alone])
    return RevolutionLadder(
        effects=tuple(steps),
        runs=tuple(run.name for run in campaign.runs),
        rms=np.sqrt(mean_square),
        rms_by_run=np.sqrt([score.mean_square_by_run for score in ladder]),
        rms_alone=rms_alone,
        rms_alone_by_run=np.sqrt([score.mean_square_by_run for score in alone]),
        rho=np.sqrt(mean_square / mean_square[0]),
        rho_alone=rms_alone / np.sqrt(mean_square[0]),
        phi=_explained(mean_square, floor_square),
        placebo_rho=float(np.sqrt(placebo.mean_square / mean_square[0])),
        noise_floor=float(np.sqrt(floor_square)),
        noise_floor_by_run=floor_by_run,
    )


def check_nested(effect: str, before: float, after: float, *, scale: float) -> None:
    """Refuse a fit that an added effect has made worse on its own training data.

    Parameters
    ----------
    effect : str
        Added effect.
    before, after : float
        Training cost without and with it [m²].
    scale : float
        Training cost before any effect [m²], the scale of rounding.

    Raises
    ------
    NestedCostError
        Where the cost rose by more than rounding.
    """
    if after > before + _COST_ROUNDING * scale:
        raise NestedCostError(effect, before, after)


@dataclass(frozen=True, eq=False)
class _Split:
    """Normal equations of all effects, training and held-out revolutions apart."""

    model: CarrierModel
    training: list[NormalEquations]
    held_out: list[NormalEquations]

    @property
    def n_held_out(self) -> NDArray[np.int64]:
        return np.array([run.n_samples.sum() for run in self.held_out])


@dataclass(frozen=True, eq=False)
class _Score:
    """Training cost and held-out mean squares of one set of effects."""

    training_cost: float
    mean_square: float
    mean_square_by_run: NDArray[np.float64]


def _split(campaign: Campaign, model: CarrierModel) -> _Split:
    training, held_out = [], []
    for run in campaign.runs:
        equations = normal_equations(run, axial_channels(campaign), model)
        if equations.n_revolutions < 2 * BLOCK_REVOLUTIONS:
            raise ValueError(
                f"run {run.name}: {equations.n_revolutions} whole revolutions; expected at least "
                f"{2 * BLOCK_REVOLUTIONS}, a block of {BLOCK_REVOLUTIONS} to fit and one to score"
            )
        trains = np.arange(equations.n_revolutions) // BLOCK_REVOLUTIONS % 2 == 0
        training.append(equations.with_revolutions(trains))
        held_out.append(equations.with_revolutions(~trains))
    return _Split(model, training, held_out)


def _score(split: _Split, effects: Sequence[str]) -> _Score:
    """Fit some of the effects on the training revolutions and score them on the others."""
    owner = [effect.name for effect in split.model.effects for _ in effect.patterns]
    columns = [k for k, name in enumerate(owner) if name in effects]
    training = [run.with_columns(columns) for run in split.training]
    fit = joint_fit(training, [split.model.shared[k] for k in columns])
    cost = sum(float(run.squared_error(fit.run_coefficients(k)).sum()) for k, run in enumerate(training))
    held_out = [run.with_columns(columns) for run in split.held_out]
    squares = np.array([run.squared_error(fit.run_coefficients(k)).sum() for k, run in enumerate(held_out)])
    return _Score(cost, float(squares.sum() / split.n_held_out.sum()), squares / split.n_held_out)


def _explained(mean_square: NDArray[np.float64], floor_square: float) -> NDArray[np.float64]:
    """Share of the mean square above the floor that is explained; NaN where nothing stands above the floor."""
    above = mean_square - floor_square
    return 1.0 - above / above[0] if above[0] > 0.0 else np.full(above.shape, np.nan)
