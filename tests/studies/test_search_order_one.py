"""The search for supports that show a given order 1."""

import numpy as np
import pytest

from carrierflex.reduction.pin_joints import PAPER_STIFFNESS, carrier_with_pins
from carrierflex.simulation.stage.stage_body import ShaftData, beam_shaft, joined_to_shaft
from studies.search_order_one import (
    RANGES,
    order_1,
    search,
    support_of,
)

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def body(flexible_reduction, pin_reduction):
    carrier = carrier_with_pins(flexible_reduction.model, pin_reduction.model, PAPER_STIFFNESS)
    return joined_to_shaft(carrier, beam_shaft(ShaftData(), carrier.pilots["shaft_face"]))


def test_a_kink_is_found_back_from_the_order_1_it_makes(body):
    truth = {
        "phi_PLC": 1.1e-3,
        "axial_stiffness": 6e6,
        "x": 0.3,
        "tilt_stiffness": 2e5,
        "upwind_radial": 3e8,
        "downwind_radial": 3e8,
    }
    wanted = {name: order_1(body, support_of(truth), name) for name in ("LC1", "LC4")}
    assert wanted["LC4"] != pytest.approx(wanted["LC1"], rel=0.05)
    # All but the kink known: one number from two amplitudes.
    known = {name: (value, value * (1.0 + 1e-9)) for name, value in truth.items()}
    ranges = {**known, "phi_PLC": RANGES["phi_PLC"]}
    rng = np.random.default_rng(1)
    found = search(body, wanted, ranges, rng, n_points=4, n_starts=1)
    assert found.values["phi_PLC"] == pytest.approx(truth["phi_PLC"], rel=1e-3)
    assert found.order_1["LC4"] == pytest.approx(wanted["LC4"], rel=1e-3)
    # Torque changes next to nothing: LC1 and LC2 of the paper cannot both be met.
    assert found.order_1["LC2"] == pytest.approx(found.order_1["LC1"], rel=0.01)
