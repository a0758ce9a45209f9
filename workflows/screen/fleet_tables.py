"""A fleet, and two measurements, as sentences and tables on the screen."""

from rich.console import Group, RenderableType

from carrierflex.diagnosis.report.words import ratio
from carrierflex.files.quantities import number
from carrierflex.workflows.diagnosis.fleet_sizes import shown_size, size_name
from carrierflex.workflows.diagnosis.record_difference import (
    RecordDifference,
    difference_sentence,
    size_cells,
    verdict_sentence,
)
from carrierflex.workflows.fleet.fleet import FleetDiagnosis
from carrierflex.workflows.fleet.fleet_page import causes_of, fleet_sentences
from carrierflex.workflows.fleet.watch_page import state_sentence
from carrierflex.workflows.fleet.watch_result import WatchResult
from carrierflex.workflows.screen.titled_table import titled_table

_MOST_ROWS = 20


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
        table = titled_table("not diagnosed", "why", rows=rows)
        table.columns[-1].justify = "left"
        table.columns[-1].overflow = "fold"
        shown += ["", table]
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
