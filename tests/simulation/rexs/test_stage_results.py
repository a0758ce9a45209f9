"""Results of a run as attributes of REXS components: statics, life, signs."""

import math

import numpy as np
import pytest

from carrierflex.geometry.parameters import GearData
from carrierflex.simulation.rexs.planetary_stage import (
    chosen_stage,
    placement,
    planetary_stage,
    position,
)
from carrierflex.simulation.rexs.rexs_files import read_rexs
from carrierflex.simulation.rexs.stage_results import RunMeans
from tests.simulation.rexs.public_sample import public_stage, shipped_gearbox

TORQUE, TILT, AXIAL = 360e3, 2e3, 500.0
TANGENTIAL = -TORQUE / (3.0 * 0.308)


def columns(n_samples=4):
    """Load columns of equal planets that carry a torque, a tilting moment on the pins besides."""
    values = {"torque": TORQUE, "carrier_speed": 2.3, "sun_speed": 13.1, "load_sharing_factor": 1.0}
    for p in (1, 2, 3):
        values |= {f"planet_{p}_speed": -3.5, f"sun_mesh_{p}": 4e5, f"ring_mesh_{p}": -4e5}
        values |= {
            f"pin_{p}_force_axial": AXIAL,
            f"pin_{p}_force_radial": 0.0,
            f"pin_{p}_force_tangential": TANGENTIAL,
            f"pin_{p}_moment_axial": 0.0,
            f"pin_{p}_moment_radial": TILT,
            f"pin_{p}_moment_tangential": 0.0,
        }
    for bearing in ("bearing_A", "bearing_B", "sun_support"):
        numbers = (1e3, 2e3, 3e3, 0.0, 0.0)
        values |= dict(
            zip((f"{bearing}_{c}" for c in ("x", "y", "z", "my", "mz")), numbers, strict=True)
        )
    return {name: np.full(n_samples, value) for name, value in values.items()}


def stage_of(model, folder):
    read = read_rexs(model.write_xml(folder / "a.rexs"))
    return planetary_stage(read, chosen_stage(read, None))


def results_of(stage, *pieces):
    means = RunMeans(stage)
    for piece in pieces:
        means.append(piece)
    return means.results(GearData())


def force(stage, results, bearing):
    """Force on the inner side in the model's frame."""
    values = [results[bearing.id][f"force_acting_on_inner_component_{a}"] for a in "uvw"]
    return np.array(values) @ stage.axes_of(bearing)


@pytest.mark.parametrize("make", [shipped_gearbox, public_stage])
def test_bearing_forces_make_the_torque_and_the_moments_of_the_pins(make, tmp_path):
    """``Σ r x F`` of all planet bearings about the axis, and of two on one pin about its middle."""
    stage = stage_of(make(), tmp_path)
    results = results_of(stage, columns())
    torque, arm = 0.0, None
    for planet in stage.planets:
        gear_position = position(stage.model, planet.gear)
        pair = [(position(stage.model, b), force(stage, results, b)) for b in planet.bearings]
        arm = planet.radial * float(
            np.linalg.norm(gear_position - stage.axes[0] * (stage.axes[0] @ gear_position))
        )
        torque += sum(float(stage.axes[0] @ np.cross(arm, f)) for _, f in pair)
        total = sum(f for _, f in pair)
        assert stage.axes[0] @ total == pytest.approx(AXIAL)
        middle = sum(r for r, _ in pair) / 2.0
        moment = sum(np.cross(r - middle, f) for r, f in pair)
        assert moment @ planet.radial == pytest.approx(TILT, rel=1e-9)
        tangential = np.cross(stage.axes[0], planet.radial)
        assert moment @ tangential == pytest.approx(0.0, abs=1e-6)
    distance = float(np.linalg.norm(arm))
    assert torque == pytest.approx(3.0 * TANGENTIAL * distance, rel=1e-9)


def test_forces_of_merged_bearings_add_to_their_load(tmp_path):
    """Two bearings of the public file on the hub: force and moment of the one of the model."""
    stage = stage_of(public_stage(), tmp_path)
    piece = columns()
    piece["bearing_A_my"], piece["bearing_A_mz"] = np.full(4, 40.0), np.full(4, -70.0)
    results = results_of(stage, piece)
    pair = [(position(stage.model, b), force(stage, results, b)) for b in stage.upwind_bearings]
    total = stage.axes @ sum(f for _, f in pair)
    assert total == pytest.approx([1e3, 2e3, 3e3])
    middle = sum(r for r, _ in pair) / 2.0
    moment = stage.axes @ sum(np.cross(r - middle, f) for r, f in pair)
    assert moment[1:] == pytest.approx([40.0, -70.0])
    # One of them takes no axial force.
    assert results[60]["force_acting_on_inner_component_u"] == 0.0


def test_turned_bearings_state_forces_in_their_axes(tmp_path):
    model = shipped_gearbox()
    straight = stage_of(model, tmp_path)
    expected = force(straight, results_of(straight, columns()), straight.planets[0].bearings[0])
    turned = [0.0, math.sin(0.4), math.cos(0.4)]
    model.attribute(90, "w_axis_vector")["value"] = turned
    stage = stage_of(model, tmp_path)
    axes, _ = placement(stage.model, stage.model.components[90])
    assert axes @ axes.T == pytest.approx(np.eye(3))
    assert axes[2] == pytest.approx(turned)
    results = results_of(stage, columns())
    turned_force = force(stage, results, stage.model.components[90])
    assert turned_force == pytest.approx(expected, abs=1e-6)
    assert results[90]["force_acting_on_inner_component_w"] != pytest.approx(expected[2])


@pytest.mark.parametrize("bearing", [90, 120], ids=["planet", "hub"])
def test_a_force_on_the_other_side_of_a_bearing_is_turned_round(bearing, tmp_path):
    model = shipped_gearbox()
    for relation in model.relations:
        roles = {ref["role"]: ref for ref in relation["refs"]}
        if relation["type"] == "side" and roles["assembly"]["id"] == bearing:
            inner, outer = roles["inner_part"], roles["outer_part"]
            inner["id"], outer["id"] = outer["id"], inner["id"]
    stage, before = stage_of(model, tmp_path), stage_of(shipped_gearbox(), tmp_path)
    one, other = (
        force(each, results_of(each, columns()), each.model.components[bearing])
        for each in (stage, before)
    )
    assert np.linalg.norm(one) > 1.0
    assert one == pytest.approx(-other)


def test_life_by_hand(tmp_path):
    """``L_10 = (C/P)^(10/3)`` million turns; half of the run at twice the load."""
    stage = stage_of(shipped_gearbox(), tmp_path)
    piece = columns()
    for p in (1, 2, 3):
        piece[f"pin_{p}_moment_radial"] *= 0.0
    heavy = {name: values * (2.0 if "pin" in name else 1.0) for name, values in piece.items()}
    life = "nominal_rating_life_rotations_iso_281_2007"
    alone = results_of(stage, piece)[90]
    turns = (1200e3 / (abs(TANGENTIAL) / 2.0)) ** (10.0 / 3.0) * 1e6
    assert alone[life] == pytest.approx(2.0 * math.pi * turns, rel=1e-9)
    # A planet turns on its pin 99/39 times as fast as the carrier.
    hours = 2.0 * math.pi * turns / (2.3 * 99 / 39)
    assert alone["nominal_rating_life_time_iso_281_2007"] == pytest.approx(hours, rel=1e-9)
    both = results_of(stage, piece, heavy)[90]
    assert both[life] == pytest.approx(alone[life] / (0.5 * (1 + 2 ** (10 / 3))), rel=1e-9)
    # Without a rating there is no life.
    assert life not in results_of(stage_of(public_stage(), tmp_path), columns())[232]


def test_pieces_of_a_run_add_up_and_the_mesh_load_factor_is_the_largest(tmp_path):
    stage = stage_of(shipped_gearbox(), tmp_path)
    one, other = columns(3), columns(9)
    other["load_sharing_factor"][5] = 1.16
    other["torque"] += 12.0
    results = results_of(stage, one, other)
    assert results[100]["mesh_load_factor_iso_6336_2019"] == 1.16
    assert results[40]["torque_around_u_axis"] == pytest.approx(TORQUE + 9.0)
    # At the reference circle: F cos(20 deg) cos(7.5 deg).
    assert results[100]["nominal_tangential_force_at_reference_circle"] == pytest.approx(
        4e5 * math.cos(math.radians(20.0)) * math.cos(math.radians(7.5))
    )
    assert results[12]["rotational_speed"] == pytest.approx(13.1)
