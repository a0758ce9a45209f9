"""A campaign that states the tolerances of its carrier, through the command's own functions."""

import re

import pytest

from carrierflex.fe.curve_files import read_curves, read_derivatives, write_curves
from carrierflex.fe.deflection_curves import resampled
from carrierflex.identification.campaign.campaign_files import read_campaign, write_campaign
from carrierflex.workflows.diagnosis.diagnose_campaign import campaign_curves
from carrierflex.workflows.fe import compute_curves
from carrierflex.workflows.view3d.view_file import _curve_scene
from tests.diagnosis.carrier.test_causes_of_the_drawing import CURVES, campaign, curve_of


@pytest.fixture
def folder(tmp_path):
    written = tmp_path / "campaign"
    write_campaign(campaign(curve_of(0.5, {})), written)
    return written


def test_tolerances_are_read_back_and_bring_the_derivatives(folder):
    read = read_campaign(folder)
    assert read.rig["tolerances"]["outer_radius"] == 0.02
    assert set(CURVES) == set(campaign_curves(read, folder))


def test_an_unknown_dimension_is_refused_with_the_known_ones(folder):
    document = folder / "campaign.toml"
    document.write_text(document.read_text().replace("outer_radius", "outer_radios"))
    with pytest.raises(ValueError, match="unknown key 'outer_radios'; expected outer_radius, "):
        campaign_curves(read_campaign(folder), folder)


def test_a_tolerance_is_positive(folder):
    document = folder / "campaign.toml"
    document.write_text(re.sub(r"outer_radius = \S+", "outer_radius = -0.02", document.read_text()))
    with pytest.raises(ValueError, match="outer_radius"):
        read_campaign(folder)


def test_curves_and_derivatives_stand_in_one_file(tmp_path):
    thin = {name: resampled(curve, 120) for name, curve in CURVES.items()}
    path = tmp_path / "curves.csv"
    write_curves(path, thin)
    curves, derivatives = read_curves(path), read_derivatives(path)
    read = {**curves, **derivatives}
    assert set(read) == set(CURVES)
    assert not set(curves) & set(derivatives)
    assert read["pin_fit/E"].axial == pytest.approx(CURVES["pin_fit/E"].axial, rel=1e-6)


@pytest.mark.long
def test_commands_that_show_the_four_curves_do_not_meet_the_derivatives(tmp_path):
    """Of other units, and under no load of their own."""
    curves = compute_curves.main(out=tmp_path, size=0.1, derivatives=True, cache=False, quiet=True)
    assert set(curves) == {"delta_s", "delta_f", "g_s", "g_f"}
    path = tmp_path / "deflection_curves.csv"
    assert "pin_fit/outer_radius" in read_derivatives(path)
    assert len(_curve_scene(read_curves(path), "rim").entries) == len(curves)
