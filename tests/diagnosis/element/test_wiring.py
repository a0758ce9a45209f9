"""A delay that a fit of the baseline cannot find is told by the spectra."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from carrierflex.diagnosis.element.problem import element_problem
from carrierflex.diagnosis.element.wiring.delay import element_delay
from tests.diagnosis.element.element_campaigns import displacement_campaign, force_campaign

CAMPAIGNS = {"force": force_campaign, "displacement": displacement_campaign}


def late(campaign, delay):
    """Campaign whose channel is read `delay` [s] ago."""
    name = campaign.channels[0].name

    def of(run):
        moved = CubicSpline(run.time, run.signals[name])(run.time - delay)
        return replace(run, signals={name: moved})

    return replace(campaign, runs=tuple(of(run) for run in campaign.runs))


@pytest.mark.parametrize("drive", list(CAMPAIGNS))
@pytest.mark.parametrize("delay", [0.0, 0.05, -0.04])
def test_the_delay_of_a_linear_element_is_found(drive, delay):
    """Within half a step; damping and mass make up for a delay of a drive that ends at 4.7 Hz."""
    campaign = CAMPAIGNS[drive](lambda q, v: 0.0 * q)
    step = campaign.runs[0].time[1]
    found = element_delay(element_problem(late(campaign, delay)))
    assert found == pytest.approx(delay, abs={"force": 0.5, "displacement": 2.0}[drive] * step)


def test_a_nonlinear_element_on_time_has_no_delay():
    campaign = displacement_campaign(lambda q, v: 40.0 * np.sign(v))
    assert element_delay(element_problem(campaign)) == 0.0
