"""A measurement is never replaced: only what this program simulated, as it left it."""

import hashlib
import tomllib

import pytest

from carrierflex.identification.campaign.campaign_files import (
    prepare_campaign_folder,
    read_campaign,
    write_campaign,
)
from tests.identification.synthetic_campaigns import carrier_campaign


@pytest.fixture
def simulated(tmp_path):
    write_campaign(carrier_campaign(), tmp_path / "c", simulated=True)
    return tmp_path / "c"


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_the_mark_holds_the_digest_of_every_run_file(simulated):
    document = tomllib.loads((simulated / "campaign.toml").read_text())
    assert document["version"] == 2
    assert document["simulated"]["software"].startswith("carrierflex ")
    assert document["simulated"]["sha256"] == {
        run["file"]: hashlib.sha256((simulated / run["file"]).read_bytes()).hexdigest()
        for run in document["runs"]
    }
    read_campaign(simulated)


def test_a_measurement_is_not_replaced_by_a_simulation(tmp_path):
    folder = tmp_path / "measured"
    write_campaign(carrier_campaign(seed=3), folder)
    before = contents(folder)
    with pytest.raises(
        ValueError, match=r"campaign\.toml: no table \[simulated\].* are not replaced"
    ):
        write_campaign(carrier_campaign(), folder, simulated=True)
    assert contents(folder) == before


@pytest.mark.parametrize("name", ["LC1.csv", "campaign.toml"])
def test_changed_records_are_not_replaced(simulated, name):
    # A line more in a record; in the document a digest that is not the file's.
    path = simulated / name
    text = path.read_text()
    first = tomllib.loads((simulated / "campaign.toml").read_text())["simulated"]["sha256"]
    digest = first["LC1.csv"]
    path.write_text(text.replace(digest, digest[::-1]) if name == "campaign.toml" else text + "\n")
    before = contents(simulated)
    with pytest.raises(ValueError, match=r"LC1\.csv: not as \[simulated\] .* never replaced"):
        prepare_campaign_folder(simulated)
    assert contents(simulated) == before


def test_a_missing_record_is_told(simulated):
    (simulated / "LC1.csv").unlink()
    with pytest.raises(ValueError, match=r"LC1\.csv: not as \[simulated\]"):
        prepare_campaign_folder(simulated)


def test_a_mark_without_digests_is_refused(simulated):
    path = simulated / "campaign.toml"
    text = path.read_text()
    digest = tomllib.loads(text)["simulated"]["sha256"]["LC1.csv"]
    path.write_text(text.replace(digest, "yes"))
    with pytest.raises(ValueError, match=r"64 hexadecimal digits"):
        read_campaign(simulated)
