"""From a case with gauges on the main shaft to the mass of the dynamometer's coupling."""

import io

import pytest
from rich.console import Console

from carrierflex.identification.campaign.campaign_files import read_campaign
from carrierflex.workflows.identification import identify_parameters
from carrierflex.workflows.screen.tables import estimate_table
from carrierflex.workflows.simulation import simulate_mounting, stream_mounting
from tests.workflows.checked_documents import checked_document

CASE = """
format = "carrierflex-case"
version = 1
kind = "mounting"
name = "shaft bending"
seed = 1
noise_std = 2e-6

[rig]

[truth]

[[bending]]
section = 0.3
noise_std = 2e3

[[runs]]
name = "load"
condition = "a radial load that comes and a shaft that turns"

[runs.history]
duration = 90.0
sample_rate = 20.0
radial_load_from = 25.0
radial_load_to = 30.0
start = 31.0
stop_from = 40.0
stop_to = 45.0
full_speed = 50.0
torque_from = 55.0
torque = 80e3
ntl_y = 30e3
ntl_z = -100e3
"""


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bending")
    (folder / "case.toml").write_text(CASE, encoding="utf-8")
    simulate_mounting.main(folder / "case.toml", out=folder / "campaign", quiet=True)
    return folder / "campaign"


def test_mass_and_arm_of_the_rig_are_found(campaign, tmp_path):
    """The rig's 4100 kg at 1.75 m, in the file and on the screen."""
    out = tmp_path / "out"
    identified = identify_parameters.main(campaign, model="equivalent_mass", out=out, quiet=True)
    shared = checked_document(out / "identification.json")["shared"]
    for name, value in (("mass", 4100.0), ("arm", 1.75)):
        assert shared[name]["value"] == pytest.approx(value, rel=0.01)
        assert shared[name]["ci95"][0] < value < shared[name]["ci95"][1]
    assert (out / "bending.png").read_bytes().startswith(b"\x89PNG")
    console = Console(width=100, record=True, file=io.StringIO())
    console.print(estimate_table(identified))
    text = console.export_text()
    assert "RMS of the residual, kN m" in text
    assert "mass" in text


def test_housing_and_shaft_are_read_apart(campaign):
    """The bushings' models and the diagnosis see the housing's sensors alone."""
    housing, shaft = read_campaign(campaign), read_campaign(campaign, bending=True)
    assert {channel.quantity for channel in housing.channels} == {"housing_displacement"}
    assert [channel.name for channel in shaft.channels] == ["M_y", "M_z"]
    assert {channel.section for channel in shaft.channels} == {0.3}
    assert not housing.notes


def test_keys_of_a_moment_are_asked_for(campaign, tmp_path):
    text = (campaign / "campaign.toml").read_text(encoding="utf-8")
    wrong = tmp_path / "wrong"
    wrong.mkdir()
    (wrong / "load.csv").write_bytes((campaign / "load.csv").read_bytes())
    (wrong / "campaign.toml").write_text(text.replace('axis = "y"\n', ""), encoding="utf-8")
    with pytest.raises(ValueError, match="missing key 'axis'"):
        read_campaign(wrong)


def test_mass_belongs_to_its_model(campaign, tmp_path):
    with pytest.raises(ValueError, match="--mass is for --model equivalent_mass"):
        identify_parameters.main(
            campaign, model="linear_bushing", mass=4100.0, out=tmp_path / "a", quiet=True
        )


def test_records_in_pieces_have_no_moments(campaign, tmp_path):
    with pytest.raises(ValueError, match=r"\[\[bending\]\] is given"):
        stream_mounting.main(campaign / "case.toml", out=tmp_path / "long", quiet=True)
