"""Mountings whose baseline is another simulator's prediction, given as columns beside the measurement.

Its inside is unknown, so linear bushings are fitted to what it predicts and held: effects act on
them, and what they change is added to the prediction. The gap without effects is exactly measured
less predicted.
"""

from dataclasses import replace

from carrierflex.diagnosis.mounting.problem import MountingProblem
from carrierflex.diagnosis.mounting.records import mounting_records
from carrierflex.identification.campaign.campaign import Campaign


def mounting_beside_prediction(problem: MountingProblem, campaign: Campaign) -> MountingProblem:
    """ComparisonProblem whose baseline is the prediction in the run files.

    Parameters
    ----------
    problem : MountingProblem
        ComparisonProblem of the same campaign with the model as its baseline.
    campaign : Campaign
        Campaign with predictions.

    Returns
    -------
    MountingProblem
        Same records; K1 and C1 held at what the prediction obeys.
    """
    # The floor is the measurement's: a prediction has no noise to be estimated.
    channels = tuple(replace(channel, noise_std=0.0) for channel in campaign.channels)
    runs = tuple(replace(run, signals=run.predictions) for run in campaign.runs)
    simulated = mounting_records(replace(campaign, channels=channels, runs=runs))
    # What the prediction contains already is no candidate.
    cards = {
        name: card
        for name, card in problem.model.cards.items()
        if name not in campaign.baseline.effects
    }
    linear = replace(problem.model, contained=(), cards=cards)
    held = replace(problem, model=linear, records=simulated).bare_fit()
    records = tuple(
        replace(
            record, measured=record.measured - own.measured + linear.predicted(record, (), held, {})
        )
        for record, own in zip(problem.records, simulated, strict=True)
    )
    return replace(
        problem, model=replace(linear, held=tuple(float(value) for value in held)), records=records
    )
