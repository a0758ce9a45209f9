"""Measured shapes as laws: from the answer by class to a table, from a table to an effect card."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from carrierflex.diagnosis.classes.results import ClassAnswer
from carrierflex.diagnosis.classes.shapes.kept_laws import kept_shape, law_name
from carrierflex.diagnosis.classes.shapes.visited_range import visited_range_warning
from carrierflex.diagnosis.comparison.effect_cards import EffectCard
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.element.cards import KIND
from carrierflex.diagnosis.element.records import ElementRecord
from carrierflex.identification.campaign_check.campaign_warning import CampaignWarning
from carrierflex.simulation.effect_parameters import EffectParameter
from carrierflex.simulation.element.measured_laws import MeasuredElementLaw
from carrierflex.simulation.element.memory_laws import HYSTERESIS, MEMORY, WITH_MEMORY, MemoryLaw
from carrierflex.simulation.element.surface_laws import (
    FORCE_SURFACE,
    SurfaceLaw,
    surface_force,
)
from carrierflex.simulation.element.tabulated_laws import (
    COUPLED_DAMPING,
    DISSIPATION,
    TABULATED,
    TabulatedLaw,
    tabulated_force,
)
from carrierflex.simulation.force_laws import Force

_EQUATIONS = {
    DISSIPATION: "g(v)",
    COUPLED_DAMPING: "h(q) v",
    HYSTERESIS: "stops that slip",
    MEMORY: "branches that relax",
    FORCE_SURFACE: "f(q, v)",
}


def law_of_answer(
    answer: ClassAnswer, campaign: str, wanted: str | None = None
) -> MeasuredElementLaw:
    """Measured shape of a class of the answer.

    Parameters
    ----------
    answer : ClassAnswer
        Answer by class.
    campaign : str
        Name of the campaign.
    wanted : str, optional
        Class; without, the one of the largest share.

    Returns
    -------
    TabulatedLaw, MemoryLaw or SurfaceLaw
        The shape without what the baseline takes up; of hysteresis its stops, of memory its
        branches, of a force_surface its table with dry friction beside it.

    Raises
    ------
    ValueError
        Where no class is named or leading, the answer has not the wanted one, or it has no table.
    """
    kept = (*TABULATED, *WITH_MEMORY, FORCE_SURFACE)
    name, shape = kept_shape(answer, {own: own for own in kept}, wanted)
    force, length = shape.units[1], shape.units[0].removesuffix("/s")
    if isinstance(shape.memory, MemoryLaw):
        return replace(shape.memory, name=law_name(name, campaign), measured_on=campaign)
    if name == FORCE_SURFACE:
        if shape.surface is None:
            raise ValueError(
                "no law to save: the records go round one curve of deflection and speed (one "
                "frequency at one level), off which a surface is not known; measure another level "
                "or frequency"
            )
        return replace(shape.surface, name=law_name(name, campaign), measured_on=campaign)
    if name == COUPLED_DAMPING:
        force = force.removesuffix(f" s/{length}")
    return TabulatedLaw(
        law_name(name, campaign),
        name,
        shape.x,
        shape.smooth,
        (force, length),
        shape.steps,
        campaign,
    )


def law_cards(laws: Sequence[MeasuredElementLaw], units: tuple[str, str]) -> tuple[EffectCard, ...]:
    """Effect cards of measured laws: one parameter, the size, one where the shape is as measured.

    Parameters
    ----------
    laws : sequence of TabulatedLaw, MemoryLaw or SurfaceLaw
        Laws.
    units : tuple of str
        Units of force and deflection of the records.

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
            KIND,
            f"size x {_EQUATIONS.get(law.effect_class, 'f(q)')} as it was measured",
            (EffectParameter("size", "1", 0.0, np.inf, scale=1.0),),
            "that of its shape",
            law=_force(law),
        )
        for law in laws
    )


def _force(law: MeasuredElementLaw) -> Force | None:
    """Force of a law without parts with a memory, which are the simulator's own."""
    if isinstance(law, SurfaceLaw):
        return surface_force(law)
    return tabulated_force(law) if isinstance(law, TabulatedLaw) else None


def beyond_visited(
    law: MeasuredElementLaw, records: Sequence[ElementRecord]
) -> tuple[CampaignWarning, ...]:
    """Warnings where records leave the range in which a law was measured; empty where none does.

    Parameters
    ----------
    law : TabulatedLaw, MemoryLaw or SurfaceLaw
        Law; of a surface deflection and speed are looked at.
    records : sequence of ElementRecord
        Runs.
    """
    if isinstance(law, SurfaceLaw):
        length = law.units[1]
        over_x = _beyond(law, records, law.x, length, along_speed=False)
        return over_x + _beyond(law, records, law.v, f"{length}/s", along_speed=True)
    return _beyond(law, records, law.x, law.x_unit, along_speed=law.along_speed)


def _beyond(
    law: MeasuredElementLaw,
    records: Sequence[ElementRecord],
    table: FloatArray,
    unit: str,
    *,
    along_speed: bool,
) -> tuple[CampaignWarning, ...]:
    """Warning where deflection or speed of the records leaves a table."""
    own = [_abscissa(record, along_speed=along_speed) for record in records]
    values = np.concatenate(own)
    outside = (values < table[0]) | (values > table[-1])
    if not outside.any():
        return ()
    farthest = int(np.argmax([max(table[0] - one.min(), one.max() - table[-1]) for one in own]))
    warning = visited_range_warning(
        law.name,
        law.effect_class,
        share=float(np.mean(outside)),
        reached=values,
        table=table,
        unit=unit,
        run=records[farthest].name,
    )
    return (warning,)


def _abscissa(record: ElementRecord, *, along_speed: bool) -> FloatArray:
    """Deflection or speed where samples count; the measured motion may hold a run-in."""
    motion = record.motion[1 if along_speed else 0]
    return np.asarray(motion[record.block >= 0], dtype=np.float64)


def parts_with_memory(laws: Sequence[MeasuredElementLaw]) -> dict[str, MemoryLaw]:
    """Parts with a memory of measured laws by effect: of a surface what stands beside its table."""
    parts = {law.name: law for law in laws if isinstance(law, MemoryLaw)}
    return parts | {law.name: law.beside_table for law in laws if isinstance(law, SurfaceLaw)}
