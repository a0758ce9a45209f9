"""Frequencies, frequency response and Campbell diagram of the assembled stage."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
from numpy.testing import assert_allclose

from carrierflex.simulation.stage.linearised import (
    campbell_diagram,
    frequency_response,
    linearised_modes,
    stage_state_space,
)
from carrierflex.simulation.stage.modal_form import modal_stage
from carrierflex.simulation.stage.stage_data import ChainData, MountingData, StageData
from carrierflex.simulation.stage.stage_model import stage_model
from carrierflex.simulation.stage.statics import SteadyLoad, static_coordinates
from tests.simulation.stage.conftest import SPEED


@pytest.fixture(scope="module")
def modal(nominal_stage):
    return modal_stage(nominal_stage)


def test_modes_make_mass_and_stiffness_diagonal(modal, nominal_stage):
    n = len(modal.omega)
    assert_allclose(modal.Phi.T @ nominal_stage.M @ modal.Phi, np.eye(n), rtol=0.0, atol=1e-7)
    K = modal.Phi.T @ nominal_stage.K @ modal.Phi
    scale = np.maximum(modal.omega, modal.omega[1])
    assert_allclose(
        K / np.outer(scale, scale), np.diag(modal.omega**2 / scale**2), rtol=0.0, atol=1e-7
    )


def test_undamped_roots_are_those_of_mass_and_stiffness(stage_body):
    none = replace(MountingData(), radial_damping=0.0, axial_damping=0.0)
    data = StageData(
        mounting=none, chain=replace(ChainData(), generator_constant=0.0), damping_ratio=0.0
    )
    model = stage_model(stage_body, data, speed=0.0)
    modes = linearised_modes(modal_stage(model))
    reference = np.sqrt(
        scipy.linalg.eigh(model.K[1:, 1:], _reduced_mass(model.M), eigvals_only=True)
    ) / (2.0 * np.pi)
    assert_allclose(modes.frequency_hz[:40], reference[:40], rtol=1e-5)
    assert np.abs(modes.damping_ratio[:40]).max() < 1e-9


def _reduced_mass(M):
    return M[1:, 1:] - np.outer(M[1:, 0], M[0, 1:]) / M[0, 0]


def test_the_drive_train_swings_near_the_papers_frequency(stage_body):
    # 2011 paper: 1.47 Hz with bushings of 11.4 MN m/rad; with 22.7 (two bushings) and everything in
    # one housing the torsional model of the same data gives 1.57 Hz. The generator's speed control
    # is left out there.
    data = StageData(chain=replace(ChainData(), generator_constant=0.0))
    first = linearised_modes(modal_stage(stage_model(stage_body, data, speed=SPEED))).frequency_hz[
        0
    ]
    assert_allclose(first, 1.57, rtol=0.03)


def test_no_root_grows(modal):
    assert (linearised_modes(modal).damping_ratio > 0.0).all()


def test_slow_force_meets_the_static_stiffness(stage_body, modal):
    # A radial load at the coupling, which the drive does not feel. Bushings under the housing's
    # centre without axial stiffness: a mount that is the same at every angle.
    even = StageData(mounting=replace(MountingData(), axial_stiffness=0.0, x=0.5))
    still = stage_model(stage_body, even, speed=0.0)
    load = SteadyLoad(360e3, gravity=0.0), SteadyLoad(360e3, ntl_z=1e3, gravity=0.0)
    before, after = (static_coordinates(still, steady, mean_stiffness=True) for steady in load)
    row = np.zeros(len(before))
    row[still.labels.index("housing Tz [m]")] = 1.0
    response = frequency_response(modal_stage(still), np.array([1e-3]), still.loads.radial_z, row)
    assert_allclose(response[0].real * 1e3, row @ (after - before), rtol=1e-5)
    with pytest.raises(ValueError, match=r"smallest frequency is 0\.0 Hz"):
        frequency_response(modal, np.array([0.0]), row, row)


def test_campbell_diagram_finds_where_the_mesh_meets_a_mode(stage_body):
    speeds = np.linspace(0.2, 1.8, 3) * SPEED
    diagram = campbell_diagram(stage_body, speeds, n_modes=12)
    assert diagram.frequency_hz.shape == (3, 12)
    assert_allclose(np.interp(SPEED, speeds, diagram.order_hz["mesh"]), 36.465, rtol=1e-6)
    crossings = diagram.crossings("mesh")
    assert len(crossings) > 0
    for speed in crossings:
        frequencies = [np.interp(speed, speeds, mode) for mode in diagram.frequency_hz.T]
        assert np.abs(np.array(frequencies) - 99 * speed / (2.0 * np.pi)).min() < 1e-6


def test_the_state_space_has_the_modes_and_the_response_of_the_stage(modal):
    rng = np.random.default_rng(3)
    readings = rng.standard_normal((2, len(modal.omega)))
    system = stage_state_space(modal, readings, ("a", "b"))
    modes = linearised_modes(modal)
    result = np.linalg.eigvals(system.A)
    result = np.sort(result.imag[result.imag > 2.0 * np.pi * 1e-3])
    assert_allclose(result, 2.0 * np.pi * modes.frequency_hz, rtol=1e-10)
    hz = np.array([0.5, 3.0, 40.0, 700.0])
    H = system.frequency_response(hz)
    loads = modal.model.loads
    for row, reading in enumerate(readings):
        for column, force in enumerate((loads.torque, loads.radial_y, loads.radial_z)):
            expected = frequency_response(modal, hz, force, reading)
            assert_allclose(H[:, row, column], expected, rtol=1e-8)
    assert system.operating_point == {"speed [rad/s]": SPEED}
