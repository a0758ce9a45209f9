"""Limit of fine meshes, and the pin fit of table 4 with its interval."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.fe.load_cases import gear_forces
from carrierflex.fe.mesh_limits import mesh_limit
from carrierflex.geometry.parameter_files import read_parameters
from carrierflex.identification.carrier.printed_tables import Printed, derived_facts
from carrierflex.reduction.pin_fit import PinFitFamily
from carrierflex.workflows.main_job import check_mesh_convergence
from carrierflex.workflows.main_job.check_mesh_convergence import MeshStudy
from studies.tabulate_mesh_limit import fits_of_table_4, limit_table

SIZES = (0.04, 0.03, 0.02)


def test_the_limit_of_a_line_is_exact_and_its_error_is_the_scatter():
    values = np.array([2.0 - 3.0 * h for h in SIZES])
    limit, error = mesh_limit(SIZES, values)
    assert_allclose([limit, error], [2.0, 0.0], atol=1e-12)
    rng = np.random.default_rng(1)
    noisy = values[:, None] + 1e-3 * rng.standard_normal((3, 20_000))
    limit, error = mesh_limit(SIZES, noisy)
    assert_allclose(limit.std(), np.sqrt(np.mean(error**2)), rtol=0.05)
    assert np.isnan(mesh_limit(SIZES[:2], values[:2])[1])


@pytest.mark.long
def test_coarse_meshes_predict_finer_ones_by_a_line_in_the_size():
    stage = read_parameters(None)
    coarse = check_mesh_convergence.main(stage, (0.05, 0.035, 0.025))
    (fine,) = check_mesh_convergence.main(stage, (0.016,)).flexible
    limit, _ = mesh_limit(coarse.sizes, coarse.flexible)
    slope = (coarse.flexible[0] - limit) / coarse.sizes[0]
    # Order 3; order 6 of the flexible carrier hardly changes. A square law would end 2 % lower.
    assert (limit + 0.016 * slope)[0] == pytest.approx(fine[0], rel=5e-3)
    square, _ = mesh_limit(np.square(coarse.sizes), coarse.flexible)
    assert abs(square[0] / limit[0] - 1.0) > 0.01


@pytest.mark.long
def test_the_fits_of_table_4_have_the_printed_rim_deflection(flexible_reduction, pin_reduction):
    stage = read_parameters(None)
    family = PinFitFamily(
        flexible_reduction.model,
        pin_reduction.model,
        gear_forces(1e3, stage.gear, 3),
        stage.carrier.sensor_radius,
    )
    deflection = derived_facts().common_deflection_per_torque
    value, lowest, highest = fits_of_table_4(family, deflection)
    assert lowest < value < highest
    for stiffness, wanted in ((value, deflection.value), (lowest, deflection.high)):
        assert_allclose(family.curve(stiffness).rms, 1e3 * wanted, rtol=1e-3)


def test_the_table_ends_with_the_limit():
    amplitudes = 1e-6 * np.array([[0.2 - h, 0.02 - 0.1 * h] for h in SIZES])
    study = MeshStudy(SIZES, (1, 2, 3), amplitudes, amplitudes)
    fits = {h: np.array([2e7, 1.9e7, 2.1e7]) * (1.0 - 5.0 * h) for h in SIZES}
    curves, pins = "\n".join(limit_table(study, fits)).split("\n\n")
    assert "| limit, linear in the size | | 0.2000 | 0.0200 | 0.2000 | 0.0200 |" in curves
    assert "| limit, linear in the size | 2e+07 | 1.9e+07 | 2.1e+07 |" in pins
    assert isinstance(derived_facts().common_deflection_per_torque, Printed)
