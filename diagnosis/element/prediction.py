"""Elements whose baseline is another simulator's prediction, given beside the measurement.

Its inside is unknown, so a mass, spring and damper are fitted to what it predicts and held: effects
act on them, and what they change is added to the prediction. The gap without effects is exactly
measured less predicted.
"""

from dataclasses import replace

from carrierflex.diagnosis.element.problem import ElementProblem
from carrierflex.diagnosis.element.records import run_in_use
from carrierflex.diagnosis.inference.effect_fit import fit_effects
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.signals import even_time, filled


def element_beside_prediction(problem: ElementProblem, campaign: Campaign) -> ElementProblem:
    """ComparisonProblem whose baseline is the prediction in the run files.

    Parameters
    ----------
    problem : ElementProblem
        ComparisonProblem of the same campaign with the model as its baseline.
    campaign : Campaign
        Campaign with predictions.

    Returns
    -------
    ElementProblem
        Same records; mass, spring, damper and constant force held at what the prediction obeys.
    """
    by_force = problem.model.by_force
    name = campaign.channels[0].name
    runs = [run_in_use(run) for run in campaign.runs]
    predicted = [filled(run.predictions[name], run.time, even_time(run.time)) for run in runs]
    simulated = tuple(
        record.with_response(own) if by_force else record.with_force(own)
        for record, own in zip(problem.records, predicted, strict=True)
    )
    # What the prediction contains already is no candidate.
    cards = {
        name: card
        for name, card in problem.model.cards.items()
        if name not in campaign.baseline.effects
    }
    linear = replace(problem.model, contained=(), cards=cards)
    held = fit_effects(replace(problem, model=linear, records=simulated, table=None), ()).theta
    records = tuple(
        replace(
            record,
            response=linear.predicted(record, (), held) + record.response - own,
            gap=record.response - own,
        )
        for record, own in zip(problem.records, predicted, strict=True)
    )
    held_model = replace(linear, held=tuple(float(value) for value in held))
    return replace(problem, model=held_model, records=records, table=None)
