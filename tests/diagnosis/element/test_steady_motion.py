"""Motion under one line, known from its harmonics, and what the classes see with it."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from carrierflex.diagnosis.element.force_records import (
    force_records,
    with_noise_of_motion,
)
from carrierflex.diagnosis.element.motion import (
    _frequency_of_line,
    _steady_motion,
)
from carrierflex.diagnosis.element.problem import element_problem
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import Baseline, Channel
from carrierflex.identification.campaign.records import Run
from tests.diagnosis.element.element_campaigns import DAMPING, MASS, STIFFNESS

STEP, N = 4e-3, 2400
#: Below the resonance at 10 Hz, off every line of the record's spectrum.
OMEGA = 2.0 * np.pi * 6.1313
NOISE = 4e-6


@cache
def settled(law, level):
    """Deflection under one sine that grows in the record, integrated to 1e-9."""

    def rates(t, state):
        q, v = state
        force = level * min(t / 0.6, 1.0) ** 3 * np.sin(OMEGA * t)
        return [v, (force - STIFFNESS * q - DAMPING * v - law(q, v)) / MASS]

    time = STEP * np.arange(N)
    solution = solve_ivp(rates, (0.0, time[-1]), [0.0, 0.0], "DOP853", time, rtol=1e-9, atol=1e-14)
    force = level * np.minimum(time / 0.6, 1.0) ** 3 * np.sin(OMEGA * time)
    return time, force, solution.y[0]


def sines(law, *, noise=NOISE, levels=(2.0, 4.0, 6.0, 8.0), settle=900):
    rng = np.random.default_rng(3)
    runs = []
    for level in levels:
        time, force, q = settled(law, level)
        measured = q + noise * rng.standard_normal(N)
        name = f"L{level}"
        runs.append(Run(name, f"{name}.csv", name, time, {"force": force}, {"q": measured}))
    channel = Channel("q", "displacement", "m", noise_std=noise)
    rig = {"drive": "force", "settle_samples": settle}
    return Campaign("element", "sines", Baseline("model"), rig, (channel,), tuple(runs))


def cubic(q, v):
    return 2e9 * q**3


@pytest.fixture(scope="module")
def hardening():
    return element_problem(sines(cubic))


def test_the_frequency_of_a_line_is_found_between_the_lines_of_a_spectrum():
    t = STEP * np.arange(N)
    # Of nine periods the phase is a thousandth off, which the slow heights of harmonics take up.
    for hertz, error in ((0.9, 5e-5), (6.1313, 1e-6), (40.03, 1e-6)):
        omega = 2.0 * np.pi * hertz
        drive = 3.0 + 5.0 * np.sin(omega * t + 1.0) + 0.5 * np.sin(3.0 * omega * t)
        assert _frequency_of_line(drive, STEP) == pytest.approx(omega, rel=error)


def test_harmonics_are_known_to_the_noise_of_all_samples_together(hardening):
    record = hardening.records[3]
    _, _, q = settled(cubic, 8.0)
    steady = _steady_motion(record)
    counted = record.block >= 0
    error = (steady[0][0] - q)[counted]
    # Three harmonics and a constant are 19 coefficients of 1365 samples: 0.118 of the noise.
    assert error.std() < 0.14 * NOISE
    assert_allclose(steady[0][1][counted], np.gradient(q, STEP)[counted], atol=1.5e-3)
    rate = np.gradient(steady[0][1], STEP)[counted][1:-1]
    size = np.abs(steady[0][2][counted]).max()
    assert_allclose(steady[0][2][counted][1:-1], rate, atol=0.03 * size)


def test_no_harmonic_is_found_in_noise():
    plain = element_problem(sines(lambda q, v: 0.0 * q))
    for record in plain.records:
        steady = _steady_motion(record)
        counted = record.block >= 0
        spectrum = np.abs(np.fft.rfft(steady[0][0][counted] * np.hanning(counted.sum())))
        lines = np.fft.rfftfreq(int(counted.sum()), STEP)
        beyond = lines > 1.5 * OMEGA / (2.0 * np.pi)
        assert spectrum[beyond].max() < 1e-3 * spectrum.max()


def test_what_is_taken_from_the_regressors_is_in_the_target(hardening):
    model = hardening.model
    in_force = force_records(model, hardening.records)[0]
    a, q, v, _ = in_force.base
    measured_motion = {record.name: record.motion for record in hardening.records}
    for regressor, noise, measured in zip(
        (q, v, a), in_force.noise_motion, measured_motion[in_force.record.name], strict=True
    ):
        assert_allclose(regressor + noise, measured, atol=1e-9 * np.abs(measured).max())
    weight = replace(in_force.weight, element=(MASS, DAMPING, STIFFNESS))
    inside = with_noise_of_motion(replace(in_force, weight=weight))
    x, rate, turn = in_force.noise_motion
    force = MASS * turn + DAMPING * rate + STIFFNESS * x
    assert_allclose(
        in_force.target - inside.target, force, atol=1e-12 * np.abs(in_force.target).max()
    )


def test_a_transient_beside_the_harmonics_is_motion_and_no_noise():
    # Hardly damped and counted from the first sample: the element rings at its own frequency.
    problem = element_problem(
        replace(sines(lambda q, v: -0.8 * DAMPING * v), rig={"drive": "force", "settle_samples": 0})
    )
    records = force_records(problem.model, problem.records)
    assert records
    for record in records:
        noise = record.noise_motion[0][record.counts]
        assert noise.std() < 1.5 * NOISE


@pytest.mark.long
@pytest.mark.parametrize(
    ("law", "expected"),
    [
        (cubic, "restoring_force"),
        pytest.param(
            lambda q, v: 4e4 * np.clip(np.abs(q) - 3e-4, 0.0, None) * np.sign(q),
            "restoring_force",
            marks=pytest.mark.long,
        ),
        (lambda q, v: 3e8 * q**2 * v, "coupled_damping"),
    ],
)
def test_sines_at_four_levels_show_the_class(law, expected):
    result = element_problem(sines(law)).class_answer()
    assert result.ids == (expected,)
    assert result.share > 0.98
