"""Measured shapes of the bushings as laws: from the answer by class to tables, then to a card."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from carrierflex.diagnosis.classes.results import ClassAnswer
from carrierflex.diagnosis.classes.shapes.kept_laws import kept_shape, law_name
from carrierflex.diagnosis.classes.shapes.visited_range import visited_range_warning
from carrierflex.diagnosis.comparison.effect_cards import EffectCard
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.mounting.cards import KIND
from carrierflex.diagnosis.mounting.classes.catalogue import (
    COUPLED,
    DISSIPATION,
    FORCE,
    HYSTERESIS,
    MEMORY,
)
from carrierflex.diagnosis.mounting.classes.motion import BushingMotion, bushing_motions
from carrierflex.diagnosis.mounting.classes.rigid_body import rigid_body
from carrierflex.diagnosis.mounting.model import MountingModel
from carrierflex.diagnosis.mounting.records import MountingRecord
from carrierflex.identification.campaign_check.campaign_warning import CampaignWarning
from carrierflex.simulation.effect_parameters import EffectParameter
from carrierflex.simulation.mounting.measured_laws.bushing_laws import (
    BOTH,
    PORT,
    RADIAL,
    STARBOARD,
    BushingLaw,
    BushingPart,
    MeasuredBushingLaw,
)
from carrierflex.simulation.mounting.measured_laws.bushing_memory_laws import BushingMemoryLaw

#: Classes that are kept, and what files call them.
_KEPT: Mapping[str, str] = {
    name: name.rpartition("/")[2] for name in (FORCE, DISSIPATION, COUPLED, HYSTERESIS, MEMORY)
}
_EQUATIONS = {
    _KEPT[FORCE]: "f(u) of measured tables",
    _KEPT[DISSIPATION]: "g(v) of measured tables",
    _KEPT[COUPLED]: "h(u) v of measured tables",
    _KEPT[HYSTERESIS]: "the stops of a measured loop",
    _KEPT[MEMORY]: "the branches of a measured relaxation",
}
#: Share of the largest force from which a step at rest is dry friction: what is drawn as zero.
_FRICTION = 0.05


def bushing_law_of_answer(
    answer: ClassAnswer, campaign: str, wanted: str | None = None
) -> MeasuredBushingLaw:
    """Measured shape of a class of the answer.

    Parameters
    ----------
    answer : ClassAnswer
        Answer by class.
    campaign : str
        Name of the campaign.
    wanted : str, optional
        Class as its table calls it; without, the one of the largest share.

    Returns
    -------
    BushingLaw or BushingMemoryLaw
        Tables without what the linear bushings take up; stops or branches of a class with a memory.

    Raises
    ------
    ValueError
        Where no class is named or leading, the answer has not the wanted one, it has no table, or
        holds dry friction.
    """
    name, shape = kept_shape(answer, _KEPT, wanted)
    if isinstance(shape.memory, BushingMemoryLaw):
        return replace(shape.memory, name=law_name(name, campaign), measured_on=campaign)
    largest = max(float(np.abs(part.y).max()) for part in shape.parts)
    if max(shape.steps) > _FRICTION * max(largest, max(shape.steps)):
        raise ValueError(
            f"no law to save: '{name}' holds dry friction of {max(shape.steps):.3g} N at rest, "
            "which no table of a bushing does; expected a force that is continuous in the speed"
        )
    return BushingLaw(law_name(name, campaign), name, shape.parts, campaign)


def law_cards(laws: Sequence[MeasuredBushingLaw]) -> tuple[EffectCard, ...]:
    """Effect cards of measured laws: one parameter, the size, one where the shape is as measured.

    Parameters
    ----------
    laws : sequence of MeasuredBushingLaw
        Laws.
    """
    return tuple(
        EffectCard(
            law.name,
            KIND,
            f"size x {_EQUATIONS[law.effect_class]} in the bushings",
            (EffectParameter("size", "1", 0.0, np.inf, scale=1.0),),
            "that of its measured shape",
        )
        for law in laws
    )


def beyond_visited(
    law: MeasuredBushingLaw,
    model: MountingModel,
    records: Sequence[MountingRecord],
    linear: FloatArray,
) -> tuple[CampaignWarning, ...]:
    """Warning where records leave the range in which a law was measured; empty where none does.

    Parameters
    ----------
    law : MeasuredBushingLaw
        Law.
    model : MountingModel
        Baseline and library.
    records : sequence of MountingRecord
        Runs.
    linear : ndarray, shape (2,)
        K1 and C1 of the linear bushings that fit the records best.
    """
    body = rigid_body(model.rig, model.sensors, float(linear[0]), float(linear[1]))
    if not body.shows_motion:
        return ()
    bare = replace(model, contained=())
    predicted = [bare.predicted(record, (), linear, {}) for record in records]
    motions = bushing_motions(body, records, predicted)
    parts = _ranges(law)
    shares = np.array([[_outside(law, part, own).mean() for own in motions] for part in parts])
    sizes = np.array([own.u.shape[2] for own in motions])
    by_part = shares @ sizes / sizes.sum()
    worst = int(np.argmax(by_part))
    share = float(by_part[worst])
    if not share > 0.0:
        return ()
    part = parts[worst]
    warning = visited_range_warning(
        law.name,
        law.effect_class,
        share=share,
        reached=np.concatenate([_abscissa(law, part, own).ravel() for own in motions]),
        table=part.x,
        unit="m/s" if law.along_speed else "m",
        run=motions[int(np.argmax(shares[worst]))].record.name,
    )
    return (warning,)


def _ranges(law: MeasuredBushingLaw) -> tuple[BushingPart, ...]:
    """Tables of a law; of one with a memory the deflections that were visited."""
    if isinstance(law, BushingLaw):
        return law.parts
    ends = np.array([0.0, law.visited])
    return (BushingPart(RADIAL, BOTH, ends, np.zeros(2)),)


def _abscissa(law: MeasuredBushingLaw, part: BushingPart, own: BushingMotion) -> FloatArray:
    """Deflection or speed of the bushings of a part, shape (m, n)."""
    motion = own.v if law.along_speed else own.u
    chosen = {STARBOARD: motion[:1], PORT: motion[1:]}.get(part.bushing, motion)
    if part.acts == RADIAL:
        return np.asarray(np.hypot(chosen[:, 0], chosen[:, 1]))
    return chosen.reshape(-1, motion.shape[2])


def _outside(law: MeasuredBushingLaw, part: BushingPart, own: BushingMotion) -> FloatArray:
    """Whether a sample leaves the table of a part, shape (n,)."""
    values = _abscissa(law, part, own)
    return np.asarray(((values < part.x[0]) | (values > part.x[-1])).any(axis=0), dtype=np.float64)
