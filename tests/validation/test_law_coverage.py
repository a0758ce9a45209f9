"""Which intervals of an answer with the true laws count, and when they hold the truth."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.blind_check.labels import SINGLE, Label
from carrierflex.diagnosis.inference.results import NamedValue
from validation.law_coverage import covered_values, has_true_parameters

LABEL = Label(
    case="carrier-0001",
    kind="carrier",
    family=SINGLE,
    effects=("sensor_gain",),
    acceptable=(("sensor_gain",),),
    present=(),
    gap_over_floor=5.0,
    floor=1e-6,
    rho=0.2,
    parameters={
        "sensor_gain": {"g_s047": 0.1},
        "housing_tilt": {"phi_H": 2e-4, "theta_H": np.pi - 0.01},
        "flexible_pins": {"rho_f": 1.0},
    },
    where={},
)


def _value(value, half):
    return NamedValue(value, half / 1.96, "1", (value - half, value + half))


CLAIMED = {
    "sensor_gain": {"g_s047": _value(0.12, 0.01)},
    "housing_tilt": {"phi_H": _value(2.1e-4, 2e-5), "theta_H": _value(-np.pi + 0.01, 0.03)},
    "flexible_pins": {"rho_f": _value(1.0, 0.01)},
}


def test_directions_close_the_circle_and_curves_of_another_carrier_do_not_count():
    hits = {hit.name: hit for hit in covered_values(LABEL, CLAIMED, (0.1, 0.19))}
    assert {name: hit.is_covered for name, hit in hits.items()} == {
        "sensor_gain.g_s047": False,
        "housing_tilt.phi_H": True,
        "housing_tilt.theta_H": True,
        "rho": False,
    }
    assert hits["housing_tilt.theta_H"].half_width == pytest.approx(0.03)
    assert hits["housing_tilt.phi_H"].half_width == pytest.approx(0.1)
    assert hits["rho"].half_width == pytest.approx(0.045 / 0.2)
    assert [hit.is_baseline for hit in hits.values()] == [False, True, True, False]


def test_a_gain_at_another_sensor_counts_nothing():
    elsewhere = {**CLAIMED, "sensor_gain": {"g_s137": _value(0.1, 0.01)}}
    assert not covered_values(LABEL, elsewhere, (0.1, 0.3))


def test_without_an_effect_there_is_no_rho():
    nothing = replace(
        LABEL, effects=(), acceptable=(), parameters={"housing_tilt": {"phi_H": 2e-4}}
    )
    assert [hit.name for hit in covered_values(nothing, CLAIMED, (1.0, 1.0))] == [
        "housing_tilt.phi_H"
    ]


def test_laws_of_another_form_have_no_true_parameters():
    assert has_true_parameters("mounting", ())
    assert has_true_parameters("mounting", ("sensor_gain", "unequal_bushings"))
    assert not has_true_parameters("mounting", ("sensor_gain", "cubic_stiffness"))
    assert not has_true_parameters("carrier", ("thermal_drift",))
