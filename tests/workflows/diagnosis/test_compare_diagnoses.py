"""Two diagnoses of one measurement: what shrank, what came, and what cannot be compared."""

import json
import sys
from dataclasses import replace

import numpy as np
import pytest

from carrierflex.identification.campaign.campaign_files import read_campaign, write_campaign
from carrierflex.identification.campaign.record_digests import record_digests
from carrierflex.simulation.carrier.effects.library import CARRIER_EFFECTS
from carrierflex.workflows import command_line
from carrierflex.workflows.diagnosis import compare_diagnoses, diagnose_campaign
from tests.diagnosis.carrier.carrier_twin import KNOWN, LOADS, twin_campaign
from tests.workflows.checked_documents import checked_document

pytestmark = pytest.mark.long


def diagnosed(folder, campaign, name):
    """Folder of the diagnosis of a campaign."""
    write_campaign(campaign, folder / f"campaign_{name}")
    diagnose_campaign.main(folder / f"campaign_{name}", out=folder / name, report=False, quiet=True)
    return folder / name


def containing(campaign, *effects):
    """Campaign whose baseline has these effects; few others are looked for, to be quick."""
    looked_for = {*effects, "torque_tilt", "carrier_tilt", "face_runout"}
    impossible = tuple(name for name in CARRIER_EFFECTS if name not in looked_for)
    baseline = replace(campaign.baseline, effects=effects, impossible=impossible)
    return replace(campaign, baseline=baseline)


@pytest.fixture(scope="module")
def measured():
    return twin_campaign("torque_tilt", loads=LOADS[:3])


@pytest.fixture(scope="module")
def folders(measured, tmp_path_factory):
    """Without the missing effect, with it, and without two of the others."""
    folder = tmp_path_factory.mktemp("compared")
    fewer = tuple(name for name in KNOWN if name != "carrier_tilt")
    return {
        "without": diagnosed(folder, containing(measured, *KNOWN), "without"),
        "with": diagnosed(folder, containing(measured, *KNOWN, "torque_tilt"), "with"),
        "fewer": diagnosed(folder, containing(measured, *fewer), "fewer"),
    }


def rewritten(folder, target, **keys):
    """Copy of a diagnosis with other keys."""
    document = checked_document(folder / "diagnosis.json")
    target.mkdir()
    (target / "diagnosis.json").write_text(json.dumps({**document, **keys}), encoding="utf-8")
    return target


def test_an_effect_that_was_missing_takes_the_gap_when_it_is_added(folders, tmp_path):
    change = compare_diagnoses.main(folders["without"], folders["with"], out=tmp_path / "out")
    assert change.ratio_ci95[1] < 1.0
    assert np.isclose(change.ratio, change.after.rms / change.before.rms, rtol=1e-9)
    assert change.explained > 0.9
    assert change.solved == ("torque_tilt",)
    assert change.added == () == change.remaining
    assert {cell.what for cell in change.cells} <= {"gone", "smaller"}
    # A tilt of the housing by torque is static: every run lost a static cell.
    static = {cell.run for cell in change.cells if cell.order == 0 and cell.what == "gone"}
    assert static == {"run1", "run2", "run3"}
    # Within three standard deviations of the noise of a run's mean nothing is left.
    assert all(row.error_after < 3.0 * row.u_val < row.error_before for row in change.runs)
    document = checked_document(tmp_path / "out" / "comparison.json")
    assert document["text"].startswith("The change took ")
    assert document["causes"]["solved"] == ["torque_tilt"]
    assert "<h1>The change took " in (tmp_path / "out" / "comparison.html").read_text("utf-8")


def test_the_other_way_round_the_same_cells_come(folders):
    forth = compare_diagnoses.main(folders["without"], folders["with"])
    back = compare_diagnoses.main(folders["with"], folders["without"])
    assert np.isclose(forth.ratio * back.ratio, 1.0)
    assert {cell.what for cell in back.cells} <= {"new", "larger"}
    assert {(c.run, c.channel_pattern, c.order) for c in forth.cells} == {
        (c.run, c.channel_pattern, c.order) for c in back.cells
    }
    assert back.added == ("torque_tilt",)
    assert back.explained < 0.0


def test_what_is_added_while_another_is_taken_out_shows_as_both(folders):
    change = compare_diagnoses.main(folders["fewer"], folders["with"])
    assert change.ratio_ci95[1] < 0.5
    assert {cell.order for cell in change.cells if cell.what == "gone"} >= {0.0, 1.0}


def test_a_diagnosis_beside_itself_has_not_changed(folders, capsys, monkeypatch):
    arguments = ["carrierflex", "compare", str(folders["with"]), str(folders["with"])]
    monkeypatch.setattr(sys, "argv", arguments)
    with pytest.raises(SystemExit) as ended:
        command_line.main()
    assert ended.value.code == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert shown.startswith("The change did not affect the gap: ")
    assert "ratio 1.000" in shown


def test_records_are_known_whatever_file_holds_them(measured, tmp_path):
    write_campaign(measured, tmp_path / "one")
    digests = record_digests(read_campaign(tmp_path / "one"), tmp_path / "one")
    assert digests.measured == record_digests(measured, tmp_path / "one").measured
    assert set(digests.files) == {"campaign.toml", "run1.csv", "run2.csv", "run3.csv"}
    run = measured.runs[0]
    for other in (
        replace(run, condition="another"),
        replace(run, use=((0.0, 5.0),)),
        replace(run, signals={**run.signals, "s047": np.roll(run.signals["s047"], 1)}),
    ):
        changed = replace(measured, runs=(other, *measured.runs[1:]))
        assert record_digests(changed, tmp_path / "one").measured != digests.measured


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"kind": "mounting"}, "their kind is carrier and mounting"),
        ({"unit": "mm"}, "their unit is m and mm"),
        ({"version": 99}, "written by a newer version"),
        ({"records": None}, "key 'records' is missing.*diagnose the campaign again"),
        ({"held_out": []}, "holds no gap to compare"),
        ({"where": [{"run": 3}]}, "missing key 'channel_pattern'; expected a whole diagnosis"),
        ({"effects": 3}, "a value is of another type"),
    ],
)
def test_what_cannot_be_compared_is_refused(folders, tmp_path, keys, message):
    other = rewritten(folders["with"], tmp_path / "other", **keys)
    with pytest.raises(ValueError, match=message):
        compare_diagnoses.main(folders["without"], other, out=tmp_path / "out")
    assert not (tmp_path / "out").exists()
