"""The report page: one HTML file for a screen, a phone and paper, which asks no network."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from carrierflex.diagnosis.comparison import effect_names
from carrierflex.diagnosis.comparison.effect_names import plain_name
from carrierflex.diagnosis.comparison.problem import GapCell
from carrierflex.diagnosis.gap.gap_map import map_of
from carrierflex.diagnosis.report import gap_words, verdict_words, words
from carrierflex.diagnosis.report.drawings import Drawing, Drawings, drawings
from carrierflex.diagnosis.report.figures import remainder_factor
from carrierflex.diagnosis.report.verdict_words import gists, next_step, worth
from carrierflex.diagnosis.results import Diagnosis
from carrierflex.files.versions import software_name
from carrierflex.identification.campaign.campaign import Campaign

_TEMPLATE = "report.html.j2"
#: Rows of the tables that could be long.
_MOST_CELLS = 10
_MOST_SETS = 10
_SMALLEST_SHARE = 0.01


@dataclass(frozen=True, eq=False)
class ReportSource:
    """What a report says about where it comes from.

    Parameters
    ----------
    campaign : Campaign
        Measured records.
    folder : str
        Where they were read.
    versions : mapping of str to str
        Versions of what can change a result.
    written : str
        Date and time.
    view : str
        Page beside the report on which the rim turns in space; empty where there is none.
    """

    campaign: Campaign
    folder: str
    versions: Mapping[str, str]
    written: str
    view: str = ""


def report_page(diagnosis: Diagnosis, source: ReportSource) -> str:
    """HTML text of the report.

    Parameters
    ----------
    diagnosis : Diagnosis
        Result of the diagnosis.
    source : ReportSource
        Inputs and versions.

    Returns
    -------
    str
        A complete page with its figures and style inside.

    Raises
    ------
    jinja2.UndefinedError
        Where the template asks for something that is not given.
    """
    environment = Environment(
        loader=PackageLoader("carrierflex.diagnosis.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["plain_name"] = plain_name
    return environment.get_template(_TEMPLATE).render(**_content(diagnosis, source))


def _content(diagnosis: Diagnosis, source: ReportSource) -> dict[str, Any]:
    which = diagnosis.attribution
    reduction = diagnosis.reduction
    return {
        "diagnosis": diagnosis,
        "which": which,
        "reduction": reduction,
        "source": source,
        "campaign": source.campaign,
        "words": words,
        "gap_words": gap_words,
        "verdict_words": verdict_words,
        "next_step": next_step(diagnosis),
        "worth": worth(diagnosis),
        "gist": gists(diagnosis),
        "names": effect_names,
        "software": software_name(),
        "drawn": _marked(drawings(diagnosis, source.campaign)),
        "cells_before": _largest_cells(reduction.cells_before if reduction else ()),
        "cells_after": _largest_cells(reduction.cells_after if reduction else ()),
        "sets": which.ranking[:_MOST_SETS],
        "n_more_sets": max(len(which.ranking) - _MOST_SETS, 0),
    }


def _marked(drawn: Drawings) -> dict[str, Any]:
    """Figures as markup that is not escaped again."""
    motion = [
        {
            "picture": picture,
            "figures": [_markup(figure) for figure in figures],
            "magnified": remainder_factor(picture),
        }
        for picture, figures in drawn.motion
    ]
    return {
        "gap_maps": [_markup(drawing) for drawing in drawn.gap_maps],
        "remaining": _markup(drawn.remaining),
        "in_time": _markup(drawn.in_time),
        "selection": _markup(drawn.selection),
        "motion": motion,
        "shapes": [_markup(drawing) for drawing in drawn.shapes],
        "machine": _markup(drawn.machine),
        "signals": _markup(drawn.signals),
    }


def _markup(drawing: Drawing | None) -> dict[str, Any] | None:
    if drawing is None:
        return None
    return {"svg": Markup(drawing.svg), "caption": drawing.caption}


def _largest_cells(cells: Sequence[GapCell]) -> list[GapCell]:
    """Cells beyond chance that hold a part of the gap worth a row."""
    own = map_of(cells)
    return list(own.chosen(own.are_significant & (own.shares >= _SMALLEST_SHARE))[:_MOST_CELLS])
