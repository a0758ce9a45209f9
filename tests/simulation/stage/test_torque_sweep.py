"""Torsional stiffness of main shaft and gearbox from the whole stage."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.simulation.stage.stage_data import ChainData, MountingData, StageData
from carrierflex.simulation.stage.stage_model import stage_model
from carrierflex.simulation.stage.torque_sweep import stage_sweeps

TORQUES = np.array([180e3, 360e3])


def gearbox_stiffness(body, data):
    return stage_sweeps(stage_model(body, data, speed=0.0), TORQUES).gearbox.stiffness


def test_shaft_and_gearbox_have_the_stiffness_they_were_given(stage_body):
    sweeps = stage_sweeps(stage_model(stage_body, speed=0.0), TORQUES)
    assert_allclose(sweeps.main_shaft.stiffness, 50e6, rtol=5e-3)
    assert_allclose(sweeps.gearbox.stiffness, 27e6, rtol=0.03)


def test_a_softer_sun_shaft_adds_its_flexibility_over_the_ratio_squared(stage_body):
    nominal, chain = StageData(), ChainData()
    soft = replace(nominal, chain=replace(chain, sun_shaft_torsion=chain.sun_shaft_torsion / 2.0))
    added = 1.0 / gearbox_stiffness(stage_body, soft) - 1.0 / gearbox_stiffness(stage_body, nominal)
    assert_allclose(added, 1.0 / (chain.sun_shaft_torsion * nominal.gear.ratio**2), rtol=1e-6)


def test_the_gearbox_is_as_stiff_on_soft_bushings_as_on_stiff_ones(stage_body):
    # The roll of the housing is taken out: with it the gearbox would be softer by a half.
    stiff = StageData(mounting=replace(MountingData(), radial_stiffness=1e12))
    assert_allclose(
        gearbox_stiffness(stage_body, stiff), gearbox_stiffness(stage_body, StageData()), rtol=1e-4
    )


@pytest.mark.parametrize("torques", [[1e5], [0.0, 1e5], [1e5, np.nan]])
def test_torques_that_give_no_slope_are_refused(nominal_stage, torques):
    with pytest.raises(
        ValueError, match=r"torque sweep: torques are .* N m; expected two or more positive numbers"
    ):
        stage_sweeps(nominal_stage, np.array(torques))
