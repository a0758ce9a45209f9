"""Several causes of like size, none of which explains most of the gap alone.

A baseline without effects.
"""

import numpy as np
import pytest

from carrierflex.diagnosis.diagnose import diagnose
from tests.diagnosis.carrier.carrier_twin import KNOWN, twin_problem

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def nothing_in_the_baseline():
    return diagnose(twin_problem(contained=()), campaign="twin", kind="carrier")


def test_all_missing_effects_are_named_where_the_baseline_holds_none(nothing_in_the_baseline):
    diagnosis = nothing_in_the_baseline
    assert diagnosis.verdict == "named", diagnosis.reason
    assert set(diagnosis.attribution.effects) == set(KNOWN)
    assert diagnosis.reduction.rho == pytest.approx(
        diagnosis.reduction.noise_floor / diagnosis.reduction.rms_before, rel=0.05
    )


def test_their_parameters_are_the_true_ones(nothing_in_the_baseline):
    parameters = nothing_in_the_baseline.attribution.parameters
    assert parameters["axial_offset"]["d_x of run1"].value == pytest.approx(1e-4, rel=0.01)
    assert parameters["carrier_tilt"]["phi_PLC"].value == pytest.approx(
        np.hypot(3e-4, 5e-4), rel=0.01
    )
    assert parameters["housing_tilt"]["phi_H"].value == pytest.approx(
        np.hypot(1e-4, 4e-4), rel=0.01
    )
    assert parameters["flexible_pins"]["rho_f"].value == pytest.approx(0.6, rel=0.02)


def test_several_causes_beside_one_outside_the_library_leave_a_remainder_or_nothing_named():
    """A wave of one sensor as large as all tilts together.

    What is named must not claim the whole.
    """
    problem = twin_problem(
        contained=(),
        extra=lambda channel, angle: 6e-4 * np.cos(10.0 * angle) * (channel.name == "s227"),
    )
    diagnosis = diagnose(problem, campaign="twin", kind="carrier")
    assert diagnosis.verdict == "none_of_these", (diagnosis.attribution.effects, diagnosis.reason)
