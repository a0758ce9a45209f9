"""Load sharing of the shipped case and its variants beside what was measured of the family."""

import re
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from carrierflex.reduction.pin_joints import carrier_with_pins
from carrierflex.simulation.carrier.effects.library import CARRIER_EFFECTS
from carrierflex.simulation.carrier.rim import CarrierInputs, RimSensor
from carrierflex.simulation.stage.quasi_static import quasi_static_turn, sensor_orders
from carrierflex.simulation.stage.stage_body import ShaftData, beam_shaft, joined_to_shaft
from carrierflex.simulation.stage.stage_data import BearingData, StageData
from carrierflex.simulation.stage.stage_model import stage_model
from carrierflex.simulation.stage.statics import SteadyLoad
from carrierflex.workflows.simulation.order_one_supports import clearances
from carrierflex.workflows.simulation.study_order_one import SENSORS
from studies.tabulate_load_sharing import (
    EXTREME_MOMENT,
    FULL_TORQUE,
    MEASURED,
    SharingRow,
    changed_stages,
    loose_and_preloaded,
    sharing,
    sharing_figure,
    sharing_table,
)
from studies.tabulate_stage_readings import LOADS
from tests.diagnosis.carrier.carrier_twin import CARRIER_RIG

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def body(flexible_reduction, pin_reduction):
    carrier = carrier_with_pins(flexible_reduction.model, pin_reduction.model, 1.7e7)
    return joined_to_shaft(carrier, beam_shaft(ShaftData(), carrier.pilots["shaft_face"]))


@pytest.fixture(scope="module")
def factor(body):
    """Row of a stage at full torque by name and moment."""
    loose, preloaded = loose_and_preloaded()
    stages = {stage.name: stage for stage in (loose, preloaded, *changed_stages(loose))}

    def row(name, moment=0.0):
        return sharing(body, stages[name], FULL_TORQUE, moment)

    return row


def test_one_case_within_its_sources_shares_the_load_as_measured(factor):
    still, down, up = (factor("with clearances", m) for m in (0.0, -EXTREME_MOMENT, EXTREME_MOMENT))
    # The case was chosen for the first; what follows are its predictions.
    assert still.share == pytest.approx(MEASURED.no_moment, abs=0.04)
    assert max(down.share, up.share) == pytest.approx(MEASURED.extreme_moment, abs=0.04)
    assert 1.2 < still.upwind < 1.5
    assert still.upwind > 1.05 * still.downwind
    tight = [factor("preloaded", m) for m in (0.0, -EXTREME_MOMENT, EXTREME_MOMENT)]
    assert max(row.share for row in tight) < MEASURED.preloaded
    assert tight[0].upwind < 0.95 * still.upwind


def test_a_floating_sun_shares_as_no_gearbox_of_the_family_did(factor):
    for name in ("quill 5e6 N/m, the default: the sun floats", "no friction: 0.3 mm of play"):
        rows = [factor(name, m) for m in (0.0, -EXTREME_MOMENT, EXTREME_MOMENT)]
        assert max(row.share for row in rows) < 1.03


def test_the_moment_reaches_the_planets_through_the_sun_as_the_closed_form_says(factor):
    # R_i = T / (3 a) + (2/3) F cos(...): sun and ring push the carrier with the same lateral force.
    row = factor("with clearances", -EXTREME_MOMENT)
    expected = 1.0 + 2.0 / 3.0 * 2.0 * row.sun / (FULL_TORQUE / (3.0 * 0.308))
    assert row.share == pytest.approx(expected, abs=0.02)
    # Friction bounds that force; without its bound the planets take more.
    assert factor("friction 0.1", -EXTREME_MOMENT).share > row.share + 0.04
    assert factor("friction 0.05, spline of 90 mm radius", -EXTREME_MOMENT).share < row.share - 0.01


def test_the_page_shows_what_the_stage_gives(factor):
    page = (Path(__file__).parents[2] / "docs" / "stage_model.md").read_text(encoding="utf-8")
    for name in ("with clearances", "preloaded", "quill 1.3e8 N/m, 150 mm x 0.5 m"):
        (line,) = re.findall(rf"^\| {re.escape(name)} \| (.*) \|$", page, re.MULTILINE)
        shown = line.split(" | ")
        rows = [factor(name, m) for m in (0.0, -EXTREME_MOMENT, EXTREME_MOMENT)]
        # The page's elements are half as long.
        assert [float(value) for value in shown[:3]] == pytest.approx(
            [row.share for row in rows], abs=0.005
        )
        assert [float(value) for value in shown[4:6]] == pytest.approx(
            [rows[0].upwind, rows[0].downwind], abs=0.03
        )


@pytest.fixture(scope="module")
def change_by_a_held_sun(body):
    """Readings of a stage with a held sun less those with a floating one [m] by clearance."""

    def signals(share, sun):
        bearings = BearingData(**clearances(share), **sun)
        model = stage_model(body, StageData(bearings=bearings), speed=0.0)
        read = [
            sensor_orders(model, quasi_static_turn(model, SteadyLoad(*load), 8), SENSORS)
            for load in LOADS
        ]
        return np.array([orders.amplitudes[:, 0].real for orders in read])

    return {share: signals(share, {"sun_radial": 1e9}) - signals(share, {}) for share in (0.0, 1.0)}


def test_a_held_sun_shows_at_the_sensors_as_laws_of_the_radial_load_do(change_by_a_held_sun):
    assert np.abs(change_by_a_held_sun[0.0]).max() < 1.5e-6
    gap = change_by_a_held_sun[1.0] - change_by_a_held_sun[1.0][0]
    assert np.sqrt(np.mean(gap**2)) > 20e-6
    sensors = [RimSensor(sensor.angle, sensor.radius, True) for sensor in SENSORS]

    def columns(name, *shape):
        rows = []
        for torque, y, z in LOADS:
            still = (np.full(1, value) for value in (0.0, torque, y, z))
            inputs = CarrierInputs(np.zeros(1), *still, start=0.0, end=1.0)
            law = CARRIER_EFFECTS[name]
            rows.append([law.signals(s, inputs, CARRIER_RIG, *shape)[:, 0] for s in sensors])
        return np.array(rows).reshape(gap.size, -1)

    def residual(*laws):
        A = np.hstack(laws)
        fit, *_ = np.linalg.lstsq(A / np.linalg.norm(A, axis=0).clip(1e-30), gap.ravel())
        return ((gap.ravel() - A / np.linalg.norm(A, axis=0).clip(1e-30) @ fit) ** 2).sum()

    tilt = columns("ntl_tilt")
    weights = np.geomspace(8e3, 6e5, 7)
    rocking = [columns("clearance_rocking", a, b)[:, :1] for a in weights for b in weights]
    total = (gap**2).sum()
    assert residual(tilt) > 0.1 * total
    assert min(residual(law) for law in rocking) > 0.1 * total
    assert min(residual(tilt, law) for law in rocking) < 0.1 * total


def test_table_and_picture_show_every_stage_beside_the_measured():
    loose, preloaded = loose_and_preloaded()
    names = [loose.name, preloaded.name, *(stage.name for stage in changed_stages(loose))]
    numbers = [0.01 * i for i in range(len(fields(SharingRow)) - 3)]
    rows = [
        SharingRow(name, FULL_TORQUE, moment, *numbers)
        for name in names
        for moment in (0.0, -EXTREME_MOMENT, EXTREME_MOMENT)
    ]
    table = "\n".join(sharing_table(rows))
    assert all(f"| {name} |" in table for name in names)
    assert "1.16" in table
    labels = [text.get_text() for text in sharing_figure(rows).axes[2].get_yticklabels()]
    assert labels == [loose.name, *names[2:]]
