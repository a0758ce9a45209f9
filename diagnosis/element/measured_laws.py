"""Measured laws of an element: from the answer by class to a law, from a law to an effect card."""

from collections.abc import Sequence

import numpy as np

from carrierflex.diagnosis.classes.results import ClassAnswer, ClassFinding
from carrierflex.diagnosis.classes.shapes import SIZE, law_of_class, visited_range_warning
from carrierflex.diagnosis.comparison.effect_cards import EffectCard
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.element.records import ElementRecord
from carrierflex.identification.campaign_check.campaign_warning import CampaignWarning
from carrierflex.simulation.element.law_forces import element_law
from carrierflex.simulation.laws import (
    COUPLED_DAMPING,
    DISSIPATION,
    ELEMENT,
    FORCE_SURFACE,
    HYSTERESIS,
    MEMORY,
    RESTORING_FORCE,
    Law,
    Surface,
    Table,
)

#: Classes that a law file holds, and what their law is.
_EQUATIONS = {
    RESTORING_FORCE: "f(q)",
    DISSIPATION: "g(v)",
    COUPLED_DAMPING: "h(q) v",
    HYSTERESIS: "stops that slip",
    MEMORY: "branches that relax",
    FORCE_SURFACE: "f(q, v)",
}


def law_of_answer(answer: ClassAnswer, campaign: str, wanted: str | None = None) -> Law:
    """Measured shape of a class of the answer.

    Parameters
    ----------
    answer : ClassAnswer
        Answer by class.
    campaign : str
        Name of the campaign.
    wanted : str, optional
        Class; default: the one of the largest share.

    Returns
    -------
    Law
        The shape without what the baseline takes up.

    Raises
    ------
    ValueError
        Where no class is named or leading, the answer has not the wanted one, or it has no law.
    """
    return law_of_class(answer, campaign, {name: name for name in _EQUATIONS}, wanted, _refusal)


def _refusal(name: str, finding: ClassFinding) -> str:
    """Why a class whose shape was measured has no law."""
    if name != FORCE_SURFACE or finding.shape is None or finding.measured_law is not None:
        return ""
    return (
        "the records go round one curve of deflection and speed (one frequency at one level), off "
        "which a surface is not known; measure another level or frequency"
    )


def law_cards(laws: Sequence[Law], units: tuple[str, str]) -> tuple[EffectCard, ...]:
    """Effect cards of measured laws: one parameter, the size, one where the shape is as measured.

    Raises
    ------
    ValueError
        Where a law has other units.
    """
    for law in laws:
        if law.units != units:
            raise ValueError(
                f"law '{law.name}': units are {' and '.join(law.units)}; expected those of the "
                f"records, {' and '.join(units)}"
            )
    return tuple(
        EffectCard(
            law.name,
            ELEMENT,
            f"size x {_EQUATIONS[law.effect_class]} as it was measured",
            (SIZE,),
            "that of its shape",
            law=element_law(law).force,
        )
        for law in laws
    )


def beyond_visited(law: Law, records: Sequence[ElementRecord]) -> tuple[CampaignWarning, ...]:
    """Warnings where records leave the range in which a law was measured; empty where none does.

    Of a surface, deflection and speed are looked at.
    """
    is_dissipation = law.effect_class == DISSIPATION
    ranges = [(np.array(ends), False) for ends in law.visited.values()]
    ranges += [(table.x, is_dissipation) for table in law.of(Table)]
    for surface in law.of(Surface):
        ranges += [(surface.x, False), (surface.v, True)]
    warnings = [_beyond(law, records, ends, along_speed=is_speed) for ends, is_speed in ranges]
    return tuple(warning for warning in warnings if warning is not None)


def _beyond(
    law: Law, records: Sequence[ElementRecord], table: FloatArray, *, along_speed: bool
) -> CampaignWarning | None:
    """Warning where deflection or speed of the records leaves a table."""
    motion = 1 if along_speed else 0
    # Where samples count: the measured motion may hold a run-in.
    runs = [record.motion[motion][record.block >= 0] for record in records]
    values = np.concatenate(runs)
    outside = (values < table[0]) | (values > table[-1])
    if not outside.any():
        return None
    farthest = int(np.argmax([max(table[0] - x.min(), x.max() - table[-1]) for x in runs]))
    return visited_range_warning(
        law,
        share=float(np.mean(outside)),
        reached=values,
        table=table,
        unit=f"{law.units[1]}/s" if along_speed else law.units[1],
        run=records[farthest].name,
    )
