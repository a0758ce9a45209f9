"""Another integrator than the stage's own: same motion, second order, high modes damped."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.simulation.stage.effects import StageEffects
from carrierflex.simulation.stage.generalised_alpha import run_by_generalised_alpha
from carrierflex.simulation.stage.response import (
    joined_records,
    quasi_static_start,
    run_stage,
    steady_drive,
)
from carrierflex.simulation.stage.stage_data import (
    BearingData,
    RollerBearingData,
    StageData,
)
from carrierflex.simulation.stage.stage_model import stage_model
from carrierflex.simulation.stage.statics import SteadyLoad
from tests.simulation.stage.conftest import SPEED

LOAD = SteadyLoad(360e3, ntl_z=-200e3)


@pytest.fixture(scope="module")
def loose(stage_body):
    """Rollers, clearances, a spline, a kink: every channel that the stage has."""
    bearings = replace(
        BearingData(),
        upwind_clearance=0.14e-3,
        downwind_clearance=0.12e-3,
        planet_clearance=40e-6,
        sun_radial=3e8,
        sun_friction=0.05,
        sun_clearance=0.3e-3,
    )
    data = StageData(bearings=bearings, planet_rollers=RollerBearingData())
    return stage_model(stage_body, data, effects=StageEffects(phi_PLC=1e-3), speed=SPEED)


def swung(model):
    """Torque that swings by a fifth five times a second."""
    steady = steady_drive(model, LOAD)

    def drive(time):
        rows = steady(time)
        rows[:, 0] *= 1.0 + 0.2 * np.sin(10.0 * np.pi * time) ** 2
        return rows

    return drive


@pytest.mark.long
def test_both_integrators_come_to_one_motion_with_the_square_of_the_step(loose):
    drive, start = swung(loose), quasi_static_start(loose, LOAD)
    settings = {"duration": 0.1, "sample_rate": 100.0}
    reference = joined_records(list(run_stage(loose, drive, start, step=3.125e-5, **settings)))
    rows = [
        0,
        loose.labels.index("housing Tz [m]"),
        loose.labels.index("generator Rx [rad]"),
    ]
    steps = np.array([1e-3, 5e-4, 2.5e-4])
    errors = []
    for step in steps:
        other = run_by_generalised_alpha(loose, drive, start, step=step, **settings)
        errors.append(np.abs(other.c[:, rows] - reference.c[:, rows]).max(axis=0))
    swing = np.ptp(reference.c[:, rows], axis=0)
    assert (errors[-1] < 1e-3 * swing).all(), errors[-1] / swing
    slopes = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert (slopes > 1.6).all(), slopes
    assert (slopes < 2.4).all(), slopes


def test_too_long_a_step_is_refused(nominal_stage):
    start = quasi_static_start(nominal_stage, LOAD)
    drive = steady_drive(nominal_stage, LOAD)
    with pytest.raises(ValueError, match=r"step is 0\.01 s, too large for the mesh period"):
        run_by_generalised_alpha(
            nominal_stage, drive, start, duration=0.1, sample_rate=10.0, step=0.01
        )
