"""What does not repeat from period to period is noise, or something that changes in time."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.signal import lfilter

from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.diagnosis.element.problem import element_problem

from .element_campaigns import DAMPING, MASS, PERIOD, STEP, STIFFNESS, force_campaign, no_law


def diagnosis_of(campaign):
    problem = element_problem(campaign)
    return diagnose(
        problem,
        campaign="twin",
        kind="element",
        floor_is_measured=problem.noise_is_measured,
    )


def changing(campaign, hz):
    """The same drives on an element whose stiffness changes by 25 % faster than its records see."""

    runs = []
    for run in campaign.runs:
        force = run.inputs["force"]

        def rates(t, y, force=force, time=run.time):
            drive = np.interp(t, time, force)
            stiffness = STIFFNESS * (1.0 + 0.25 * np.sin(2.0 * np.pi * hz * t))
            return [y[1], (drive - stiffness * y[0] - DAMPING * y[1]) / MASS]

        ends = (run.time[0], run.time[-1])
        states = solve_ivp(rates, ends, [0.0, 0.0], t_eval=run.time, rtol=1e-6, max_step=STEP).y
        noise = 1e-6 * np.random.default_rng(1).standard_normal(run.time.size)
        runs.append(replace(run, signals={"q": states[0] + noise}))
    return replace(campaign, runs=tuple(runs))


@pytest.mark.long
@pytest.mark.parametrize("hz", [3.7, 7.3])
def test_a_stiffness_that_changes_fast_is_no_noise(hz):
    diagnosis = diagnosis_of(changing(force_campaign(no_law, declared=False), hz))
    assert (diagnosis.verdict, diagnosis.reason_id) == ("not_diagnosable", "floor_unknown")
    assert "from period to period" in diagnosis.reason


@pytest.mark.parametrize("memory", [0.0, 0.7])
@pytest.mark.parametrize("noise", [2e-6, 2e-5])
def test_noise_with_or_without_a_memory_is(memory, noise):

    campaign = force_campaign(no_law, declared=False, noise=0.0)
    rng = np.random.default_rng(7)
    runs = []
    for run in campaign.runs:
        white = rng.standard_normal(run.time.size)
        coloured = lfilter([np.sqrt(1.0 - memory**2)], [1.0, -memory], white)
        runs.append(replace(run, signals={"q": run.signals["q"] + noise * coloured}))
    diagnosis = diagnosis_of(replace(campaign, runs=tuple(runs)))
    assert diagnosis.verdict == "at_noise_floor"
    assert campaign.rig["period_samples"] == PERIOD
