"""The mesh's error of the curves: known laws in the size, and the finite elements' own."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.fe.mesh_limits import curve_errors, mesh_errors
from carrierflex.geometry.parameter_files import StageParameters

ANGLE = 2.0 * np.pi * np.arange(360) / 360


def curve(name, amplitude, phase):
    axial = amplitude * np.cos(3 * ANGLE + phase) + 0.1 * np.cos(6 * ANGLE)
    return {name: DeflectionCurve(name, 0.4, 1000.0, axial, 0.0 * ANGLE)}


def test_an_order_that_is_linear_in_the_size_has_its_limit_and_no_scatter():
    sizes = (0.03, 0.025, 0.02)
    curves = [curve("delta_f", 2.0 - 10.0 * h, 0.4) for h in sizes]
    error = next(curve_errors(sizes, curves, 3))
    assert (error.curve, error.order) == ("delta_f", 3)
    assert_allclose([error.amplitude, error.limit, error.error], [1.8, 2.0, 0.2], rtol=1e-12)
    assert error.standard_error < 1e-12
    assert_allclose(error.share, 0.2 / np.sqrt((1.8**2 + 0.1**2) / 2.0), rtol=1e-12)


def test_a_phase_that_moves_with_the_size_is_an_error_too():
    sizes = (0.03, 0.02)
    error = next(curve_errors(sizes, [curve("delta_f", 1.0, 10.0 * h) for h in sizes], 3))
    assert error.error > 0.15
    assert np.isnan(error.standard_error)


@pytest.mark.long
def test_the_limit_lies_beyond_a_finer_mesh():
    """Finite elements are too stiff: order 3 grows as they shrink, towards the limit."""
    stage = StageParameters()
    coarse, fine = (
        {(one.curve, one.order): one for one in mesh_errors(stage, size)} for size in (0.06, 0.04)
    )
    assert {name for name, _ in fine} == {"delta_s", "delta_f", "g_s", "g_f"}
    for key in (("delta_f", 3), ("delta_s", 3), ("delta_s", 6)):
        assert coarse[key].amplitude < fine[key].amplitude < coarse[key].limit
