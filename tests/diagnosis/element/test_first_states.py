"""Where runs begin: at rest as a force sets in, in the midst of a motion, released."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.element.problem import element_problem
from carrierflex.diagnosis.inference.effect_fit import fit_effects, mean_square_left
from carrierflex.identification.campaign.declarations import Channel
from carrierflex.identification.campaign.records import Run
from tests.diagnosis.element.element_campaigns import (
    MASS,
    STEP,
    STIFFNESS,
    driven_motions,
    force_campaign,
    no_law,
)

AMPLITUDES = (1.0, 2.0, 4.0)
NOISE = 2e-6


def hardening(q, v):
    return 4e9 * q**3


def from_sample(first, law=no_law):
    """Runs of the multisine from a sample on, no period declared."""
    campaign = force_campaign(law)
    runs = tuple(
        replace(
            run,
            time=run.time[first:] - run.time[first],
            inputs={"force": run.inputs["force"][first:]},
            signals={"q": run.signals["q"][first:]},
        )
        for run in campaign.runs
    )
    return replace(campaign, rig={"drive": "force"}, runs=runs)


@pytest.mark.long
@pytest.mark.parametrize("law", [no_law, hardening])
def test_a_mass_that_a_force_sets_in_motion_begins_at_rest(law):
    problem = element_problem(from_sample(0, law))
    measured = [abs(record.measured_start[1]) for record in problem.records]
    assert max(measured) > 2e-3  # The band makes a speed of the first acceleration
    assert max(abs(record.first_state[1]) for record in problem.records) < 5e-4
    effects = () if law is no_law else ("cubic_stiffness",)
    fit = fit_effects(problem, effects)
    # 85 times of the hardening element, and 2.5 of the linear one, with the band's speed.
    assert mean_square_left(problem, fit) < 2.0 * NOISE**2


def test_a_run_cut_from_a_longer_one_begins_in_motion():
    first = 700
    speeds = np.gradient(driven_motions(no_law, AMPLITUDES, 0)[2], STEP, axis=1)
    problem = element_problem(from_sample(first))
    for record, speed in zip(problem.records, speeds, strict=True):
        assert_allclose(record.first_state[1], speed[first], atol=0.15 * speed.std())


def test_dry_friction_of_a_decay_is_read_while_it_moves():
    """Half swings of a mass on a spring beside Coulomb friction, exact; then it rests."""
    friction, omega = 0.8, np.sqrt(STIFFNESS / MASS)
    time = 1e-3 * np.arange(4000)
    shift = friction / STIFFNESS
    runs = []
    for number, level in enumerate((1e-3, 2e-3, 3e-3)):
        half = np.floor(time * omega / np.pi)
        amplitude = level - 2.0 * shift * half
        q = (amplitude - shift) * np.cos(omega * time) + shift * (-1.0) ** half
        last = int(np.argmax(amplitude <= shift))
        q[last:] = q[last]
        q += NOISE * np.random.default_rng(number).standard_normal(time.size)
        runs.append(Run(f"R{number}", f"R{number}.csv", f"{level}", time, {}, {"q": q}))
    plain = force_campaign(no_law)
    campaign = replace(
        plain,
        rig={"drive": "free_decay", "mass": MASS},
        channels=(Channel("q", "displacement", "m", noise_std=NOISE),),
        runs=tuple(runs),
    )
    problem = element_problem(campaign)
    start = problem.starts(("coulomb_friction",), {})[0]
    assert_allclose(start[-1], friction, rtol=0.1)
    fit = fit_effects(problem, ("coulomb_friction",))
    assert_allclose(fit.theta[-1], friction, rtol=0.02)
    assert mean_square_left(problem, fit) < 1.3 * NOISE**2
