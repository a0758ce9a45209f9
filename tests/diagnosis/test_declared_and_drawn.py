"""Values of the baseline that contradict what was declared, or the drawing of the carrier."""

from dataclasses import replace

import pytest

from carrierflex.diagnosis.baseline_check import checked_baseline
from carrierflex.diagnosis.carrier.problem import carrier_problem
from carrierflex.identification.campaign.declarations import Baseline, KnownValue
from carrierflex.workflows.fe.default_curves import default_curves

from .carrier.test_tilt_or_load_sharing import FOUR_RUNS, campaign

#: The twin's rho_f; its delta_s has no part.
TRUE_SIZE = 0.3


def nothing(load, theta, v, torque):
    """No cause beside the baseline."""
    return 0.0 * theta


def findings(scale, fixed=None):
    """Findings of a baseline whose curves are scaled: rho_f is 0.3 / scale."""
    measured = campaign(nothing, FOUR_RUNS, 2)
    baseline = Baseline("model", measured.baseline.effects, fixed=fixed or {})
    measured = replace(measured, baseline=baseline)
    curves = {
        name: replace(curve, axial=scale * curve.axial) for name, curve in default_curves().items()
    }
    problem = carrier_problem(measured, curves)
    check = checked_baseline(problem, measured, problem.wiring(measured))
    return {warning.check: warning for warning in check.warnings}


@pytest.mark.parametrize(
    ("size", "words"),
    [(1.0, ""), (1.1, "10% more flexible than drawn"), (0.5, "")],
)
def test_a_carrier_off_its_drawing_is_said_to_be(size, words):
    warnings = findings(TRUE_SIZE / size)
    assert ("drawing" in warnings) == bool(words)
    if words:
        assert words in warnings["drawing"].text
        assert warnings["drawing"].figure == pytest.approx(size, abs=0.01)


@pytest.mark.parametrize(("declared", "is_told"), [(1.0, False), (0.9, True)])
def test_a_declared_value_that_the_records_contradict_is_told(declared, is_told):
    warnings = findings(TRUE_SIZE, {"flexible_pins.rho_f": KnownValue(declared, 0.02)})
    assert ("prior" in warnings) == is_told
    if is_told:
        assert "rho_f of flexible pins is fitted as" in warnings["prior"].text
        assert warnings["prior"].line.endswith("flexible_pins.rho_f")
