"""What a diagnosis names is put into drawing or baseline; the gap is then as small as predicted."""

import json
import shutil
import tomllib
from dataclasses import replace

import numpy as np
import pytest

from carrierflex.diagnosis.inference.results import NamedValue
from carrierflex.fe.curve_files import read_curves, read_derivatives
from carrierflex.geometry.parameter_files import StageParameters, read_parameters
from carrierflex.identification.campaign.campaign_files import read_campaign, write_campaign
from carrierflex.identification.campaign.campaign_kinds import CARRIER
from carrierflex.identification.campaign.declarations import KnownValue
from carrierflex.reduction.changed_drawing import changed_drawing
from carrierflex.workflows.diagnosis import calibrate_campaign, diagnose_campaign
from carrierflex.workflows.diagnosis.calibrate_campaign import _known_values, main
from carrierflex.workflows.fe.default_curves import default_curves, with_derivatives
from tests.diagnosis.carrier.carrier_twin import CARRIER_RIG, KNOWN, LOADS, RIG, twin_campaign
from tests.diagnosis.element.element_campaigns import force_campaign
from tests.workflows.checked_documents import checked_document, printed_again

CAUSE, CHANGE = "planet_clearance_radius", 0.012
SIZE = 0.1
#: N/m³: at the largest deflection, 2.4 mm, a fourth of the linear force.
K3 = 4e8


def of_element(folder):
    """Write a campaign of a mass on a cubic spring; its path."""
    write_campaign(force_campaign(lambda q, v: K3 * q**3), folder)
    return folder


@pytest.fixture(scope="module")
def true_curve():
    """Curve of a carrier whose dimension is off, moved from the default carrier's by its change."""
    drawing = changed_drawing(StageParameters(), {CAUSE: CHANGE}, SIZE)
    return drawing.moved(with_derivatives(default_curves()))["delta_f"]


def of_carrier(folder, curve, **tolerances):
    """Write a campaign of a carrier with a curve of its own; its path."""
    size = KNOWN["flexible_pins"][0]  # the twin's, where the drawing's is 1
    curve = replace(curve, axial=curve.axial / size, radial=curve.radial / size)
    rig = replace(CARRIER_RIG, curves={**CARRIER_RIG.curves, "delta_f": curve})
    campaign = twin_campaign(rig=rig, loads=LOADS[:3])
    write_campaign(replace(campaign, rig={**RIG, "tolerances": tolerances}), folder)
    return folder


@pytest.mark.long
def test_a_law_that_is_put_into_the_baseline_takes_the_gap(tmp_path, command, monkeypatch):
    campaign = of_element(tmp_path / "campaign")
    (campaign / "notes.txt").write_text("a file of the user's", encoding="utf-8")
    before = {path.name: path.read_bytes() for path in campaign.iterdir()}
    result = main(campaign, out=tmp_path / "out", quiet=True)
    assert [one.effect for one in result.put_in] == ["cubic_stiffness"]
    assert result.before.verdict == "named"
    assert result.after.verdict == "at_noise_floor"
    # The prediction is of other fits of the same blocks.
    assert np.isclose(result.after.rms, result.rms_predicted, rtol=0.05, atol=0.0)
    assert result.ratio_ci95[1] < 0.1
    assert result.linear is None
    baseline = read_campaign(tmp_path / "out" / "campaign").baseline
    assert baseline.effects == ("cubic_stiffness",)
    known = baseline.fixed["cubic_stiffness.K3"]
    assert abs(known.value - K3) < 3.0 * known.std < 0.05 * K3
    assert {path.name: path.read_bytes() for path in campaign.iterdir()} == before
    assert {path.name for path in (tmp_path / "out" / "campaign").iterdir()} == set(before)
    document = checked_document(tmp_path / "out" / "calibration.json")
    assert document["text"].startswith("The change took 100 % of the gap")
    assert not (tmp_path / "out" / "parameters.toml").exists()
    printed_again(
        "calibrate campaign", result, tmp_path / "out" / "calibration.json",
        module=calibrate_campaign, command=command, monkeypatch=monkeypatch,
    )  # fmt: skip

    # Nothing is missing now, and what an earlier calibration left goes.
    shutil.move(tmp_path / "out" / "campaign", tmp_path / "calibrated")
    again = main(tmp_path / "calibrated", out=tmp_path / "out", quiet=True)
    assert again.put_in == ()
    assert again.after is None
    assert again.text.startswith("Nothing was put in. Simulation and measurement agree")
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"before", "calibration.json"}


@pytest.mark.long
def test_a_dimension_that_is_named_goes_into_the_drawing_and_its_curves(tmp_path, true_curve):
    campaign = of_carrier(tmp_path / "campaign", true_curve, **{CAUSE: 0.006, "curves": 0.003})
    out = tmp_path / "out"
    result = main(campaign, out=out, size=SIZE, quiet=True)
    (put_in,) = result.put_in
    assert (put_in.effect, put_in.file) == (f"geometry/{CAUSE}", "parameters.toml")
    change = put_in.values["change"]
    drawn = getattr(StageParameters().carrier, CAUSE)
    assert put_in.drawn == drawn
    assert put_in.calibrated == drawn + change.value
    assert getattr(read_parameters(out / "parameters.toml").carrier, CAUSE) == put_in.calibrated
    # The derivative is linear: 2 % at 1 mm, 10 % where the mesh of the curves is another one.
    assert abs(change.value - CHANGE) < 1.96 * change.std + 0.1 * CHANGE
    assert result.before.verdict == "named"
    assert result.after.verdict == "at_noise_floor"
    assert np.isclose(result.after.rms, result.rms_predicted, rtol=0.02, atol=0.0)
    assert 0.0 < result.linear.off < 0.15
    # Known to the noise of the records, the new curve is the true one.
    path = out / "campaign" / "deflection_curves.csv"
    new = {**read_curves(path), **read_derivatives(path)}
    old = default_curves()["delta_f"]
    gap = [np.std(curve.axial - true_curve.axial) for curve in (old, new["delta_f"])]
    assert gap[1] < 0.1 * gap[0]
    # Tolerances and derivatives stay: the next diagnosis looks for the drawing's causes again.
    rig = tomllib.loads((out / "campaign" / "campaign.toml").read_text("utf-8"))["rig"]
    assert rig["tolerances"] == {CAUSE: 0.006, "curves": 0.003}
    assert {f"delta_f/{CAUSE}", f"pin_fit/{CAUSE}", "pin_fit/pin_E"} <= set(new)
    checked_document(out / "calibration.json")


@pytest.mark.long
def test_of_alternatives_one_is_put_in_where_it_is_taken(tmp_path, true_curve, monkeypatch):
    diagnoses, diagnose = {}, diagnose_campaign.main

    def diagnosed_once(folder, **options):
        if folder not in diagnoses:
            diagnoses[folder] = diagnose(folder, **options)
        return diagnoses[folder]

    monkeypatch.setattr(diagnose_campaign, "main", diagnosed_once)
    tolerances = {CAUSE: 0.006, "E": 1.5e10, "curves": 0.003}
    campaign = of_carrier(tmp_path / "campaign", true_curve, **tolerances)
    result = main(campaign, out=tmp_path / "out", size=SIZE, quiet=True)
    assert result.before.verdict == "aliased"
    assert result.put_in == ()
    assert f"--take geometry/{CAUSE}" in result.text
    assert "--take material/E" in result.text
    assert "\n" not in result.text

    with pytest.raises(ValueError, match=r"--take ring: is no alternative .*material/E"):
        main(campaign, out=tmp_path / "out", size=SIZE, take="ring", quiet=True)
    assert (tmp_path / "out" / "before" / "diagnosis.json").exists()

    taken = main(campaign, out=tmp_path / "out", size=SIZE, take="material/E", quiet=True)
    (put_in,) = taken.put_in
    # No parameter file holds a modulus.
    assert put_in.file == "calibration.json"
    assert put_in.calibrated == put_in.drawn + put_in.values["change"].value < put_in.drawn
    assert taken.after.verdict == "at_noise_floor"
    assert np.isclose(taken.after.rms, taken.rms_predicted, rtol=0.02, atol=0.0)
    assert 0.0 < taken.linear.off < 0.15
    document = checked_document(tmp_path / "out" / "calibration.json")
    assert document["put_in"][0]["calibrated"] == put_in.calibrated


@pytest.mark.long
def test_where_nothing_is_an_alternative_none_is_taken(tmp_path):
    campaign = of_element(tmp_path / "campaign")
    with pytest.raises(ValueError, match="verdict is 'named', without alternatives"):
        main(campaign, out=tmp_path / "out", take="cubic_stiffness", quiet=True)


def test_a_folder_that_holds_something_else_is_refused_before_the_work(tmp_path):
    campaign = of_element(tmp_path / "campaign")
    out = tmp_path / "out"
    out.mkdir()

    def refused(message):
        with pytest.raises(ValueError, match=message):
            main(campaign, out=out, quiet=True)
        assert not (out / "before").exists()

    (out / "results.csv").write_text("theirs", encoding="utf-8")
    refused("holds 'results.csv', which is no file of a calibration")
    (out / "results.csv").rename(out / "parameters.toml")
    refused("holds 'parameters.toml' and no calibration.json")
    (out / "calibration.json").write_text(json.dumps({"format": "theirs"}), encoding="utf-8")
    refused("key 'format' is 'theirs'; expected 'carrierflex-calibration'")
    with pytest.raises(ValueError, match=r"the campaign .* is in this folder"):
        main(campaign, out=tmp_path, quiet=True)


@pytest.mark.long
def test_what_cannot_be_calibrated_is_refused_before_the_work(tmp_path):
    columns = of_element(tmp_path / "campaign")
    text = (columns / "campaign.toml").read_text("utf-8")
    (columns / "campaign.toml").write_text(text.replace('"model"', '"columns"'), "utf-8")
    with pytest.raises(ValueError, match="another simulator's prediction; expected 'model'"):
        main(columns, out=tmp_path / "out", quiet=True)
    campaign = of_carrier(tmp_path / "carrier", default_curves()["delta_f"], **{CAUSE: 0.006})
    with pytest.raises(ValueError, match=r"n_planets is 4, and \[rig\] n_planets .* is 3"):
        main(campaign, out=tmp_path / "out", parameters="four_planets", quiet=True)
    assert not (tmp_path / "out").exists()


def named(value, std=0.1):
    return NamedValue(value, std, "1", (value - 1.96 * std, value + 1.96 * std))


@pytest.mark.parametrize(
    ("law", "values", "known"),
    [
        # Size and angle are one vector: one without the other is not known.
        (
            "torque_tilt",
            {"phi_T": named(1.0), "theta_T": named(2.0)},
            {"phi_T": KnownValue(1.0, 0.1), "theta_T": KnownValue(2.0, 0.1)},
        ),
        ("torque_tilt", {"phi_T": named(1.0), "theta_T": named(2.0, np.nan)}, {}),
        # An error of one sensor is published with its name.
        ("sensor_gain", {"g_s137": named(0.3)}, {"g": KnownValue(0.3, 0.1)}),
        # Weight on closing pins is in no campaign file; values by run are not known physics.
        (
            "pin_clearance",
            {"c": named(1.0), "w_s": named(5.0), "T_c": named(1e5)},
            {"c": KnownValue(1.0, 0.1), "T_c": KnownValue(1e5, 0.1)},
        ),
        ("thermal_drift", {"t_1 of run1": named(1.0)}, {}),
    ],
)
def test_the_baseline_holds_values_by_the_names_that_a_campaign_knows(law, values, known):
    fixed = _known_values(law, values, CARRIER)
    assert {name: (one.value, one.std) for name, one in fixed.items()} == {
        name: (one.value, one.std) for name, one in known.items()
    }
