"""What the report page is drawn from: the answer without records and maps, and the curves."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np

from carrierflex.diagnosis.comparison.overlay import Overlay, Picture, SignalComparison, Trace
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.inference.results import GapReduction
from carrierflex.diagnosis.report.figures import GapGrid, gap_grids, stretch_of
from carrierflex.diagnosis.results import Diagnosis
from carrierflex.files.versions import software_name
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import Channel
from carrierflex.identification.campaign.run_levels import run_levels


@dataclass(frozen=True, eq=False)
class RunOutline:
    """A run without its records."""

    name: Annotated[str, "Name"]
    file: Annotated[str, "File in the campaign folder"]
    condition: Annotated[str, "Condition"]
    samples: Annotated[int, "Number of samples"]
    seconds: Annotated[float, "Duration [s]"]
    levels: Annotated[
        Mapping[str, float], "Loads, speed and amplitude, by name and unit ``torque [kN m]``"
    ]


@dataclass(frozen=True, eq=False)
class CampaignOutline:
    """A campaign without its records."""

    kind: Annotated[str, "Kind"]
    rig: Annotated[Mapping[str, Any], "Nominal facts of the rig"]
    channels: Annotated[tuple[Channel, ...], "Measured signals"]
    runs: Annotated[tuple[RunOutline, ...], "Runs"]
    source: Annotated[str, "``model`` or ``columns``: where the baseline comes from"]
    effects: Annotated[tuple[str, ...], "Effects that the baseline contains"]


@dataclass(frozen=True, eq=False)
class ReportSource:
    """Where a report comes from."""

    folder: Annotated[str, "Folder of the campaign"]
    versions: Annotated[Mapping[str, str], "Versions of what can change a result"]
    written: Annotated[str, "Date and time"]
    view: Annotated[str, "3-D page in the report's folder; empty where none is written"] = ""
    view_command: Annotated[str, "Command that writes it; empty where there is no motion"] = ""


@dataclass(frozen=True, eq=False)
class ReportData:
    """All that a report page shows."""

    diagnosis: Annotated[Diagnosis, "Answer, without records, maps and measured laws"]
    campaign: Annotated[CampaignOutline, "What was measured"]
    source: Annotated[ReportSource, "Where it comes from"]
    software: Annotated[str, "Name and version of the program that made the diagnosis"]
    has_measured_law: Annotated[bool, "Whether a measured shape can be saved as a law"]
    sizes: Annotated[
        Mapping[str, tuple[float, float]], "RMS of the gap before and after, by channel"
    ]
    grids: Annotated[tuple[GapGrid, ...], "Gap maps before and after; empty where there is none"]


def report_data(diagnosis: Diagnosis, campaign: Campaign, source: ReportSource) -> ReportData:
    """What a report page shows of a diagnosis."""
    far, classes, signals = diagnosis.reduction, diagnosis.classes, diagnosis.signals
    law = diagnosis.reduction_law
    findings = classes.classes if classes is not None else ()
    without_laws = tuple(replace(one, measured_law=None) for one in findings)
    shown = replace(
        diagnosis,
        reduction=far and _without_maps(far),
        reduction_law=_without_maps(law) if law is not None and law is not far else None,
        classes=classes and replace(classes, classes=without_laws),
        baseline=None,
        signals=signals and _largest_run(signals),
        pictures=tuple(_drawn(picture) for picture in diagnosis.pictures),
    )
    return ReportData(
        diagnosis=shown,
        campaign=_outline(campaign),
        source=source,
        software=software_name(),
        has_measured_law=any(one.measured_law is not None for one in findings),
        sizes=signals.by_channel() if signals else {},
        grids=gap_grids(far.cells_before, far.cells_after) if far else (),
    )


def _without_maps(reduction: GapReduction) -> GapReduction:
    return replace(reduction, cells_before=(), cells_after=(), blocks=())


def _largest_run(signals: SignalComparison) -> SignalComparison:
    """Signals of the run with the largest gap, that first, each no longer than it is drawn."""
    largest = signals.before[signals.largest]
    stretch = stretch_of(largest)

    def of_run(overlays: Sequence[Overlay]) -> tuple[Overlay, ...]:
        """Overlays of the run."""
        chosen = [one for one in overlays if one.run == largest.run]
        chosen.sort(key=lambda one: one.channel != largest.channel)
        return tuple(
            replace(
                one,
                x=_rounded(one.x[stretch]),
                measured=_rounded(one.measured[stretch]),
                simulated=_rounded(one.simulated[stretch]),
            )
            for one in chosen
        )

    return SignalComparison(of_run(signals.before), of_run(signals.after))


def _drawn(picture: Picture) -> Picture:
    """Picture with no more digits than are drawn."""

    def drawn(trace: Trace) -> Trace:
        shade = None if trace.shade is None else _rounded(trace.shade)
        return Trace(trace.role, _rounded(trace.x), _rounded(trace.y), shade)

    panels = (replace(one, traces=tuple(map(drawn, one.traces))) for one in picture.panels)
    return replace(picture, panels=tuple(panels))


def _rounded(values: FloatArray) -> FloatArray:
    return np.array([float(f"{value:.{5}g}") for value in values])


def _outline(campaign: Campaign) -> CampaignOutline:
    runs = tuple(
        RunOutline(
            run.name,
            run.file,
            run.condition,
            int(run.time.size),
            float(run.time[-1] - run.time[0]),
            run_levels(campaign, run),
        )
        for run in campaign.runs
    )
    baseline = campaign.baseline
    return CampaignOutline(
        campaign.kind, campaign.rig, campaign.channels, runs, baseline.source, baseline.effects
    )
