"""Measured laws of the bushings: from the answer by class to a law, from a law to a card."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.classes.results import ClassAnswer, ClassFinding
from carrierflex.diagnosis.classes.shapes import SIZE, law_of_class, visited_range_warning
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
from carrierflex.simulation.laws import BOTH, PORT, RADIAL, STARBOARD, Law, Table

#: Classes that a law file holds, and what it calls them.
_NAMES: Mapping[str, str] = {
    name: name.rpartition("/")[2] for name in (FORCE, DISSIPATION, COUPLED, HYSTERESIS, MEMORY)
}
_EQUATIONS = {
    _NAMES[FORCE]: "f(u) of measured tables",
    _NAMES[DISSIPATION]: "g(v) of measured tables",
    _NAMES[COUPLED]: "h(u) v of measured tables",
    _NAMES[HYSTERESIS]: "the stops of a measured loop",
    _NAMES[MEMORY]: "the branches of a measured relaxation",
}
#: Share of the largest force from which a step at rest is dry friction: what is drawn as zero.
_FRICTION = 0.05


def bushing_law_of_answer(answer: ClassAnswer, campaign: str, wanted: str | None = None) -> Law:
    """Measured shape of a class of the answer.

    Parameters
    ----------
    answer : ClassAnswer
        Answer by class.
    campaign : str
        Name of the campaign.
    wanted : str, optional
        Class as its law calls it; default: the one of the largest share.

    Returns
    -------
    Law
        Tables without what the linear bushings take up; stops or branches of a class with a memory.

    Raises
    ------
    ValueError
        Where no class is named or leading, the answer has not the wanted one, it has no law, or
        holds dry friction.
    """
    return law_of_class(answer, campaign, _NAMES, wanted, _refusal)


def _refusal(name: str, finding: ClassFinding) -> str:
    """Why a class whose shape was measured has no law."""
    tables = finding.measured_law.of(Table) if finding.measured_law else ()
    if not tables or finding.shape is None:
        return ""
    step = max(finding.shape.steps)
    largest = max(float(np.abs(table.y).max()) for table in tables)
    if step <= _FRICTION * max(largest, step):
        return ""
    return (
        f"'{name}' holds dry friction of {step:.3g} N at rest, which no table of a bushing does; "
        "expected a force that is continuous in the speed"
    )


def law_cards(laws: Sequence[Law]) -> tuple[EffectCard, ...]:
    """Effect cards of measured laws: one parameter, the size, one where the shape is as measured.

    Parameters
    ----------
    laws : sequence of Law
        Laws.
    """
    return tuple(
        EffectCard(
            law.name,
            KIND,
            f"size x {_EQUATIONS[law.effect_class]} in the bushings",
            (SIZE,),
            "that of its measured shape",
        )
        for law in laws
    )


def beyond_visited(
    law: Law,
    model: MountingModel,
    records: Sequence[MountingRecord],
    linear: FloatArray,
) -> tuple[CampaignWarning, ...]:
    """Warning where records leave the range in which a law was measured; empty where none does.

    Parameters
    ----------
    law : Law
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
    tables = law.of(Table) or tuple(
        Table(BOTH, np.array(ends), np.zeros(2), RADIAL) for ends in law.visited.values()
    )
    along_speed = law.effect_class == _NAMES[DISSIPATION]
    reached = [
        [_abscissa(table, own, along_speed=along_speed) for own in motions] for table in tables
    ]
    shares = np.array(
        [
            [float(_is_outside(table, values).mean()) for values in of_table]
            for table, of_table in zip(tables, reached, strict=True)
        ]
    )
    sizes = np.array([own.u.shape[2] for own in motions])
    by_table = shares @ sizes / sizes.sum()
    worst = int(np.argmax(by_table))
    share = float(by_table[worst])
    if not share > 0.0:
        return ()
    warning = visited_range_warning(
        law,
        share=share,
        reached=np.concatenate([values.ravel() for values in reached[worst]]),
        table=tables[worst].x,
        unit="m/s" if along_speed else "m",
        run=motions[int(np.argmax(shares[worst]))].record.name,
    )
    return (warning,)


def _abscissa(table: Table, own: BushingMotion, *, along_speed: bool) -> FloatArray:
    """Deflection or speed of the bushings of a table, shape (m, n)."""
    motion = own.v if along_speed else own.u
    chosen = {STARBOARD: motion[:1], PORT: motion[1:]}.get(table.acts_on, motion)
    if table.plane == RADIAL:
        return np.asarray(np.hypot(chosen[:, 0], chosen[:, 1]))
    return chosen.reshape(-1, motion.shape[2])


def _is_outside(table: Table, values: FloatArray) -> NDArray[np.bool_]:
    """Whether a sample leaves a table, shape (n,)."""
    return np.asarray(((values < table.x[0]) | (values > table.x[-1])).any(axis=0))
