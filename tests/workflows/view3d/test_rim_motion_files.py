"""rim_motion.json holds what the sensors read, and comes back as it was."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from carrierflex.diagnosis.comparison.overlay import Overlay, SignalComparison
from carrierflex.workflows.view3d.rim_motion_files import (
    RimMotion,
    read_rim_motion,
    rim_motion,
    write_rim_motion,
)
from tests.workflows.checked_documents import checked_document

ANGLE_DEG = np.linspace(0.0, 360.0, 181)


def overlay(run, channel, order, gap):
    turn = np.cos(order * np.deg2rad(ANGLE_DEG))
    return Overlay(
        run, channel, ANGLE_DEG, "carrier angle", "deg", 1e-3 * turn, (1e-3 - gap) * turn
    )


@pytest.fixture
def motion():
    signals = SignalComparison(
        before=(overlay("LC1", "s047", 1, 1e-4), overlay("LC1", "r040", 3, 2e-4)),
        after=(overlay("LC1", "s047", 1, 1e-5), overlay("LC1", "r040", 3, 2e-5)),
    )
    steps = (SimpleNamespace(added="baseline"), SimpleNamespace(added="carrier_tilt"))
    diagnosis = SimpleNamespace(
        campaign="twin", unit="m", signals=signals, reduction=SimpleNamespace(steps=steps)
    )
    channels = (
        SimpleNamespace(name="s047", quantity="axial_displacement", angle=np.deg2rad(47.0)),
        SimpleNamespace(name="r040", quantity="radial_displacement", angle=np.deg2rad(40.0)),
    )
    rig = {"n_planets": 3, "sensor_radius": 0.412}
    runs = (SimpleNamespace(name="LC1", condition="full load"),)
    campaign = SimpleNamespace(kind="carrier", channels=channels, rig=rig, runs=runs)
    result = rim_motion(diagnosis, campaign)
    assert isinstance(result, RimMotion)
    return result


@pytest.fixture
def written(motion, tmp_path):
    write_rim_motion(tmp_path / "rim_motion.json", motion)
    return tmp_path / "rim_motion.json"


def test_one_turn_of_every_sensor_with_its_place_is_kept(motion):
    axial, radial = motion.signals
    assert (axial.direction, radial.direction) == ("axial", "radial")
    np.testing.assert_allclose(np.rad2deg(axial.sensor_angle), 47.0, rtol=1e-12)
    turn = np.deg2rad(np.arange(0.0, 360.0, 4.0))
    np.testing.assert_allclose(axial.measured, 1e-3 * np.cos(turn), rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(axial.with_effects, 0.99e-3 * np.cos(turn), rtol=0.0, atol=1e-12)
    assert motion.effects == ("carrier_tilt",)


def test_the_file_is_as_its_schema_says_and_comes_back(motion, written):
    checked_document(written)
    result = read_rim_motion(written)
    assert (result.campaign, result.unit, result.n_planets, result.radius, result.effects) == (
        "twin",
        "m",
        3,
        0.412,
        ("carrier_tilt",),
    )
    for signal, back in zip(motion.signals, result.signals, strict=True):
        assert (signal.run, signal.channel, signal.direction) == (
            back.run,
            back.channel,
            back.direction,
        )
        # Six digits are written.
        np.testing.assert_allclose(back.simulated, signal.simulated, rtol=1e-5, atol=1e-12)


def test_a_campaign_without_a_rim_has_none():
    assert rim_motion(SimpleNamespace(signals=None), SimpleNamespace(kind="carrier")) is None
    assert rim_motion(SimpleNamespace(signals=()), SimpleNamespace(kind="element")) is None


def test_of_more_runs_than_a_file_holds_some_of_every_condition_are_kept(monkeypatch):
    where = "carrierflex.workflows.view3d.rim_motion_files._MOST_SIGNALS"
    conditions = {"A1": "a", "A2": "a", "A3": "a", "B1": "b", "B2": "b"}
    diagnosis = SimpleNamespace(
        campaign="twin",
        unit="m",
        signals=SimpleNamespace(before=[overlay(run, "s", 1, 0.0) for run in conditions], after=()),
        reduction=None,
    )
    campaign = SimpleNamespace(
        kind="carrier",
        channels=(SimpleNamespace(name="s", quantity="axial_displacement", angle=0.5),),
        rig={"n_planets": 3, "sensor_radius": 0.412},
        runs=[SimpleNamespace(name=name, condition=of) for name, of in conditions.items()],
    )
    for most, expected in (
        (1, ["A1"]),
        (2, ["A1", "B1"]),
        (4, ["A1", "A2", "B1", "B2"]),
        (9, None),
    ):
        monkeypatch.setattr(where, most)
        result = [signal.run for signal in rim_motion(diagnosis, campaign).signals]
        assert result == (expected or list(conditions))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"format": "carrierflex-diagnosis"}, "key 'format' is 'carrierflex-diagnosis'"),
        (
            {"version": 2},
            "key 'version' is 2, written by a newer version; expected 1: update carrierflex",
        ),
        ({"n_planets": 0}, "key 'n_planets' is 0"),
        ({"radius": -1.0}, "key 'radius' is -1.0"),
        ({"signals": []}, "key 'signals' holds nothing to draw"),
        ({"signals": [{}]}, "no key 'sensor_angle_deg'"),
        ({"carrier_angle_deg": [0.0, 1.0]}, "key 'measured' has shape \\(90,\\), not 2"),
        ({"effects": None}, "expected a file that diagnose wrote"),
    ],
)
def test_another_content_is_refused_in_one_line(written, change, message):
    document = json.loads(written.read_text(encoding="utf-8")) | change
    written.write_text(json.dumps(document), encoding="utf-8")
    with pytest.raises(ValueError, match=message) as refusal:
        read_rim_motion(written)
    assert str(refusal.value).startswith(f"{written}: ")
    assert "\n" not in str(refusal.value)


def test_a_reading_whose_square_is_no_number_is_refused(written):
    document = json.loads(written.read_text())
    document["signals"][0]["measured"][0] = 1e308
    written.write_text(json.dumps(document))
    with pytest.raises(ValueError, match=r"key 'measured' has shape .* numbers below 1e\+100"):
        read_rim_motion(written)
