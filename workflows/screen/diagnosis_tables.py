"""Diagnosis, comparison, campaign check, plan and blind check as tables on the screen."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Group, RenderableType

from carrierflex.blind_check.scoring.result import BlindCheck, ExportedCheck
from carrierflex.diagnosis.inference.planning.results import CampaignPlan, first_sentences
from carrierflex.diagnosis.inference.results import GapReduction, NamedValue
from carrierflex.diagnosis.report.gap_words import where_text
from carrierflex.diagnosis.report.words import ratio
from carrierflex.diagnosis.results import Diagnosis
from carrierflex.files.quantities import number, sized
from carrierflex.identification.campaign_check.probe_angles import ProbeAngle
from carrierflex.identification.estimation.resampling import NORMAL_95
from carrierflex.workflows.diagnosis.fleet_sizes import shown_size, size_name
from carrierflex.workflows.diagnosis.gap_change import (
    GapChange,
    causes_sentence,
    cells_sentence,
    first_sentence,
)
from carrierflex.workflows.diagnosis.record_difference import (
    RecordDifference,
    difference_sentence,
    size_cells,
    verdict_sentence,
)
from carrierflex.workflows.diagnosis.score_page import score_sections
from carrierflex.workflows.fleet.fleet import FleetDiagnosis
from carrierflex.workflows.fleet.fleet_page import causes_of, fleet_sentences
from carrierflex.workflows.fleet.watch_page import state_sentence
from carrierflex.workflows.fleet.watch_result import WatchResult
from carrierflex.workflows.screen.titled_table import titled_table

if TYPE_CHECKING:
    from carrierflex.workflows.diagnosis.calibrate_campaign import Calibration, PutIn
    from carrierflex.workflows.diagnosis.check_campaign import CampaignCheck
    from carrierflex.workflows.diagnosis.write_report import WrittenReport

_MOST_ROWS = 20
#: Additions of a plan that are shown.
_MOST_ADDITIONS = 8


def check_table(check: "CampaignCheck") -> RenderableType:
    """Findings about a campaign, one row each: what, where, what to do."""
    rows = [
        (warning.about, warning.text, warning.remedy, warning.line) for warning in check.warnings
    ]
    table = titled_table(
        f"check of {check.campaign}",
        *("about", "finding", "remedy", "line"),
        rows=rows or [("-", "no findings", "", "")],
        folded=(1, 2, 3),
    )
    return Group(table, _probe_table(check.probes)) if check.probes else table


def _probe_table(probes: Sequence[ProbeAngle]) -> RenderableType:
    """Where the probes of a carrier stand; blank where order 1 is too small to read it."""
    return titled_table(
        "probes, read from the phase of order 1 relative to the first",
        *("probe", "declared [deg]", "read [deg]", "sign", "gain"),
        rows=[
            (
                probe.channel,
                f"{probe.declared_deg:.1f}",
                ""
                if probe.read_deg is None
                else f"{probe.read_deg:.1f} ± {probe.interval_deg:.1f}",
                {1: "+", -1: "-", None: ""}[probe.sign],
                "" if probe.gain is None else f"{probe.gain:.3f}",
            )
            for probe in probes
        ],
    )


def _value_text(named: NamedValue) -> str:
    if not np.isfinite(named.std):
        return "not determined by these records"
    unit = "" if named.unit == "1" else f" {named.unit}"
    if named.std == 0.0:
        return f"{named.value:.5g}{unit}, held"
    return f"{named.value:.5g} ± {NORMAL_95 * named.std:.2g}{unit}"


def _reduction_rows(reduction: GapReduction, unit: str) -> list[tuple[str, str]]:
    """How far the gap shrinks, by quantity."""
    sizes = (reduction.rms_before, reduction.rms_after, reduction.noise_floor)
    return [
        ("RMS before, after, floor", ", ".join(f"{size:.4g}" for size in sizes) + f" {unit}"),
        ("rho, 95 %", _with_interval(reduction.rho, reduction.rho_ci95)),
        ("phi, 95 %", _with_interval(reduction.phi, reduction.phi_ci95)),
        ("rho of extrapolation", ratio(reduction.extrapolation_rho)),
    ]


def _with_interval(value: float, ci95: tuple[float, float]) -> str:
    return f"{value:.4f} [{ci95[0]:.4f}, {ci95[1]:.4f}]"


def diagnosis_table(diagnosis: Diagnosis) -> RenderableType:
    """Verdict, where, which and how far."""
    reduction = diagnosis.reduction
    which = diagnosis.attribution
    rows = [
        ("verdict", diagnosis.verdict),
        ("reason", diagnosis.reason),
        ("where", where_text(diagnosis)),
    ]
    rows += [("effects", ", ".join(which.effects) or "none")]
    rows += [("aliases", " = ".join(members)) for members in which.aliases]
    for effect, values in which.parameters.items():
        rows += [(f"{effect} {n}", _value_text(named)) for n, named in values.items()]
    rows += [("not determined", text) for text in which.undetermined]
    if reduction is not None:
        rows += _reduction_rows(reduction, diagnosis.unit)
    if which.discriminating_experiment:
        rows.append(("discriminating experiment", which.discriminating_experiment))
    rows += [("check " + warning.about, warning.text) for warning in diagnosis.warnings]
    table = titled_table("diagnosis", "quantity", "value ± 95 %", rows=rows)
    table.columns[1].justify = "left"
    return table


def report_line(report: "WrittenReport") -> RenderableType:
    """What the page says first, and where it is."""
    return f"{report.campaign}: {report.headline}.\n{report.path}"


def comparison_table(change: GapChange | RecordDifference) -> RenderableType:
    """What became of the gap as sentences, then the error of every run; or what differs."""
    if isinstance(change, RecordDifference):
        return difference_table(change)
    unit = change.before.unit
    text = " ".join((first_sentence(change), causes_sentence(change), cells_sentence(change)))
    rows = (
        (row.run, *(sized(size, unit) for size in (row.error_before, row.error_after, row.u_val)))
        for row in change.runs
    )
    columns = ("run", "before", "after", "uncertainty")
    return Group(text, "", titled_table("error by run", *columns, rows=rows))


def calibration_table(calibration: "Calibration") -> RenderableType:
    """What became of the gap as sentences, then what was put in and the figures."""
    unit, before, after = calibration.unit, calibration.before, calibration.after
    rows = [("verdict before", before.verdict), ("", before.headline)]
    for one in calibration.put_in:
        rows += _put_in_rows(one)
    rows += [("not put in, in no campaign.toml", name) for name in calibration.omitted]
    sizes = {"before": before.rms, "predicted": calibration.rms_predicted}
    if after is not None:
        sizes["after"] = after.rms
    sizes["noise floor"] = before.noise_floor
    rows.append((f"RMS {', '.join(sizes)}", ", ".join(sized(one, unit) for one in sizes.values())))
    if after is not None:
        rows += [("verdict after", after.verdict), ("", after.headline)]
    if calibration.linear is not None:
        off, factor = calibration.linear.off, calibration.linear.factor
        rows.append(("linear prediction off by", f"{100.0 * off:.1f} % of the change"))
        rows.append(("factor on the change that meets it", f"{factor:.3f}"))
        rows += [
            (
                f"order {one.order}, predicted and computed",
                f"{1e9 * one.predicted:+.3g}, {1e9 * one.computed:+.3g} nm/(kN m)",
            )
            for one in calibration.linear.orders
        ]
    table = titled_table("calibration", "quantity", "value ± 95 %", rows=rows, folded=(1,))
    return Group(calibration.text, "", table)


def _put_in_rows(put_in: "PutIn") -> list[tuple[str, str]]:
    """Values of one effect, and from what to what the drawing changes."""
    rows = [
        (f"put in: {put_in.effect} {name}", _value_text(named))
        for name, named in put_in.values.items()
    ] or [(f"put in: {put_in.effect}", "")]
    if put_in.drawn is not None:
        unit = put_in.values["change"].unit
        change = f"{put_in.drawn:.6g} to {put_in.calibrated:.6g} {unit} ({put_in.file})"
        rows.append(("drawn to calibrated", change))
    return rows


def blind_check_table(check: BlindCheck | ExportedCheck) -> RenderableType:
    """Figures, confusion matrix and wrong cases; of an export, where it is."""
    if isinstance(check, ExportedCheck):
        return f"{check.cases} sealed campaigns: {check.folder}, digest {check.digest}"
    shown: list[RenderableType] = []
    for title, columns, rows in score_sections(check):
        shown += [titled_table(title, *columns, rows=rows), ""]
    return Group(*shown, f"digest of the seals: {check.digest}")


def plan_table(plan: CampaignPlan) -> RenderableType:
    """Sentences, then smallest sizes, pairs that are not separated, additions."""
    return Group(
        first_sentences(plan),
        "",
        _plan_sizes(plan),
        "",
        *((_plan_hidden(plan), "") if plan.hidden else ()),
        _plan_pairs(plan),
        "",
        _plan_additions(plan),
    )


def _plan_sizes(plan: CampaignPlan) -> RenderableType:
    table = titled_table(
        f"smallest sizes (noise {plan.noise_std:.2g} {plan.unit})",
        "cause", "parameter", "detected from", "named from", "gap detected [floors]",
        "remains after baseline",
    )  # fmt: skip
    for size in plan.sizes:
        table.add_row(
            size.effect,
            f"{size.parameter} [{size.unit}]",
            _size_text(size.seen_from),
            _size_text(size.named_from),
            _size_text(size.gap_seen),
            f"{size.surviving:.0%}",
        )
    return table


def _plan_hidden(plan: CampaignPlan) -> RenderableType:
    table = titled_table(
        "detected from, where no run has a radial load on record",
        "cause", "parameter", "none acts", "one acts unrecorded", "with strain gauges of bending",
    )  # fmt: skip
    for size in plan.hidden:
        table.add_row(
            size.effect,
            f"{size.parameter} [{size.unit}]",
            _size_text(size.none),
            _size_text(size.unrecorded),
            _size_text(size.bending),
        )
    return table


def _plan_pairs(plan: CampaignPlan) -> RenderableType:
    table = titled_table(
        f"not distinguished at {plan.gap:.3g} floors",
        "cause", "fitted instead", "angle [deg]", "residual [floors]", "separated from [floors]",
        "by an addition",
    )  # fmt: skip
    for pair in plan.pairs:
        if pair.state != "parted":
            table.add_row(
                pair.cause,
                pair.rival,
                f"{pair.angle_deg:.1f}",
                f"{pair.left:.2f}",
                _size_text(pair.parted_from),
                "yes" if pair.state == "alike" else "no",
            )
    return table


def _plan_additions(plan: CampaignPlan) -> RenderableType:
    table = titled_table(
        "additions",
        *("addition", "cost [min]", "pairs separated", "least residual [floors]", "distance"),
        "information per min [nat]",
    )
    for ranked in plan.additions[:_MOST_ADDITIONS]:
        table.add_row(
            ranked.addition.text,
            f"{ranked.addition.cost:.0f}",
            f"{len(ranked.parted)} of {len(plan.alike)}",
            f"{ranked.least_left:.2f}",
            f"{ranked.distance:.0f}",
            _size_text(ranked.per_cost),
        )
    return table


def _size_text(value: float) -> str:
    return f"{value:.3g}" if np.isfinite(value) else "never"


def fleet_table(fleet: FleetDiagnosis) -> RenderableType:
    """Sentences, turbines by their last campaign, priors, campaigns without a diagnosis."""
    shown: list[RenderableType] = [" ".join(fleet_sentences(fleet)), ""]
    turbines = titled_table(
        "turbines, by their last campaign",
        *("day", "cause", "size, 95 %", "gap [floors]", "rho"),
        rows=[
            (
                row.turbine,
                row.recorded or "-",
                causes_of(row),
                "; ".join(
                    shown_size(size.value, size.parameter, size.unit, size.std)
                    for size in row.sizes
                    if size.is_named and not row.first_fault
                ),
                number(row.gap_floors),
                ratio(row.rho),
            )
            for row in fleet.latest[:_MOST_ROWS]
        ],
    )
    priors = titled_table(
        "priors over the fleet",
        *("turbines", "mean, 95 %", "standard deviation"),
        rows=[
            (
                size_name(prior.cause, prior.parameter),
                str(len(prior.turbines)),
                shown_size(prior.mean, prior.parameter, prior.unit, prior.mean_std),
                shown_size(prior.spread, prior.parameter, prior.unit),
            )
            for prior in fleet.priors
        ],
    )
    shown += [turbines, "", priors]
    if fleet.failed:
        rows = [(row.campaign, row.text) for row in fleet.failed]
        shown += ["", titled_table("not diagnosed", "why", rows=rows, folded=(1,))]
    return Group(*shown)


def watch_table(result: WatchResult) -> RenderableType:
    """What the watch does, then its alarms."""
    return Group(state_sentence(result), *result.lines[-_MOST_ROWS:])


def difference_table(difference: RecordDifference) -> RenderableType:
    """Sentences, then the sizes of both measurements, then what would decide."""
    sides = (difference.first, difference.second)
    text = "\n".join((difference_sentence(difference), *(verdict_sentence(row) for row in sides)))
    columns = ("first", "second", "second less first, 95 %", "differs")
    rows = [size_cells(one) for one in difference.sizes]
    table = titled_table("sizes, 95 %", *columns, rows=rows)
    return Group(text, "", table, "", *difference.deciding)
