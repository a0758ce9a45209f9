"""What a kind of campaign gives to the diagnosis, after which everything is the same code.

A comparison problem holds the measured records and a simulator with switchable effects. It answers
in sums over segments of the record (a block of a run), so that a closed-form linear problem and one
that integrates in time look alike: the residual is ``r = measured - predicted``, its derivatives by
the parameters ``J = d predicted / d theta``.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, Self

import numpy as np

from carrierflex.diagnosis.classes.gram_table import GramTable
from carrierflex.diagnosis.classes.results import ClassAnswer
from carrierflex.diagnosis.comparison.effect_cards import EffectCard
from carrierflex.diagnosis.comparison.known_physics import DeclaredGains, Misreading
from carrierflex.diagnosis.comparison.overlay import Overlay, Picture
from carrierflex.diagnosis.comparison.problem import (
    BoolArray,
    Effects,
    FloatArray,
    GapCell,
    Parameter,
    Segment,
    SegmentSums,
)
from carrierflex.diagnosis.gap.findings import GapFindings, OffOrderMotion, Scalar
from carrierflex.diagnosis.wiring.refits import WiringChecks
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign_check.campaign_warning import CampaignWarning
from carrierflex.simulation.laws import Law


@dataclass(frozen=True, eq=False)
class CandidateExperiment:
    """A feasible measurement that was not made."""

    text: str  # The condition in words
    #: ``(effects, theta) -> ComparisonProblem`` whose signals are those of a model under that
    #: condition; None where the model runs away there
    problem: "Callable[[Effects, FloatArray], ComparisonProblem | None]"


class Gap(Protocol):
    """Gap of a model: its map, findings and scalars."""

    @property
    def cells(self) -> Sequence[GapCell]:
        """Gap map, largest share first."""

    def findings(self) -> GapFindings:
        """Where it lies, in time, what does not repeat, growth."""

    def scalars(self) -> Sequence[Scalar]:
        """Quantities of interest."""


class ComparisonProblem(ABC):
    """Measured records and a simulator with switchable effects; what one kind of campaign brings.

    `cards` are the candidates by id; the effects the baseline already contains are always in and
    not among them. `cell_counts` and `noise_square`, shape (n_segments, n_cells), are the degrees
    of freedom of each cell of the score and the sum of squares that noise alone leaves there;
    `unit` is the unit of the residual.
    """

    noise_is_measured: bool = True  # Whether the noise floor was declared or comes from repeats

    @property
    @abstractmethod
    def cards(self) -> Mapping[str, EffectCard]:
        """What each effect on trial does, by id."""

    @property
    @abstractmethod
    def segments(self) -> tuple[Segment, ...]:
        """Parts of the records, in order."""

    @property
    @abstractmethod
    def unit(self) -> str:
        """Unit of the residual."""

    @property
    @abstractmethod
    def cell_counts(self) -> FloatArray:
        """Degrees of freedom by segment and cell, shape (n_segments, n_cells)."""

    @property
    @abstractmethod
    def noise_square(self) -> FloatArray:
        """Sum of squares that noise alone leaves, shape (n_segments, n_cells)."""

    @property
    def noise_floor_square(self) -> float:
        """Mean square that noise alone leaves of all records."""
        return float(self.noise_square.sum() / max(self.cell_counts.sum(), 1.0))

    @abstractmethod
    def parameters(self, effects: Effects) -> tuple[Parameter, ...]:
        """Unknowns of baseline + effects: the baseline's first, then each effect's in turn."""

    @abstractmethod
    def starts(
        self, effects: Effects, known: Mapping[tuple[str, str], float]
    ) -> Sequence[FloatArray]:
        """Parameter sets to start from, at least one; `known` are values by effect and name.

        The first takes every known value of a smaller set and switches the others off, so that no
        larger set can fit worse.
        """

    @abstractmethod
    def sums(
        self, effects: Effects, theta: FloatArray, chosen: BoolArray, free: BoolArray | None = None
    ) -> SegmentSums:
        """Gauss-Newton sums of the chosen segments, of the free parameters at least."""

    @abstractmethod
    def squares(self, effects: Effects, theta: FloatArray, chosen: BoolArray) -> FloatArray:
        """Squared residuals by segment and cell, (n_segments, n_cells); zero where not chosen."""

    def total_square(self, effects: Effects, theta: FloatArray, chosen: BoolArray) -> float:
        """Sum of squared residuals of the chosen segments; infinite where the motion diverges."""
        return float(self.squares(effects, theta, chosen)[chosen].sum())

    @abstractmethod
    def gap(self, effects: Effects, theta: FloatArray) -> Gap:
        """Gap of a model."""

    @abstractmethod
    def pictures(self, effects: Effects, theta: FloatArray) -> tuple[Picture, ...]:
        """Gap that baseline + effects would have without the effects, and what the effects explain.

        With no effects, the gap of the baseline alone; empty where nothing is drawn.
        """

    def for_laws(self, laws: Effects) -> Self:
        """Problem for a fit of some laws: columns of the others are made along no record."""
        return self

    @abstractmethod
    def candidate_experiments(self) -> Sequence[CandidateExperiment]:
        """Feasible measurements, among which a separating one is sought."""

    def numerical_error(self, effects: Effects, theta: FloatArray) -> float:
        """RMS change of the prediction with half the simulator's step; zero for a closed form."""
        return 0.0

    @property
    def gains(self) -> DeclaredGains | None:
        """Declared errors of the gains of the signals; None where no parameter scales with them."""
        return None

    @property
    def signal_square(self) -> float:
        """Sum of squares of the measured response about its mean, all runs."""
        return float("nan")

    @property
    def of_chosen_channel(self) -> frozenset[str]:
        """Laws of one channel, which their fit chooses."""
        return frozenset()

    @property
    def brought(self) -> Effects:
        """Laws of the library that came from files: they are fitted whatever the table says."""
        return ()

    def baseline_findings(
        self, values: Mapping[tuple[str, str], float]
    ) -> Sequence[CampaignWarning]:
        """What the fitted values of the baseline say of the machine, by effect and name."""
        return ()

    def combinations(
        self, effects: Effects, theta: FloatArray, covariance: FloatArray
    ) -> Mapping[str, Mapping[str, tuple[float, float]]]:
        """Shares of causes that cannot be told apart, and their errors, by class and name."""
        return {}

    def experiment_between(self, classes: Sequence[Effects]) -> str:
        """What distinguishes sets of classes that leave as much; empty where nothing is known."""
        return ""

    def with_laws(
        self, laws: Sequence[Law], library: Effects | None = None
    ) -> "ComparisonProblem | None":
        """Problem with measured laws among its cards; None of a kind whose laws are its table's.

        `library` are laws of the library that are fitted with them; default: any of them.
        """
        return None

    @property
    def unknown_floor(self) -> str:
        """Why the noise floor is not known; empty where records or declarations bound it."""
        return ""

    @property
    def has_one_frequency(self) -> bool:
        """Whether one and the same frequency drives all runs."""
        return False

    def class_answer(self) -> ClassAnswer | None:
        """Class of the missing effect; None where the records are too short for the comparison."""
        return None

    def gram_table(self) -> GramTable | None:
        """Table that the answer is made from; None where the records are too short for it."""
        return None

    def off_order_motions(self) -> tuple[OffOrderMotion, ...]:
        """Lines and bands between the shaft's orders, taken out before anything is fitted."""
        return ()

    def overlays(self, effects: Effects, theta: FloatArray) -> Sequence[Overlay]:
        """Signals of every channel and run, measured and simulated."""
        return ()

    def misreading(self, effects: Effects, theta: FloatArray) -> Misreading | None:
        """What the declared errors of channels and inputs do to a fit."""
        return None

    def model_moves(self, effects: Effects, theta: FloatArray) -> FloatArray:
        """Moves of the parameters by a standard deviation of the model's errors, (n_errors, p)."""
        return np.zeros((0, theta.size))

    def discrepancy_shift(self, effects: Effects, theta: FloatArray) -> FloatArray | None:
        """Shift of the parameters of a fit beside a discrepancy of no known form, shape (p,)."""
        return None

    def delay_words(self, theta: FloatArray) -> str:
        """What a delay that no record shows does to the baseline; empty where it would show."""
        return ""

    def beyond_visited(self, law: Law) -> tuple[CampaignWarning, ...]:
        """Warnings where records leave the range in which a law of a file was measured."""
        return ()

    def wiring(self, campaign: Campaign) -> WiringChecks:
        """What can be tried of the wiring of its campaign."""
        return WiringChecks()
