"""Tell where a campaign's gap to its simulation lies, which effect is missing, how far it shrinks.

Writes diagnosis.json, report.html and what that page is drawn from, and with --save-law the
measured shape of the class found, which --law takes as a candidate of another diagnosis. A good
answer: a verdict whose held-out shrink interval excludes one, and a remaining gap near the noise
floor; "none of these" and "not diagnosable" are answers too.
"""

from __future__ import annotations

import ctypes
import functools
import gc
import time
from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from carrierflex.fe.curve_files import causes_of, read_curves, read_derivatives
from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.files.json_files import save_text
from carrierflex.files.versions import versions
from carrierflex.files.whole_files import (
    check_file_writable,
    refuse_foreign,
    refuse_foreign_files,
)
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.campaign_files import read_campaign
from carrierflex.identification.campaign.campaign_part import campaign_part
from carrierflex.identification.campaign.declarations import CURVES, TOLERANCES
from carrierflex.identification.campaign.record_digests import record_digests
from carrierflex.identification.estimation.single_thread import single_threaded
from carrierflex.workflows.executors import work_executor
from carrierflex.workflows.fe.default_curves import (
    MESH_ERROR_FILE,
    default_curves,
    with_derivatives,
    with_mesh_error,
)
from carrierflex.workflows.outputs import prepared_folder
from carrierflex.workflows.progress import Stages
from carrierflex.workflows.view3d.view import viewer_library
from carrierflex.workflows.view3d.view_file import VIEW_FILE, write_view

if TYPE_CHECKING:
    from carrierflex.diagnosis.results import Diagnosis
    from carrierflex.simulation.laws import Law
    from carrierflex.workflows.view3d.rim_motion_files import RimMotion

REPORT_FILE = "report.html"

#: Classes whose measured shape is kept as a table.
LawClass = Literal[
    "restoring_force",
    "dissipation",
    "coupled_damping",
    "housing/offset",
    "housing/tilt",
    "housing/saddle",
    "housing/planet_pass",
    "housing/load_sharing",
    "carrier/tilt",
    "carrier/waves",
    "carrier/load_sharing",
]


def main(
    campaign: Path,
    *,
    out: Path,
    law: list[Path] | None = None,
    save_law: Path | None = None,
    law_class: LawClass | None = None,
    baseline: list[str] | None = None,
    effects: list[str] | None = None,
    channels: list[str] | None = None,
    runs: list[str] | None = None,
    seed: int = 0,
    report: bool = True,
    view: bool = False,
    workers: int = 1,
    scheduler: str | None = None,
    quiet: bool = False,
) -> Diagnosis:
    """Diagnose the gap between a measurement campaign and its baseline simulation.

    Parameters
    ----------
    campaign : Path
        Campaign folder.
    out : Path
        Folder to write: diagnosis.json, report.html and report.json.

        report.html needs no network; carrierflex report draws it again from report.json.
    law : list of Path, optional
        Law files (TOML) of --save-law: further candidates.

        From campaigns of the same kind; may be given several times. Units of an element's law (of
        force and deflection, time in s) are those of the campaign.
    save_law : Path, optional
        File (TOML) for the measured shape of the class found.

        Kinds element and mounting (of the bushings): restoring force f(x) [N over m], dissipation
        g(v) [N over m/s] or coupled damping h(x) [N s/m over m], in the units of the campaign. Kind
        carrier: amplitudes of the pattern's waves [m] over torque [N m], radial load [N] or time.
        Other classes are refused by name.
    law_class : str, optional
        Class whose shape --save-law writes; default: the largest.

        Of a carrier: frame and pattern. The default is the class with the largest share.
    baseline : list of str, optional
        Effects of the baseline, instead of campaign.toml's.

        May be given several times.
    effects : list of str, optional
        Effects that are candidates; default: all.

        May be given several times.
    channels : list of str, optional
        Channels that are used; default: all.

        May be given several times.
    runs : list of str, optional
        Runs that are used; default: all.

        May be given several times.
    seed : int
        Seed of the bootstrap samples, 0 or more.

        For the intervals of rho and phi, and for the rule that an effect must shrink the gap in
        97.5 % of the samples. Another seed moves the ends of intervals by some per cent of their
        width, a sixth with four conditions; treat a verdict that changes with it as unreliable.
    report : bool
        Draw report.html.

        In kind carrier also rim_motion.json, the mean turn of every sensor in every run.
        --no-report removes those of an earlier diagnosis; carrierflex report draws the page later.
    view : bool, optional
        Write view.html too: the rim in space (kind carrier).

        report.html links to this page of carrierflex view, with the gap in colour (1.5 MB, needs
        carrierflex[view]).
    workers : int
        Processes in which sets of effects are fitted.

        Every number stays the same.
    scheduler : str, optional
        Address of a Dask scheduler (tcp://host:8786) instead.
    quiet : bool
        Show no progress.

    Returns
    -------
    Diagnosis
        Verdict, effects with parameters, and how far the gap shrinks on held-out records.

    Raises
    ------
    ValueError
        Where the campaign or a law file is refused, or the class found has no table to save; then
        the diagnosis is written and no law.
    OSError
        Where `out` or `save_law` cannot be written.
    """
    _refuse(seed, save_law, law_class, view=view, report=report)
    refuse_foreign_files(marks_of_diagnosis(out))

    from carrierflex.simulation.law_files import read_law

    brought = tuple(read_law(path) for path in law or ())
    stages = Stages(4, quiet)
    with single_threaded(), work_executor(workers, scheduler) as executor:
        with stages.stage(f"reading {campaign}"):
            measured = campaign_part(
                read_campaign(campaign),
                runs=runs or (),
                channels=channels or (),
                baseline=baseline,
                effects=effects or (),
            )
            curves = campaign_curves(measured, campaign)
            measured = with_stage_baseline(measured, campaign, executor, stages)

        from carrierflex.workflows.view3d.rim_motion_files import rim_motion
        from carrierflex.workflows.view3d.rim_scene import rim_scene

        # What is imported and read by now is no garbage to look for below.
        gc.freeze()
        try:
            diagnosis = _diagnosed(measured, curves, brought, out, stages, executor, seed)
            # Sums and order amplitudes of hundreds of runs take 0.5 GB; what is written is found. A
            # problem and the results that it keeps point to one another.
            gc.collect()
        finally:
            gc.unfreeze()
        _return_freed_memory()
        diagnosis = replace(diagnosis, records=record_digests(measured, campaign))
        motion = rim_motion(diagnosis, measured) if report else None
        if view and motion is None:
            stages.tell(f"no {VIEW_FILE}: only a carrier that was diagnosed has a rim")
        _write(diagnosis, measured, campaign, out, stages, report=report, motion=motion, view=view)
        if view and motion is not None:
            with stages.stage(f"writing {out / VIEW_FILE}"):
                write_view(rim_scene(motion), out / VIEW_FILE)
    if save_law is not None:
        _save_law(save_law, diagnosis, measured, law_class)
    return diagnosis


def _refuse(
    seed: int, save_law: Path | None, law_class: LawClass | None, *, view: bool, report: bool
) -> None:
    """Refuse options that contradict each other, and what cannot be written, before the work."""
    if seed < 0:
        raise ValueError(f"--seed is {seed}; expected a whole number >= 0")
    if view and not report:
        raise ValueError("--view belongs to the report; expected it without --no-report")
    if view:
        viewer_library()
    if law_class is not None and save_law is None:
        raise ValueError("--law-class without --save-law; expected the file to save the law in")
    if save_law is not None:
        check_file_writable(save_law)
        refuse_foreign(save_law, 'format = "carrierflex-')


def marks_of_diagnosis(out: Path) -> dict[Path, str]:
    """Files that a diagnosis writes or removes, and words by which they are of this program."""
    from carrierflex.diagnosis.report.diagnosis_files import DIAGNOSIS_FILE, FORMAT
    from carrierflex.workflows.diagnosis.report_files import REPORT_DATA_FILE
    from carrierflex.workflows.view3d.rim_motion_files import RIM_MOTION_FILE

    return {
        out / DIAGNOSIS_FILE: f'"{FORMAT}"',
        out / REPORT_DATA_FILE: '"carrierflex-',
        out / RIM_MOTION_FILE: '"carrierflex-',
        out / REPORT_FILE: "carrierflex",
        out / VIEW_FILE: "carrierflex",
    }


def _diagnosed(
    measured: Campaign,
    curves: dict[str, DeflectionCurve] | None,
    laws: tuple[Law, ...],
    out: Path,
    stages: Stages,
    executor: Executor,
    seed: int,
) -> Diagnosis:
    """What the records say, with what does not look right in them."""
    from carrierflex.workflows.diagnosis.examination import examined

    for note in measured.notes:
        stages.tell(note)
    with stages.stage("signals and noise floor"):
        examination = examined(measured, curves, laws)
    _return_freed_memory()
    beyond = tuple(warning for law in laws for warning in examination.problem.beyond_visited(law))
    for warning in beyond:
        stages.tell(f"law '{warning.about}': {warning.text}")
    prepared_folder(out)
    progress = _returning_freed_memory(stages.note)
    with stages.stage("which effect explains it, and how much"):
        return examination.diagnosis(beyond, note=progress, executor=executor, seed=seed)


def _write(
    diagnosis: Diagnosis,
    measured: Campaign,
    folder: Path,
    out: Path,
    stages: Stages,
    *,
    report: bool,
    motion: RimMotion | None,
    view: bool,
) -> None:
    from carrierflex.diagnosis.report.diagnosis_files import DIAGNOSIS_FILE, write_diagnosis
    from carrierflex.diagnosis.report.page import report_page
    from carrierflex.diagnosis.report.report_data import ReportSource, report_data
    from carrierflex.workflows.diagnosis.report_files import REPORT_DATA_FILE, write_report_data
    from carrierflex.workflows.view3d.rim_motion_files import RIM_MOTION_FILE, write_rim_motion

    with stages.stage(f"writing {out / (REPORT_FILE if report else DIAGNOSIS_FILE)}"):
        write_diagnosis(out / DIAGNOSIS_FILE, diagnosis)
        # That of the diagnosis that was replaced shows another gap.
        (out / VIEW_FILE).unlink(missing_ok=True)
        if report and motion is not None:
            n_written = len({signal.run for signal in motion.signals})
            if n_written < len(measured.runs):
                stages.tell(f"{RIM_MOTION_FILE} holds {n_written} of {len(measured.runs)} runs")
            write_rim_motion(out / RIM_MOTION_FILE, motion)
        else:
            (out / RIM_MOTION_FILE).unlink(missing_ok=True)
        written = f"{datetime.now():%Y-%m-%d %H:%M}"
        source = ReportSource(
            str(folder),
            versions(),
            written,
            view=VIEW_FILE if motion and view else "",
            view_command=f"carrierflex view {out} --html" if motion else "",
        )
        data = report_data(diagnosis, measured, source)
        write_report_data(out / REPORT_DATA_FILE, data)
        if not report:
            (out / REPORT_FILE).unlink(missing_ok=True)
            return
        save_text(out / REPORT_FILE, report_page(data))


def _save_law(path: Path, diagnosis: Diagnosis, measured: Campaign, law_class: str | None) -> None:
    """Write the measured shape of the class found."""
    from carrierflex.diagnosis.inference.results import NAMED, NAMED_WITH_REMAINDER
    from carrierflex.diagnosis.kinds import saved_law
    from carrierflex.simulation.law_files import write_law

    if diagnosis.classes is None:
        raise ValueError(f"{path}: no law to save: the records give no answer by class")
    try:
        # Beside a class that only its shape explains, a named law was fitted without that shape.
        is_named = diagnosis.verdict in (NAMED, NAMED_WITH_REMAINDER)
        values = {
            effect: {name: value.value for name, value in named.items()}
            for effect, named in diagnosis.attribution.parameters.items()
            if is_named
        }
        law = saved_law(measured, diagnosis.classes, law_class, values)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    write_law(path, law)


def campaign_curves(campaign: Campaign, folder: Path) -> dict[str, DeflectionCurve] | None:
    """Deflection curves of a carrier: the campaign's own, or the default carrier's."""
    return curves_of_rig(campaign.rig, folder) if campaign.kind == "carrier" else None


def with_stage_baseline(
    campaign: Campaign,
    folder: Path,
    executor: Executor | None,
    stages: Stages,
    planned: Callable[[], Campaign] | None = None,
) -> Campaign:
    """Campaign with what its stage predicts; as it is where its baseline is no stage.

    `planned` gives the campaign with what could be added to it, which the causes then cover.
    """
    if campaign.baseline.source != "stage":
        return campaign

    from carrierflex.workflows.diagnosis.stage_baseline import with_stage

    return with_stage(campaign, folder, planned=planned, executor=executor, note=stages.note)


def curves_of_rig(rig: Mapping[str, Any], folder: Path) -> dict[str, DeflectionCurve]:
    """Deflection curves that the rig of a carrier campaign in `folder` states."""
    path = folder / rig["deflection_curves"] if "deflection_curves" in rig else None
    curves = (
        with_mesh_error(read_curves(path), path.with_name(MESH_ERROR_FILE))
        if path
        else default_curves()
    )
    if TOLERANCES not in rig:
        return curves
    derivatives = read_derivatives(path) if path else {}
    curves = {**curves, **derivatives} if derivatives else with_derivatives(curves)
    known = causes_of(curves)
    unknown = [name for name in rig[TOLERANCES] if name not in (*known, CURVES)]
    if unknown:
        raise ValueError(
            f"campaign.toml: [rig.tolerances]: unknown key '{unknown[0]}'; expected "
            f"{', '.join(known)} or {CURVES}"
        )
    return curves


def _return_freed_memory() -> None:
    """Give freed memory back to the system, where its C library can.

    The GNU C library keeps what was freed between arrays that live, for the next ones; long work on
    large records frees arrays of all sizes.
    """
    trim = _trim()
    if trim is not None:
        trim(0)


def _returning_freed_memory(note: Callable[[str], None]) -> Callable[[str], None]:
    """Progress that gives freed memory back between steps, every ten seconds at most.

    Each time takes some hundredths of a second.
    """
    last = time.monotonic()

    def noted(text: str) -> None:
        nonlocal last
        note(text)
        if time.monotonic() - last > 10.0:
            _return_freed_memory()
            last = time.monotonic()

    return noted


@functools.cache
def _trim() -> Callable[[int], int] | None:
    """``malloc_trim`` of the GNU C library; None with another."""
    try:
        trim: Callable[[int], int] = ctypes.CDLL(None).malloc_trim
    except (AttributeError, OSError, TypeError):
        return None
    return trim
