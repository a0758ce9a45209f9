"""What every look at a campaign begins with: its findings, its distinct records, its problem."""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial

from threadpoolctl import threadpool_limits

from carrierflex.diagnosis.baseline_check import BaselineCheck, checked_baseline, with_findings
from carrierflex.diagnosis.comparison.problem import ComparisonProblem
from carrierflex.diagnosis.diagnose import diagnose, verdict_alone
from carrierflex.diagnosis.inference.confusion.draws import confusion
from carrierflex.diagnosis.inference.confusion.results import Answer, Confusion
from carrierflex.diagnosis.inference.effect_fit import EffectFit
from carrierflex.diagnosis.inference.thresholds import Thresholds
from carrierflex.diagnosis.kinds import Curves, problem_of, residuals_of, wiring_of
from carrierflex.diagnosis.results import Diagnosis
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign_check.campaign_warning import CampaignWarning
from carrierflex.identification.campaign_check.copies import copied_runs, without_copies
from carrierflex.identification.campaign_check.records_check import records_findings
from carrierflex.simulation.laws import Law


@dataclass(frozen=True, eq=False)
class ExaminedCampaign:
    """A campaign whose records were looked at, ready to be compared with its baseline.

    Parameters
    ----------
    distinct : Campaign
        Every record once.
    warnings : tuple of CampaignWarning
        What the records say by themselves.
    problem : ComparisonProblem
        Records, simulator and library.
    floor_is_measured : bool
        Whether the noise floor was declared or comes from repeats.
    curves : mapping of str to DeflectionCurve, optional
        Deflection curves.
    laws : tuple of Law
        Laws of files.
    """

    distinct: Campaign
    warnings: tuple[CampaignWarning, ...]
    problem: ComparisonProblem
    floor_is_measured: bool
    curves: Curves | None = None
    laws: tuple[Law, ...] = ()

    def baseline(self, fit: EffectFit | None = None) -> BaselineCheck:
        """Findings with the baseline; `fit` where a diagnosis made it already."""
        wiring = wiring_of(self.problem, self.distinct)
        return checked_baseline(self.problem, self.distinct, wiring, fit)

    def diagnosis(
        self,
        findings: Sequence[CampaignWarning] = (),
        *,
        note: Callable[[str], None] = lambda text: None,
        executor: Executor | None = None,
        seed: int = 0,
    ) -> Diagnosis:
        """Where the gap lies and which effect is missing, with what does not look right.

        `findings` are told with those of the records and of the baseline, `note` hears of the
        progress, `executor` fits sets of effects elsewhere, and `seed` is that of the bootstrap.
        """
        found = self.inference(note=note, executor=executor, seed=seed)
        return self.checked(found, findings)

    def inference(
        self,
        *,
        note: Callable[[str], None] = lambda text: None,
        executor: Executor | None = None,
        seed: int = 0,
    ) -> Diagnosis:
        """What the records and the simulator say; their wiring is taken as it is."""
        return diagnose(
            self.problem,
            campaign=self.distinct.name,
            kind=self.distinct.kind,
            floor_is_measured=self.floor_is_measured,
            thresholds=Thresholds(seed=seed),
            note=note,
            executor=executor,
        )

    def checked(self, found: Diagnosis, findings: Sequence[CampaignWarning] = ()) -> Diagnosis:
        """Result of :meth:`inference` with what does not look right, `findings` among it."""
        baseline = self.baseline(found.baseline)
        return with_findings(found, (*self.warnings, *findings), baseline)

    def confusion(
        self,
        found: Diagnosis,
        *,
        note: Callable[[str, float], None] = lambda text, share: None,
        executor: Executor | None = None,
        seed: int = 0,
    ) -> Confusion | None:
        """How often the answer of :meth:`inference` comes up where each candidate is true."""
        if found.evidence is None:
            return None
        return confusion(
            self.distinct,
            found.evidence,
            found.answer,
            residuals=partial(residuals_of, self.problem, self.distinct),
            answered=partial(_answer, curves=self.curves, laws=self.laws, seed=seed),
            seed=seed,
            note=note,
            executor=executor,
        )


def _answer(campaign: Campaign, curves: Curves | None, laws: Sequence[Law], seed: int) -> Answer:
    """Answer to a simulated campaign, in another process too."""
    with threadpool_limits(limits=1):
        problem, floor_is_measured = problem_of(campaign, curves, laws)
        return verdict_alone(
            problem,
            campaign=campaign.name,
            kind=campaign.kind,
            floor_is_measured=floor_is_measured,
            thresholds=Thresholds(seed=seed),
        ).answer


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
    warnings = records_findings(campaign, curves, copies)
    distinct = without_copies(campaign, copies)
    problem, floor_is_measured = problem_of(distinct, curves, laws)
    return ExaminedCampaign(distinct, warnings, problem, floor_is_measured, curves, tuple(laws))
