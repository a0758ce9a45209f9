"""What every look at a campaign begins with: its findings, its distinct records, its problem."""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Annotated

from carrierflex.diagnosis.baseline_check import BaselineCheck, checked_baseline, with_findings
from carrierflex.diagnosis.classes.results import ClassAnswer
from carrierflex.diagnosis.comparison.problem import Effects
from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.diagnosis.fault_beside_classes import fault_beside_classes, late_columns
from carrierflex.diagnosis.inference.effect_fit import EffectFit, fit_effects, mean_square_left
from carrierflex.diagnosis.inference.results import AT_NOISE_FLOOR
from carrierflex.diagnosis.inference.thresholds import Thresholds
from carrierflex.diagnosis.kind.comparison_problem import ComparisonProblem
from carrierflex.diagnosis.kinds import Curves, problem_of
from carrierflex.diagnosis.results import Diagnosis
from carrierflex.diagnosis.wiring.refits import (
    Fault,
    GapSquare,
)
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign_check.campaign_warning import CampaignWarning
from carrierflex.identification.campaign_check.copies import copied_runs, without_copies
from carrierflex.identification.campaign_check.probe_angles import ProbeAngle, probe_angles
from carrierflex.identification.campaign_check.records_check import records_findings
from carrierflex.simulation.laws import Law


@dataclass(frozen=True, eq=False)
class ExaminedCampaign:
    """A campaign whose records were looked at, ready to be compared with its baseline."""

    distinct: Annotated[Campaign, "Every record once"]
    probes: Annotated[tuple[ProbeAngle, ...], "Where the probes of a carrier stand"]
    warnings: Annotated[tuple[CampaignWarning, ...], "What the records say by themselves"]
    problem: Annotated[ComparisonProblem, "Records, simulator and library"]
    problem_of: Annotated[
        Callable[[Campaign], ComparisonProblem], "``(campaign) -> problem`` of other records of it"
    ]

    def baseline(
        self, fit: EffectFit | None = None, laws: Effects = (), shapes: Sequence[Law] = ()
    ) -> BaselineCheck:
        """Findings with the baseline; its `fit`, and `laws` that a diagnosis holds likely.

        `shapes` are the measured ones of its classes, which take the place of laws.
        """
        wiring = self.problem.wiring(self.distinct)
        return checked_baseline(self.problem, self.distinct, wiring, fit, laws, shapes)

    def findings(self) -> tuple[CampaignWarning, ...]:
        """What does not look right in the records, alone and beside the baseline."""
        fit = fit_effects(self.problem, ())
        gap = GapSquare(mean_square_left(self.problem, fit), self.problem.noise_floor_square)
        baseline = self._with_fault_beside_classes(
            self.baseline(fit), self.problem.class_answer, gap
        )
        # An effect that grows with the motion is largest there; a diagnosis weighs both.
        largest = (Fault.RUN, baseline.largest_run)
        others = (one for one in baseline.warnings if (one.id, one.about) != largest)
        return (*self.warnings, *others)

    def _with_fault_beside_classes(
        self,
        baseline: BaselineCheck,
        answer: Callable[[], ClassAnswer | None],
        gap: GapSquare,
        explained: float = 0.0,
    ) -> BaselineCheck:
        """Findings with the fault that explains the gap with a class, where one does."""
        faults = [*late_columns(self.distinct), *baseline.half]
        if not faults:
            return baseline
        best = fault_beside_classes(faults, answer(), gap, self.problem_of, explained=explained)
        return baseline if best is None else baseline.with_rival(*best)

    def diagnosis(
        self,
        findings: Sequence[CampaignWarning] = (),
        *,
        note: Callable[[str], None] = lambda text: None,
        executor: Executor | None = None,
        seed: int = 0,
    ) -> Diagnosis:
        """Where the gap lies and which effect is missing, with what does not look right.

        `findings` are told with those of the records and of the baseline; the options are those of
        :meth:`compared`.
        """
        compared = self.compared(note=note, executor=executor, seed=seed)
        return self.checked(compared, findings)

    def compared(
        self,
        *,
        note: Callable[[str], None] = lambda text: None,
        executor: Executor | None = None,
        seed: int = 0,
    ) -> Diagnosis:
        """Diagnosis of the records as they stand.

        `note` hears of the progress, `executor` fits sets of effects elsewhere, and `seed` is that
        of the bootstrap.
        """
        return diagnose(
            self.problem,
            campaign=self.distinct.name,
            kind=self.distinct.kind,
            floor_is_measured=self.problem.noise_is_measured,
            thresholds=Thresholds(seed=seed),
            note=note,
            executor=executor,
        )

    def checked(self, compared: Diagnosis, findings: Sequence[CampaignWarning] = ()) -> Diagnosis:
        """A diagnosis of these records with what does not look right in them."""
        # Laws that are named, nearest to a named class, or in the best set that was tried. The
        # nearest law of a class may be one that no simulator has.
        which, classes = compared.attribution, compared.classes
        nearest = [finding.law for finding in classes.classes] if classes else []
        best = [law for ranked in which.ranking[:1] for law in ranked.effects]
        likely = dict.fromkeys((*which.effects, *nearest, *best))
        laws = tuple(law for law in likely if law in self.problem.cards)
        answer = None if which.effects else classes
        shapes = answer.shapes if answer else ()
        baseline = self.baseline(compared.baseline, laws, shapes)
        reduction = compared.reduction
        if reduction is not None and compared.verdict != AT_NOISE_FLOOR:
            fit = compared.baseline or fit_effects(self.problem, ())
            before = mean_square_left(self.problem, fit)
            gap = GapSquare(before, self.problem.noise_floor_square)
            baseline = self._with_fault_beside_classes(
                baseline, lambda: compared.classes, gap, reduction.phi
            )
        return with_findings(compared, (*self.warnings, *findings), baseline)


def examined(
    campaign: Campaign, curves: Curves | None = None, laws: Sequence[Law] = ()
) -> ExaminedCampaign:
    """Look at the records of a campaign and make its comparison problem.

    Parameters
    ----------
    campaign : Campaign
        Measured runs.
    curves : mapping of str to DeflectionCurve, optional
        Deflection curves, which kind carrier asks for.
    laws : sequence of Law
        Laws of files, further candidates.

    Returns
    -------
    ExaminedCampaign
        Findings, records and problem.

    Raises
    ------
    ValueError
        Where the campaign is refused.
    """
    copies = copied_runs(campaign)
    probes = probe_angles(campaign) if campaign.kind == "carrier" else ()
    warnings = records_findings(campaign, curves, copies, probes)
    distinct = without_copies(campaign, copies)
    problem = problem_of(distinct, curves, laws)
    return ExaminedCampaign(
        distinct,
        probes,
        warnings,
        problem,
        lambda other: problem_of(other, curves, laws),
    )
