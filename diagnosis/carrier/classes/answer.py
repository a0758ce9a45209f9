"""Class of the missing effect of a carrier: table, decision, the law nearest to it."""

from collections.abc import Sequence
from dataclasses import replace

from carrierflex.diagnosis.carrier.classes.amplitude_tables import law_of_class
from carrierflex.diagnosis.carrier.classes.catalogue import (
    UNDETERMINED,
    classes_holding,
    classes_of_laws,
)
from carrierflex.diagnosis.carrier.classes.table import CarrierTable, carrier_table
from carrierflex.diagnosis.carrier.model import CarrierModel
from carrierflex.diagnosis.carrier.records.sums import CarrierSums
from carrierflex.diagnosis.classes.answer import answer_of
from carrierflex.diagnosis.classes.constants import ClassConstants
from carrierflex.diagnosis.classes.held_out import ClassScores
from carrierflex.diagnosis.classes.law_sets import law_sets
from carrierflex.diagnosis.classes.results import ClassAnswer
from carrierflex.diagnosis.classes.shape_decision import (
    FURTHER_CAUSE,
    decide_by_shape,
    rivals_of,
    way_of,
)
from carrierflex.diagnosis.classes.shares import Shares
from carrierflex.diagnosis.comparison.problem import Effects, FloatArray
from carrierflex.identification.campaign.campaign import Campaign

_TORQUES_NOTE = "fewer than three torques: what a class follows cannot be determined"
_OFFSET_NOTE = "the offset of every run is fitted to it: whether one is missing is not compared"
#: Penalties that the folds choose from: down to none for gaps of hundreds of floors.
_RIDGES = (1e-12, 1e-10, 1e-8, 1e-6, 1e-4, 1e-2)
_PAIR_RIDGES = (1e-2, 1.0)
_CONSTANTS = ClassConstants(ridges=_RIDGES, pair_ridges=_PAIR_RIDGES, second_cause=FURTHER_CAUSE)


def carrier_class_table(
    model: CarrierModel,
    campaign: Campaign,
    records: CarrierSums,
    noise: FloatArray,
    candidates: Effects,
    base: FloatArray,
) -> CarrierTable | None:
    """Table of classes and laws, :func:`carrier_table`; None where the blocks are too few."""
    if len(records.segments) < _CONSTANTS.fewest_blocks:
        return None
    of_all_runs = tuple(name for name in candidates if not model.effects[name].per_run)
    return carrier_table(model, campaign, records, noise, of_all_runs, base)


def carrier_class_answer(
    model: CarrierModel, own: CarrierTable, candidates: Effects
) -> ClassAnswer:
    """Class of the missing effect.

    Parameters
    ----------
    model : CarrierModel
        Baseline and library.
    own : CarrierTable
        Table of classes and laws.
    candidates : tuple of str
        Laws on trial.
    """
    by_run = tuple(name for name in candidates if model.effects[name].per_run)
    scores = ClassScores(own.table, _CONSTANTS)
    shares = Shares(scores.of(()).squares, own.table.floor, _CONSTANTS)
    decision = decide_by_shape(scores, shares, own.sizes, chooses_anew=True)
    is_open = any(way_of(name) == UNDETERMINED for name in own.sizes)
    answer = answer_of(
        scores,
        shares,
        decision,
        rivals_of(scores, decision, own.sizes),
        shape_of=lambda scores, name, held, law: (
            None,
            law_of_class(scores, name, held, own.visited),
        ),
        note="; ".join(_notes(model, is_open=is_open)),
    )
    # Laws with values by run say nothing of a condition that is held out.
    classes_of_law = {**answer.classes_of_law, **classes_holding(by_run)}
    ordered = classes_of_laws(classes_of_law, is_told=not is_open)
    laws = law_sets(scores, shares, (decision.classes, *decision.ties), candidates)
    return replace(
        answer,
        classes_of_law=ordered,
        same_scores=True,
        law_sets=(*laws, *_with_values_by_run(laws, by_run)),
    )


def _with_values_by_run(laws: Sequence[Effects], by_run: Effects) -> list[Effects]:
    """Laws with a value for every run, no columns of the table: alone and beside others."""
    return [tuple(sorted((*others, law))) for law in by_run for others in ((), *laws[:1])]


def _notes(model: CarrierModel, *, is_open: bool) -> list[str]:
    """What the records cannot say."""
    notes = [_TORQUES_NOTE] if is_open else []
    if not any(model.effects[name].per_run for name in model.contained):
        notes.append(_OFFSET_NOTE)
    return notes
