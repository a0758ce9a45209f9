import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.simulation.mounting.bushings import (
    HydrodynamicBushing,
    LinearBushing,
    NonlinearBushing,
    elasto_plastic_force,
    elasto_plastic_force_as_printed,
    fluid_roots,
    fluid_roots_as_printed,
    hardening_force,
    hardening_stiffness,
)


def test_equation_6_as_printed_is_unstable_and_the_right_one_is_not():
    table = HydrodynamicBushing()
    printed = np.sort(fluid_roots_as_printed(table.m, table.c, table.k).real)
    right = np.sort(fluid_roots(table.m, table.c, table.k).real)
    assert_allclose(printed, [8.19, 3.53e5], rtol=2e-3)
    assert_allclose(right, -printed[::-1], rtol=1e-9)
    # The mass adds a root beyond everything; what is left is the Maxwell element's c / k = 0.122 s.
    assert_allclose(-1.0 / right[1], table.c / table.k, rtol=1e-4)


def test_equation_7_as_printed_never_yields_on_the_negative_side():
    assert elasto_plastic_force_as_printed(0.0, -0.02, 8.29e6, 60.06e3) == pytest.approx(-165.8e3)
    assert elasto_plastic_force(0.0, -0.02, 8.29e6, 60.06e3) == -60.06e3
    assert elasto_plastic_force(0.0, 0.02, 8.29e6, 60.06e3) == 60.06e3
    assert_allclose(60.06e3 / 8.29e6, 7.2e-3, rtol=0.01)  # deflection at yield


def test_nonlinear_bushing_of_table_3_reaches_the_deflection_worked_out_from_it():
    # 360 kN m on two bushings at 0.75 m: 8.24 mm and 11.0 mrad.
    table = NonlinearBushing()
    deflection = 8.24e-3
    force = table.K1 * deflection + hardening_force(deflection, table.K3, table.K5)
    assert_allclose(2.0 * force * 0.75, 360e3, rtol=0.01)
    step = 1e-7
    slope = (
        hardening_force(deflection + step, table.K3, table.K5)
        - hardening_force(deflection, table.K3, table.K5)
    ) / step
    assert_allclose(slope, hardening_stiffness(deflection, table.K3, table.K5), rtol=1e-4)


def test_bushings_hand_their_constants_to_the_model_by_name():
    assert LinearBushing().parameters() == {"K1": 20.2e6, "C1": 4.83e6, "P_T": 0.119}
    assert NonlinearBushing().parameters()["C3"] == 1.15e6
    assert set(HydrodynamicBushing().parameters()) == {
        "C1",
        "K1",
        "K3",
        "K5",
        "m",
        "c",
        "k",
        "Kp",
        "Fy",
        "P_T",
    }


@pytest.mark.parametrize("wrong", [{"K1": -1.0}, {"Fy": float("nan")}])
def test_negative_or_missing_constants_are_refused(wrong):
    name = next(iter(wrong))
    with pytest.raises(
        ValueError, match=f"HydrodynamicBushing: {name} is .*; expected a finite number >= 0"
    ):
        HydrodynamicBushing(**wrong)
