"""Small campaigns of every kind without a fault, and ways to put one in."""

from dataclasses import replace
from functools import cache

import numpy as np

from carrierflex.identification.campaign_check.records_check import records_findings
from tests.diagnosis.element.element_campaigns import displacement_campaign, force_campaign, no_law
from tests.diagnosis.mounting.mounting_campaigns import CONDITIONS, mounting_campaign
from tests.identification.synthetic_campaigns import carrier_campaign
from tests.simulation.synthetic_curves import curve_set


@cache
def faultless(kind):
    """Campaign of a kind; ``element`` by force, ``driven`` by displacement."""
    if kind == "carrier":
        return carrier_campaign()
    if kind == "mounting":
        return mounting_campaign({}, conditions=CONDITIONS[:2])
    if kind == "element":
        return force_campaign(no_law)
    return displacement_campaign(lambda q, v: 40.0 * np.sign(v))


def checks(campaign):
    """Names of the checks that find something, with what they are about."""
    curves = curve_set() if campaign.kind == "carrier" else None
    return {(result.check, result.about) for result in records_findings(campaign, curves)}


def changed(campaign, column, change, *, runs=None):
    """Campaign with a column of its runs replaced by ``change(values)``."""

    def of(run):
        if runs is not None and run.name not in runs:
            return run
        if column == "time":
            return replace(run, time=change(run.time.copy()))
        for kind in ("inputs", "signals"):
            columns = dict(getattr(run, kind))
            if column in columns:
                columns[column] = change(columns[column].copy())
                return replace(run, **{kind: columns})
        raise KeyError(column)

    return replace(campaign, runs=tuple(of(run) for run in campaign.runs))


def with_rig(campaign, **values):
    return replace(campaign, rig={**campaign.rig, **values})


def with_channels(campaign, **values):
    """Campaign whose first channel has other facts."""
    first, *others = campaign.channels
    return replace(campaign, channels=(replace(first, **values), *others))
