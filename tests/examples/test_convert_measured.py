"""Converters of measured records, on generated stand-ins of the same file form."""

import json

import numpy as np
import pytest
from scipy.io import savemat

from carrierflex.identification.campaign.campaign_files import read_campaign
from examples import convert_fatigue_rig, convert_geared_servo, convert_pendulum


@pytest.fixture
def fatigue_rig(tmp_path):
    """A linear specimen: force 0.2 of the displacement."""
    time = np.arange(400) / 128.0
    d = np.sin(time)
    table = np.array([time, d, 0.1 * d, 0.2 * d, d]).T
    np.savetxt(
        tmp_path / "faster.csv", table, delimiter=",", header="t,r,u,y,d", comments="", fmt="%.5g"
    )
    return tmp_path


def test_fatigue_rig_is_driven_by_its_displacement_in_four_runs(fatigue_rig):
    out = fatigue_rig / "campaign"
    assert convert_fatigue_rig.main(fatigue_rig, out=out) == out
    campaign = read_campaign(out)
    assert campaign.rig["drive"] == "displacement"
    assert [run.time.size for run in campaign.runs] == [100] * 4
    assert campaign.channels[0].noise_std is None
    for run in campaign.runs:
        np.testing.assert_allclose(
            run.signals["force"], 0.2 * run.inputs["displacement"], atol=1e-4
        )
        np.testing.assert_allclose(np.diff(run.time), 1.0 / 128.0, rtol=1e-4)


def test_fatigue_rig_with_other_columns_is_refused(fatigue_rig):
    path = fatigue_rig / "faster.csv"
    path.write_text(path.read_text(encoding="utf-8").replace("t,r,u,y,d", "t,r,u,d,y"), "utf-8")
    with pytest.raises(ValueError, match="its columns are t, r, u, d, y; expected t, r, u, y, d"):
        convert_fatigue_rig.main(fatigue_rig, out=fatigue_rig / "campaign")
    assert not (fatigue_rig / "campaign").exists()


def test_angle_of_the_pendulum_is_counted_from_the_hanging_position(tmp_path):
    swing = np.pi + 0.5 * np.cos(np.linspace(0.0, 20.0, 600))
    pieces = [np.array([piece, 0.0 * piece]) for piece in np.array_split(swing, 6)]
    cells = np.empty((6, 1), dtype=object)
    cells[:, 0] = pieces
    path = tmp_path / convert_pendulum.FILE
    savemat(path, {"Y_id": cells[:4], "Y_vad": cells[4:], "dt": 0.001})
    np.testing.assert_allclose(convert_pendulum._angle(path), swing - np.pi, atol=1e-12)
    savemat(path, {"Y_id": cells})
    with pytest.raises(ValueError, match="no variable Y_vad; expected Y_id and Y_vad"):
        convert_pendulum._angle(path)


def servo_record(path, *, goes=True):
    entries = [
        {"timestamp": 0.004 * k + 1e-4 * (k % 2), "position": -0.01 * k, "torque_enable": k < 20}
        for k in range(60 if goes else 20)
    ]
    path.write_text(json.dumps({"mass": 0.49, "entries": entries}), encoding="utf-8")


def test_a_drop_of_the_servo_begins_when_its_torque_goes(tmp_path):
    path = tmp_path / "one.json"
    servo_record(path)
    run = convert_geared_servo._decay(path, 3)
    assert (run.name, run.time.size, run.time[0]) == ("drop3", 40, 0.0)
    np.testing.assert_allclose(run.signals["angle"][[0, -1]], [-0.2, -0.59])
    assert run.inputs == {}
    # The samples are not evenly spaced: the times are those of the file.
    np.testing.assert_allclose(np.diff(run.time)[:2], [0.0041, 0.0039], atol=1e-9)


def test_records_of_the_servo_that_hold_no_drop_are_refused(tmp_path):
    path = tmp_path / "one.json"
    servo_record(path, goes=False)
    with pytest.raises(ValueError, match="torque_enable never changes; expected a drop"):
        convert_geared_servo.main(tmp_path, out=tmp_path / "campaign")
    path.write_text('{"entries": [{"timestamp": 0.0}]}', encoding="utf-8")
    with pytest.raises(ValueError, match="a sample has no key 'position'"):
        convert_geared_servo.main(tmp_path, out=tmp_path / "campaign")
    path.write_text("{}", encoding="utf-8")
    with pytest.raises(ValueError, match="no record of the geared servo"):
        convert_geared_servo.main(tmp_path, out=tmp_path / "campaign")
    assert not (tmp_path / "campaign").exists()


@pytest.mark.parametrize(
    ("converter", "file"),
    [
        (convert_fatigue_rig, r"faster\.csv"),
        (convert_pendulum, r"SinglePendulumDataForParameterEstimation\.mat"),
        (convert_geared_servo, r"\*\.json"),
    ],
)
def test_a_folder_without_the_record_is_refused(converter, file, tmp_path):
    with pytest.raises(ValueError, match=f"no file {file}; expected the"):
        converter.main(tmp_path, out=tmp_path / "campaign")
