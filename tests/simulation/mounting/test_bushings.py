import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.simulation.mounting.bushings import (
    elasto_plastic_force,
    hardening_force,
    hardening_stiffness,
)
from carrierflex.simulation.mounting.parameter_arrays import parameter_array
from carrierflex.simulation.mounting.parameters import INDEX
from carrierflex.simulation.mounting.rig import MountingRig
from carrierflex.simulation.mounting.table_3 import TABLE_3


def test_equation_6_as_printed_is_unstable_and_the_right_one_is_not():
    m, c, k = (TABLE_3["hydrodynamic"][name] for name in "mck")
    # The fluid mass with the bushing held; the sign of c is the printed one and the right one.
    printed = np.sort(np.roots([m, -c, k]).real)
    right = np.sort(np.roots([m, c, k]).real)
    assert_allclose(printed, [8.19, 3.53e5], rtol=2e-3)
    assert_allclose(right, -printed[::-1], rtol=1e-9)
    # The mass adds a root beyond everything; what is left is the Maxwell element's c / k = 0.122 s.
    assert_allclose(-1.0 / right[1], c / k, rtol=1e-4)


def test_equation_7_as_printed_never_yields_on_the_negative_side():
    # Printed: min(Kp u, Fy), which pulls with -166 kN here.
    assert min(-0.02 * 8.29e6, 60.06e3) == pytest.approx(-165.8e3)
    assert elasto_plastic_force(0.0, -0.02, 8.29e6, 60.06e3) == -60.06e3
    assert elasto_plastic_force(0.0, 0.02, 8.29e6, 60.06e3) == 60.06e3
    assert_allclose(60.06e3 / 8.29e6, 7.2e-3, rtol=0.01)  # deflection at yield


def test_nonlinear_bushing_of_table_3_reaches_the_deflection_worked_out_from_it():
    # 360 kN m on two bushings at 0.75 m: 8.24 mm and 11.0 mrad.
    K1, K3, K5 = (TABLE_3["nonlinear"][name] for name in ("K1", "K3", "K5"))
    deflection = 8.24e-3
    force = K1 * deflection + hardening_force(deflection, K3, K5)
    assert_allclose(2.0 * force * 0.75, 360e3, rtol=0.01)
    step = 1e-7
    slope = (
        hardening_force(deflection + step, K3, K5) - hardening_force(deflection, K3, K5)
    ) / step
    assert_allclose(slope, hardening_stiffness(deflection, K3, K5), rtol=1e-4)


@pytest.mark.parametrize("model", TABLE_3)
def test_table_3_is_a_parameter_set_within_bounds(model):
    values = parameter_array(MountingRig(), TABLE_3[model])
    assert_allclose([values[INDEX[name]] for name in TABLE_3[model]], list(TABLE_3[model].values()))
