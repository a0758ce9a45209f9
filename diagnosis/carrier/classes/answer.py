"""Class of the missing effect of a carrier: table, decision, the law nearest to it."""

from dataclasses import replace

from carrierflex.diagnosis.carrier.classes.catalogue import (
    UNDETERMINED,
    classes_of_laws,
    follows_of,
    shape_of,
)
from carrierflex.diagnosis.carrier.classes.decision import best_of_shapes, decide_by_shape
from carrierflex.diagnosis.carrier.classes.table import carrier_table
from carrierflex.diagnosis.carrier.model import CarrierModel
from carrierflex.diagnosis.carrier.records.sums import CarrierSums
from carrierflex.diagnosis.classes.answer import answer_of
from carrierflex.diagnosis.classes.constants import ClassConstants
from carrierflex.diagnosis.classes.held_out import ClassScores
from carrierflex.diagnosis.classes.results import ClassAnswer
from carrierflex.diagnosis.classes.shares import Shares
from carrierflex.diagnosis.comparison.problem import Effects, FloatArray
from carrierflex.identification.campaign.campaign import Campaign

_TORQUES_NOTE = "fewer than three torques: what a class follows cannot be determined"


def carrier_class_answer(
    model: CarrierModel,
    campaign: Campaign,
    records: CarrierSums,
    noise: FloatArray,
    candidates: Effects,
    base: FloatArray,
) -> ClassAnswer | None:
    """Class of the missing effect; the arguments are those of the table.

    Returns
    -------
    ClassAnswer or None
        None where the records hold too few blocks, or the baseline does not hold the offset of
        every run: what differs from run to run without a cause then is no class.
    """
    constants = ClassConstants()
    if not any(model.effects[name].per_run for name in model.contained):
        return None
    if len(records.segments) < constants.fewest_blocks:
        return None
    own = carrier_table(model, campaign, records, noise, candidates, base)
    scores = ClassScores(own.table, constants)
    shares = Shares(scores.of(()).squares, own.table.floor, constants)
    decision = decide_by_shape(scores, shares, own.sizes)
    taken = {shape_of(name) for name in decision.classes}
    rivals = [name for name in best_of_shapes(scores, own.sizes) if shape_of(name) not in taken]
    is_open = any(follows_of(name) == UNDETERMINED for name in own.sizes)
    answer = answer_of(
        scores,
        shares,
        decision,
        rivals,
        shape_of=lambda scores, name, held, law: None,
        note=_TORQUES_NOTE if is_open else "",
    )
    ordered = classes_of_laws(answer.classes_of_law, is_told=not is_open)
    return replace(answer, classes_of_law=ordered, same_scores=True)
