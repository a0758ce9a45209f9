"""Tell where a campaign's gap to its simulation lies, which effect is missing, how far it shrinks.

Writes diagnosis.json and report.html. A good answer: a verdict whose held-out shrink interval
excludes one, a negative control that does not shrink the gap, and a remaining gap near the noise
floor; "none of these" and "not diagnosable" are answers too.
"""

from datetime import datetime
from pathlib import Path

from threadpoolctl import threadpool_limits

from carrierflex.diagnosis.baseline_check import checked_baseline, with_findings
from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.diagnosis.kinds import problem_of, wiring_of
from carrierflex.diagnosis.report.diagnosis_files import (
    DIAGNOSIS_FILE,
    write_diagnosis,
    write_report,
)
from carrierflex.diagnosis.report.page import ReportSource, report_page
from carrierflex.diagnosis.results import Diagnosis
from carrierflex.fe.curve_files import read_curves
from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.files.versions import versions
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.campaign_files import read_campaign
from carrierflex.identification.campaign_check.copies import without_copies
from carrierflex.identification.campaign_check.records_check import records_findings
from carrierflex.workflows.support.default_curves import default_curves
from carrierflex.workflows.support.outputs import prepared_folder
from carrierflex.workflows.support.progress import Stages

REPORT_FILE = "report.html"


def main(campaign: Path, *, out: Path, report: bool = True, quiet: bool = False) -> Diagnosis:
    """Diagnose the gap between a measurement campaign and its baseline simulation.

    Parameters
    ----------
    campaign : Path
        Campaign folder.
    out : Path
        Folder for diagnosis.json and report.html, which need no network to be read.
    report : bool
        Draw report.html; without, one of an earlier diagnosis goes.
    quiet : bool
        Show no progress.

    Returns
    -------
    Diagnosis
        Verdict, effects with parameters, and how far the gap shrinks on held-out records.

    Raises
    ------
    ValueError
        Where the campaign is refused.
    OSError
        Where `out` cannot be written.
    """
    # Small matrices in long loops: on a busy machine the threads of a parallel product wait for
    # each other ten times longer.
    with threadpool_limits(limits=1):
        return _diagnosed(campaign, out, Stages(4, quiet), report=report)


def _diagnosed(campaign: Path, out: Path, stages: Stages, *, report: bool) -> Diagnosis:
    with stages.stage(f"reading {campaign}"):
        measured = read_campaign(campaign)
        curves = campaign_curves(measured, campaign)
        warnings = records_findings(measured, curves)
    for note in measured.notes:
        stages.tell(note)
    with stages.stage("signals and noise floor"):
        distinct = without_copies(measured)
        problem, floor_is_measured = problem_of(distinct, curves)
    prepared_folder(out)
    with stages.stage("which effect, and how far"):
        diagnosis = diagnose(
            problem,
            campaign=measured.name,
            kind=measured.kind,
            floor_is_measured=floor_is_measured,
            note=stages.note,
        )
        diagnosis = with_findings(
            diagnosis, warnings, checked_baseline(problem, distinct, wiring_of(problem, distinct))
        )
    with stages.stage(f"writing {out / (REPORT_FILE if report else DIAGNOSIS_FILE)}"):
        write_diagnosis(out / DIAGNOSIS_FILE, diagnosis)
        if not report:
            (out / REPORT_FILE).unlink(missing_ok=True)
            return diagnosis
        written = f"{datetime.now():%Y-%m-%d %H:%M}"
        source = ReportSource(measured, str(campaign), versions(), written)
        write_report(out / REPORT_FILE, report_page(diagnosis, source))
    return diagnosis


def campaign_curves(campaign: Campaign, folder: Path) -> dict[str, DeflectionCurve] | None:
    """Deflection curves of a carrier: the campaign's own, or the default carrier's."""
    if campaign.kind != "carrier":
        return None
    if "deflection_curves" in campaign.rig:
        return read_curves(folder / campaign.rig["deflection_curves"])
    return default_curves()
