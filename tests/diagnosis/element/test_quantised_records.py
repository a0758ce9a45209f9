"""Classes of records as a logger writes them: rounded to the steps of its converter or its file."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.classes.results import NAMED_CLASS, NOTHING
from carrierflex.diagnosis.element.noise import carried_noise
from carrierflex.diagnosis.element.problem import element_problem
from carrierflex.identification.campaign_check.sample_statistics import quantisation_step
from tests.diagnosis.element import test_drives
from tests.diagnosis.element.element_campaigns import (
    DAMPING,
    STIFFNESS,
    displacement_campaign,
    force_campaign,
)


def test_a_triangle_stands_on_levels_and_is_not_rounded():
    """Its levels made a floor of 0.43 N for 0.05 N, and dry friction "agree within the noise"."""
    ramp = 1e-5 * np.abs((np.arange(4000) + 50) % 200 - 100.0)
    rng = np.random.default_rng(0)
    assert quantisation_step(ramp) == 0.0
    assert quantisation_step(in_steps(0.7 * ramp, 1e-5)) == pytest.approx(1e-5)
    assert quantisation_step(in_steps(rng.standard_normal(4000), 1.0)) == pytest.approx(1.0)
    assert quantisation_step(in_steps(ramp + 5e-6 * rng.standard_normal(4000), 1e-5)) > 0.0


def rounded(campaign, *, drive=0.0, channel=0.0):
    """Campaign without declared noise, its input and its channel in whole steps (zero: as is)."""
    runs = [
        replace(
            run,
            inputs={name: in_steps(values, drive) for name, values in run.inputs.items()},
            signals={name: in_steps(values, channel) for name, values in run.signals.items()},
        )
        for run in campaign.runs
    ]
    silent = replace(campaign.channels[0], noise_std=None)
    return replace(campaign, runs=tuple(runs), channels=(silent,))


def in_steps(values, step):
    return step * np.round(values / step) if step else values


def converted(campaign, bits):
    """Campaign as a converter of so many bits reads it, its range a fifth above the largest."""
    largest = {
        name: max(np.abs(getattr(run, name)[key]).max() for run in campaign.runs)
        for name in ("inputs", "signals")
        for key in getattr(campaign.runs[0], name)
    }
    steps = {name: 2.4 * value / 2.0**bits for name, value in largest.items()}
    return rounded(campaign, drive=steps.get("inputs", 0.0), channel=steps["signals"])


def cube(q, v):
    return 5e8 * q**3


def dry(q, v):
    return 3.0 * np.sign(v)


def nothing(q, v):
    return 0.0 * q


@cache
def driven(law):
    """Element moved without any noise: all there is comes from the steps."""
    return displacement_campaign(law, noise=0.0, n=2500)


def answer(campaign):
    return element_problem(campaign).class_answer()


@pytest.mark.parametrize(("drive", "force"), [(1e-11, 1e-6), (1e-9, 1e-4)])
@pytest.mark.parametrize(("law", "name"), [(cube, "restoring_force"), (dry, "dissipation")])
def test_a_drive_written_with_few_digits_keeps_its_class(law, name, drive, force):
    result = answer(rounded(driven(law), drive=drive, channel=force))
    assert (result.state, result.ids, result.ties) == (NAMED_CLASS, (name,), ())
    assert result.share > 0.999
    assert result.classes[0].law_named


@pytest.mark.parametrize("bits", [12, 16])
def test_a_converter_neither_hides_a_class_nor_makes_one(bits):
    result = answer(converted(driven(cube), bits))
    assert (result.state, result.ids) == (NAMED_CLASS, ("restoring_force",))
    assert (result.classes[0].law, result.classes[0].law_named) == ("cubic_stiffness", True)
    # A sensor's own noise: without any the rounding repeats with the drive's periods, exactly.
    plain = displacement_campaign(nothing, noise=0.02, n=2500)
    assert answer(converted(plain, bits)).state == NOTHING


@pytest.mark.long
def test_a_converter_keeps_the_class_under_a_force_and_after_a_release():
    bits = 12
    forced = replace(force_campaign(cube, noise=0.0), rig={"drive": "force"})
    released = test_drives.decay_campaign(test_drives.cubic)
    assert answer(converted(forced, bits)).ids == ("restoring_force",)
    assert answer(converted(released, bits)).ids == ("restoring_force",)


def test_the_motion_that_ends_sharply_lies_in_the_flat_part_of_its_band():
    problem = element_problem(rounded(driven(nothing), drive=1e-7, channel=1e-4))
    for record in problem.records:
        # The highest line is at 4.3 Hz; a roll-off upon it took 6 % of the motion. Away from the
        # ends, where the record's continuation is a guess.
        middle = slice(700, -700)
        size = np.abs(record.drive).max()
        assert_allclose(record.motion[0][middle], record.drive[middle], atol=1e-3 * size)


def test_steps_of_force_and_deflection_are_the_floor():
    force_step, step = 0.05, 1e-6
    problem = element_problem(rounded(driven(nothing), drive=step, channel=force_step))
    for record in problem.records:
        # Below 4 Hz an element of 8000 N/m and 12 Ns/m is as stiff as its spring to 1 %.
        w = 2.0 * np.pi * 2.0
        stiffness = np.hypot(STIFFNESS, DAMPING * w)
        share = 2.0 * 0.9 * record.cutoff_hz * record.step
        carried = step**2 / 12.0 * stiffness**2 * share
        assert carried_noise(problem.model, record) == pytest.approx(carried, rel=0.05)
        assert record.noise == pytest.approx(force_step**2 / 12.0 + carried, rel=0.1)


def test_a_floor_that_repeats_exactly_is_never_below_its_steps():
    plain = force_campaign(cube, noise=0.0)
    step = 1e-6
    problem = element_problem(rounded(plain, channel=step))
    # Periods repeat to the last step, but for what the start has left.
    assert min(record.noise for record in problem.records) >= 0.99 * step**2 / 12.0
