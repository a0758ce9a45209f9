"""Stage cases: the shipped ones, and refusals."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.simulation.carrier.case_files import shipped_case
from carrierflex.simulation.stage.stage_cases import read_stage_case
from carrierflex.simulation.stage.stage_data import RollerBearingData
from carrierflex.simulation.stage.stage_model import stage_model
from carrierflex.simulation.stage.stage_run import simulate_stage


def changed(tmp_path, *changes):
    text = shipped_case("stage_lc1").read_text(encoding="utf-8")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "case.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("name", "torque", "radial"),
    [("LC1", 360e3, 0.0), ("LC2", 180e3, 0.0), ("LC3", 360e3, -200e3), ("LC4", 360e3, 200e3)],
)
def test_shipped_cases_hold_the_papers_load_cases(name, torque, radial):
    case = read_stage_case(shipped_case(f"stage_{name.lower()}"))
    (run,) = case.runs
    assert (run.name, run.load.torque, run.load.ntl_z) == (name, torque, radial)
    assert [round(np.rad2deg(sensor.angle)) for sensor in case.sensors] == [
        47,
        137,
        227,
        317,
        40,
        310,
    ]
    assert case.effects.ids == ("carrier_tilt",)


def test_tables_change_what_they_name_and_nothing_else(tmp_path):
    path = changed(tmp_path, ("angle_deg = 47.0", "angle_deg = 47.0\ngain = 0.01"))
    extra = (
        "\n[bearings]\nupwind_clearance = 1.4e-4\nsun_friction = 0.08\nsun_clearance = 2e-4\n"
        "\n[[reading.runout]]\norder = 2\namplitude = 1e-6\nphase_deg = 90.0\n"
    )
    path.write_text(path.read_text(encoding="utf-8") + extra, encoding="utf-8")
    case = read_stage_case(path)
    assert case.data.bearings.upwind_clearance == 1.4e-4
    assert case.data.bearings.downwind_clearance == 0.0
    spline = (case.data.bearings.sun_friction, case.data.bearings.sun_clearance)
    assert spline == (0.08, 2e-4)
    assert case.reading.runout == {2: (1e-6, np.pi / 2.0)}
    assert case.reading.sensors["s047"].gain == 0.01
    assert case.reading.sensors["s137"].gain == 0.0


def test_rollers_effects_bodies_and_zero_come_from_their_tables(tmp_path):
    path = changed(
        tmp_path,
        ("[effects] ", "[effects]\npin_fit_play = 5e-4\nring_pass_offset = [1e-11, 2e-11]\n#"),
    )
    extra = """
[planet_rollers]
n_slices = 5
profile = 3.5e-4

[bodies]
carrier = "mine/carrier.h5"

[zeroing]
carrier_angle_deg = 90.0
"""
    path.write_text(path.read_text(encoding="utf-8") + extra, encoding="utf-8")
    case = read_stage_case(path)
    assert case.data.planet_rollers == RollerBearingData(n_slices=5, profile=3.5e-4)
    assert (case.effects.pin_fit_play, case.effects.ring_pass_offset) == (5e-4, (1e-11, 2e-11))
    assert set(case.effects.ids) == {"carrier_tilt", "pin_clearance", "ring_pass"}
    assert case.bodies == {"carrier": tmp_path / "mine" / "carrier.h5"}
    assert_allclose(case.rest_angle, np.pi / 2.0, rtol=1e-15)
    plain = read_stage_case(shipped_case("stage_lc1"))
    assert (plain.data.planet_rollers, dict(plain.bodies), plain.rest_angle) == (None, {}, None)


def test_a_case_runs_and_gives_every_sensor_a_signal(stage_body):
    case = read_stage_case(shipped_case("stage_lc1"))
    model = stage_model(stage_body, case.data, effects=case.effects, speed=case.speed)
    (piece,) = simulate_stage(
        model, case.runs[0].load, case.sensors, duration=0.5, sample_rate=100.0, step=case.step,
        effects=case.reading, rng=np.random.default_rng(case.seed),
    )  # fmt: skip
    assert set(piece.signals) == {sensor.name for sensor in case.sensors}
    assert all(
        signal.shape == (50,) and np.isfinite(signal).all() for signal in piece.signals.values()
    )
    assert_allclose(piece.loads.load_share.sum(axis=1), 1.0, rtol=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "speed_rpm = 22.1",
            "speed_rpm = 0.0",
            "key 'speed_rpm' is 0.0; expected a positive number",
        ),
        ("[effects] ", "[effect] ", "unknown key 'effect'"),
        ("phi_PLC = ", "phi_PLX = ", r"\[effects\]: unknown key 'phi_PLX'"),
        ('name = "s137"', 'name = "s047"', "sensor name 's047' occurs twice"),
        (
            "[effects] ",
            "[planet_rollers]\nn_rollers = 17.5\n[effects] ",
            "key 'n_rollers' is 17.5; expected a whole number",
        ),
        (
            "[effects] ",
            "[planet_rollers]\nn_rollers = 40\n[effects] ",
            "n_rollers is 40: rollers of 0.036 m overlap",
        ),
        (
            "[effects] ",
            "[bodies]\nplanet = 'x.h5'\n[effects] ",
            r"\[bodies\]: unknown key 'planet'",
        ),
        ("[effects] ", "[zeroing]\n[effects] ", r"\[zeroing\]: .*'carrier_angle_deg'"),
        (
            "phi_PLC = ",
            "ring_pass_tilt = [1.0]\nphi_PLC = ",
            "key 'ring_pass_tilt' is .*; expected four finite numbers",
        ),
        (
            "version = 1",
            "version = 2",
            "key 'version' is 2, written by a newer version; expected 1",
        ),
        ("ntl_z = 0.0", "ntl_z = nan", "key 'ntl_z' is nan; expected a finite number"),
        (
            "[effects] ",
            "[bearings]\nsun_friction = 0.1\nsun_radial = 0.0\n[effects] ",
            "sun_friction is 0.1 with a sun_radial of 0",
        ),
        ("[effects] ", "[bearings]\nspline_radius = 0.0\n[effects] ", "key 'spline_radius' is 0"),
    ],
)
def test_wrong_cases_are_refused_with_the_key(tmp_path, old, new, message):
    with pytest.raises(ValueError, match=rf"case\.toml.*{message}"):
        read_stage_case(changed(tmp_path, (old, new)))


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(
        FileNotFoundError, match=r"none\.toml: no such file; expected a case file of the stage"
    ):
        read_stage_case(tmp_path / "none.toml")


def test_gravity_parts_gears_supports_and_reference_come_from_the_case(tmp_path):
    path = changed(
        tmp_path,
        (
            "pin_fit_stiffness = 1e6 ",
            'gravity = 0.0\ndamping_ratio = 0.01\nmain_shaft = "finite_elements"\n'
            "pin_fit_stiffness = 1e6 ",
        ),
        ("[reading] ", '[reading]\nreference = "ground"\n#'),
    )  # fmt: skip
    extra = """
[gear]
helix_angle = 0.0

[housing]
mass = 2500.0
x = 0.4

[planet]
polar_inertia = 4.0

[bearings]
upwind_tilt = 1e7
downwind_y_factor = 0.1

[mounting]
x = -0.2
tilt_stiffness = 5e6
ntl_arm = 1.75
"""
    path.write_text(path.read_text(encoding="utf-8") + extra, encoding="utf-8")
    case = read_stage_case(path)
    plain = read_stage_case(shipped_case("stage_lc1"))
    assert (case.runs[0].load.gravity, plain.runs[0].load.gravity) == (0.0, 9.81)
    assert (case.main_shaft, plain.main_shaft) == ("finite_elements", "beam")
    assert (case.reading.reference, plain.reading.reference) == ("ground", "housing")
    data, nominal = case.data, plain.data
    assert (data.damping_ratio, data.gear.helix_angle) == (0.01, 0.0)
    assert (data.housing.mass, data.housing.x, data.planet.polar_inertia) == (2500.0, 0.4, 4.0)
    assert data.housing.polar_inertia == nominal.housing.polar_inertia
    assert data.planet.mass == nominal.planet.mass
    assert (data.bearings.upwind_tilt, data.bearings.downwind_y_factor) == (1e7, 0.1)
    assert (data.mounting.x, data.mounting.tilt_stiffness, data.mounting.ntl_arm) == (
        -0.2,
        5e6,
        1.75,
    )
    assert nominal.mounting.ntl_arm == 1.22
