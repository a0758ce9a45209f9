"""A linear comparison problem whose sums are known in closed form, for tests of the decisions.

Every column is a combination of *directions*: vectors that are orthogonal within each block and
have an RMS of one (times the gain of the condition). Noise is one more direction, so that a model
leaves exactly the sum of the squares of what it lacks: no decision depends on the luck of a draw.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from carrierflex.diagnosis.comparison.effect_cards import EffectCard, EffectParameter
from carrierflex.diagnosis.comparison.problem import (
    BASELINE,
    BoolArray,
    Effects,
    FloatArray,
    GapCell,
    Parameter,
    Segment,
    SegmentSums,
)
from carrierflex.diagnosis.gap.findings import ORDERS, GapFindings
from carrierflex.diagnosis.inference.law_fits import LawFits
from carrierflex.diagnosis.kind.comparison_problem import CandidateExperiment, ComparisonProblem

#: Values of parameters by effect and name.
Known = Mapping[tuple[str, str], float]

NOISE = "noise"


@dataclass(frozen=True, eq=False)
class CellsAlone:
    """Gap of which nothing but the map is known."""

    cells: tuple[GapCell, ...]

    def findings(self) -> GapFindings:
        return GapFindings((), ORDERS)

    def scalars(self) -> tuple[()]:
        return ()


@dataclass(frozen=True, eq=False)
class LinearProblem(ComparisonProblem):
    """Target minus ``columns @ theta``: one column for the baseline and one for each effect.

    Parameters
    ----------
    columns : ndarray, shape (n_segments, n_samples, n_columns)
        The baseline's, then one of each effect in `names`.
    target : ndarray, shape (n_segments, n_samples)
        Measured signal.
    names : tuple of str
        Owner of each column.
    bounds : mapping of str to tuple of float
        Physical bounds of the effects that have any.
    runs_own : tuple of str
        Effects with a parameter for each run in place of one for all.
    numerical : float
        Numerical error that the problem claims.
    """

    columns: FloatArray
    target: FloatArray
    names: tuple[str, ...]
    blocks: tuple[Segment, ...]
    library: Mapping[str, EffectCard]
    noise_std: float
    channels: int = 1
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    runs_own: tuple[str, ...] = ()
    candidates: tuple[CandidateExperiment, ...] = ()
    numerical: float = 0.0

    @property
    def cards(self) -> Mapping[str, EffectCard]:
        return self.library

    @property
    def segments(self) -> tuple[Segment, ...]:
        return self.blocks

    @property
    def unit(self) -> str:
        return "m"

    @property
    def n_channels(self) -> int:
        return self.channels

    @property
    def cell_counts(self) -> FloatArray:
        return np.full((len(self.segments), 1), float(self.target.shape[1]))

    @property
    def noise_square(self) -> FloatArray:
        return self.noise_std**2 * self.cell_counts

    def parameters(self, effects: Effects) -> tuple[Parameter, ...]:
        return tuple(
            Parameter(
                "x", "m", *self.bounds.get(name, (-np.inf, np.inf)), 1.0, effect=name, run=run
            )
            for name in (BASELINE, *effects)
            for run in (self._runs if name in self.runs_own else (None,))
        )

    def starts(self, effects: Effects, known: Known) -> Sequence[FloatArray]:
        keys = [
            (
                parameter.effect,
                parameter.name if parameter.run is None else f"{parameter.name} of {parameter.run}",
            )
            for parameter in self.parameters(effects)
        ]
        return [np.array([known.get(key, 0.0) for key in keys])]

    def sums(
        self, effects: Effects, theta: FloatArray, chosen: BoolArray, free: BoolArray | None = None
    ) -> SegmentSums:
        jacobian = self._jacobian(effects) * chosen[:, None, None]
        residual = (self.target - jacobian @ theta) * chosen[:, None]
        return SegmentSums(
            np.einsum("kip,kiq->kpq", jacobian, jacobian),
            np.einsum("kip,ki->kp", jacobian, residual),
            np.einsum("ki,ki->k", residual, residual),
        )

    def squares(self, effects: Effects, theta: FloatArray, chosen: BoolArray) -> FloatArray:
        return self.sums(effects, theta, chosen).square[:, None]

    def gap(self, effects: Effects, theta: FloatArray) -> "CellsAlone":
        """One cell a run: mean square of the residual, and the same less the noise."""
        squares = self.sums(effects, theta, np.ones(len(self.segments), dtype=bool)).square
        cells = []
        for run in self._runs:
            of_run = [segment.run == run for segment in self.segments]
            mean = float(squares[of_run].sum() / self.cell_counts[of_run].sum())
            coherent = mean - self.noise_std**2
            cells.append(GapCell("signal", 1.0, run, mean, coherent, 1.0, (1.0, 1.0), 0.0))
        return CellsAlone(tuple(cells))

    def with_signals_of(self, effects: Effects, theta: FloatArray) -> "LinearProblem":
        return replace(self, target=self._jacobian(effects) @ theta)

    def candidate_experiments(self) -> Sequence[CandidateExperiment]:
        return self.candidates

    def numerical_error(self, effects: Effects, theta: FloatArray) -> float:
        return self.numerical

    @property
    def _runs(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(segment.run for segment in self.segments))

    def pictures(self, effects: Effects, theta: FloatArray) -> tuple[()]:
        return ()

    def _jacobian(self, effects: Effects) -> FloatArray:
        """Derivatives of the prediction, shape (n_segments, n_samples, n_parameters)."""
        parameters = self.parameters(effects)
        jacobian = self.columns[
            :, :, [self.names.index(parameter.effect) for parameter in parameters]
        ]
        runs = [segment.run for segment in self.segments]
        acts = [
            [parameter.run is None or parameter.run == run for parameter in parameters]
            for run in runs
        ]
        return jacobian * np.array(acts)[:, None, :]


def linear_problem(
    truth: Mapping[str, float],
    effects: Mapping[str, Mapping[str, float]] | Sequence[str] = ("a", "b", "c", "d"),
    *,
    gains: Mapping[str, float] | None = None,
    blocks: int = 2,
    n_samples: int = 16,
    noise_std: float = 1.0,
    n_channels: int = 1,
    aliases: Mapping[str, Effects] | None = None,
    seed: int = 3,
) -> LinearProblem:
    """Problem with three conditions of one run each, unless `gains` says otherwise.

    Parameters
    ----------
    truth : mapping of str to float
        Size of every direction in the target; one that no effect has is outside the library.
    effects : mapping of str to mapping of str to float, or sequence of str
        Directions of each effect's column with their weights; a name alone is a direction.
    gains : mapping of str to float, optional
        Factor of all directions but baseline and noise, by condition.
    noise_std : float
        RMS of the noise.
    aliases : mapping of str to tuple of str, optional
        Aliases on the cards.
    """
    gains = gains or {"A": 1.0, "B": 1.0, "C": 1.0}
    known = effects if isinstance(effects, Mapping) else {name: {name: 1.0} for name in effects}
    columns = {BASELINE: {BASELINE: 1.0}, **known}
    target = {**truth, NOISE: noise_std}
    named = [name for weights in (*columns.values(), target) for name in weights]
    directions = tuple(dict.fromkeys(named))
    numbers = range(blocks)
    segments = tuple(Segment(f"R{name}", name, k, n_samples) for name in gains for k in numbers)
    draws = np.random.default_rng(seed).standard_normal((len(segments), n_samples, len(directions)))
    vectors = np.linalg.qr(draws)[0] * np.sqrt(n_samples)
    changed = [k for k, name in enumerate(directions) if name not in (BASELINE, NOISE)]
    vectors[:, :, changed] *= np.array([gains[segment.condition] for segment in segments])[
        :, None, None
    ]

    def combined(weights: Mapping[str, float]) -> FloatArray:
        return vectors @ np.array([weights.get(name, 0.0) for name in directions])

    return LinearProblem(
        columns=np.stack([combined(weights) for weights in columns.values()], axis=2),
        target=combined(target),
        names=tuple(columns),
        blocks=segments,
        library={name: _card(name, (aliases or {}).get(name, ())) for name in known},
        noise_std=noise_std,
        channels=n_channels,
    )


def with_answers(problem: LinearProblem, **answers: object) -> LinearProblem:
    """Problem that is asked for more than a linear one is: each method returns what is given."""
    methods = {name: lambda self, *model, given=given: given for name, given in answers.items()}
    return type("Problem", (LinearProblem,), methods)(**vars(problem))


def with_random_noise(problem: LinearProblem, rng: np.random.Generator) -> LinearProblem:
    """Problem with white noise of the declared size added to its target."""
    noise = problem.noise_std * rng.standard_normal(problem.target.shape)
    return replace(problem, target=problem.target + noise)


def _card(name: str, aliases: Effects) -> EffectCard:
    return EffectCard(
        id=name,
        kind="element",
        equation=f"x column_{name}",
        parameters=(EffectParameter("x", "m"),),
        signature="a line",
        aliases=aliases,
        discriminating_experiment=f"isolate {name}",
    )


def write_score(
    fits: LawFits,
    effects: Effects,
    mean_square: float | Sequence[float],
) -> None:
    """Put a held-out score into fits by hand.

    One mean square, or one for each segment.
    """
    fits.fit(effects)
    fits.scores[effects] = fits.problem.cell_counts.sum(axis=1) * np.asarray(mean_square)
