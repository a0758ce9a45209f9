"""The report page: one HTML file with everything a diagnosis found, for a screen, a phone and paper; it asks no network."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from carrierflex.diagnosis.comparison.problem import GapCell
from carrierflex.diagnosis.report import words
from carrierflex.diagnosis.report.drawings import Drawing, Drawings, drawings
from carrierflex.diagnosis.report.gap_grid import SIGNIFICANCE
from carrierflex.diagnosis.results import Diagnosis
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.estimate_files import software_name

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
    """

    campaign: Campaign
    folder: str
    versions: Mapping[str, str]
    written: str


def report_page(diagnosis: Diagnosis, source: ReportSource) -> str:
    """HTML text of the report.

    Parameters
    ----------
    diagnosis : Diagnosis
        What was found.
    source : ReportSource
        Inputs and versions.

    Returns
    -------
    str
        A whole page with its figures and style inside.

    Raises
    ------
    jinja2.UndefinedError
        Where the template asks for something that is not given.
    """
    environment = Environment(
        loader=PackageLoader("diagnosis"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"powers": words.powers, "plain_name": words.plain_name}
    return environment.get_template(_TEMPLATE).render(**_content(diagnosis, source))


def _content(diagnosis: Diagnosis, source: ReportSource) -> dict[str, Any]:
    which, far = diagnosis.attribution, diagnosis.reduction
    return {
        "found": diagnosis,
        "which": which,
        "far": far,
        "source": source,
        "campaign": source.campaign,
        "words": words,
        "software": software_name(),
        "drawn": _marked(drawings(diagnosis)),
        "cells_before": _largest_cells(far.cells_before),
        "cells_after": _largest_cells(far.cells_after),
        "sets": which.ranking[:_MOST_SETS],
        "n_more_sets": max(len(which.ranking) - _MOST_SETS, 0),
    }


def _marked(drawn: Drawings) -> dict[str, Any]:
    """Figures as markup that is not escaped again."""

    def own(drawing: Drawing | None) -> dict[str, Any] | None:
        return None if drawing is None else {"svg": Markup(drawing.svg), "caption": drawing.caption}

    motion = [{"picture": p, "figures": [own(d) for d in figures]} for p, figures in drawn.motion]
    maps = [own(drawing) for drawing in drawn.gap_maps]
    return {
        "gap_maps": maps,
        "remaining": own(drawn.remaining),
        "in_time": own(drawn.in_time),
        "ladder": own(drawn.search),
        "likeness": own(drawn.signature_correlation),
        "motion": motion,
    }


def _largest_cells(cells: Sequence[GapCell]) -> list[GapCell]:
    """Cells beyond chance that hold a part of the gap worth a row."""
    return [
        c
        for c in cells
        if c.share >= _SMALLEST_SHARE and c.p_value < SIGNIFICANCE and c.coherent > 0.0
    ][:_MOST_CELLS]
