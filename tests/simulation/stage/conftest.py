"""The stage on the coarse carrier that the whole test session shares."""

import numpy as np
import pytest

from carrierflex.geometry.pins import PAPER_STIFFNESS
from carrierflex.reduction.pin_joints import carrier_with_pins
from carrierflex.simulation.stage import modal_form, response
from carrierflex.simulation.stage.stage_body import ShaftData, beam_shaft, joined_to_shaft
from carrierflex.simulation.stage.stage_model import stage_model

#: 22.1 rpm [rad/s].
SPEED = 22.1 * np.pi / 30.0


@pytest.fixture(scope="session")
def pinned_carrier(flexible_reduction, pin_reduction):
    return carrier_with_pins(flexible_reduction.model, pin_reduction.model, PAPER_STIFFNESS)


@pytest.fixture(scope="session")
def stage_body(pinned_carrier):
    return joined_to_shaft(
        pinned_carrier, beam_shaft(ShaftData(), pinned_carrier.pilots["shaft_face"])
    )


@pytest.fixture(scope="session")
def nominal_stage(stage_body):
    return stage_model(stage_body, speed=SPEED)


@pytest.fixture
def all_modes(monkeypatch):
    """Steps in which no mode answers statically."""
    with monkeypatch.context() as patched:
        patched.setattr(modal_form, "_FASTEST", np.inf)
        response._prepared.cache_clear()
        yield
    response._prepared.cache_clear()
