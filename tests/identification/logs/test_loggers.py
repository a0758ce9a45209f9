"""Files of twelve loggers become the campaign that they came from."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.identification.campaign.campaign_files import read_campaign
from carrierflex.workflows.identification.import_records import main as import_records
from carrierflex.workflows.identification.new_campaign import main as new_campaign
from tests.diagnosis.element.element_campaigns import displacement_campaign, force_campaign
from tests.diagnosis.mounting.mounting_campaigns import mounting_campaign
from tests.identification.logs.loggers import LOGGERS, edited
from tests.identification.synthetic_campaigns import carrier_campaign
from tests.workflows.checked_documents import checked_document


def cubic(q, v):
    return 8e8 * q**3


def clean_campaign(logger):
    if logger.kind == "carrier":
        return carrier_campaign()
    if logger.kind == "mounting":
        return mounting_campaign({"K3": 3e11})
    if logger.simulated_by == "displacement":
        return displacement_campaign(cubic)
    return force_campaign(cubic)


def imported(name, campaign, tmp_path):
    """Folder of the campaign that a logger's files become, by two commands and one edited map."""
    logger = LOGGERS[name]
    (tmp_path / "files").mkdir()
    files = logger.write(campaign, tmp_path / "files")
    drive = campaign.rig["drive"] if logger.kind == "element" else None
    guess = new_campaign(kind=logger.kind, from_=files, drive=drive, out=tmp_path / "map.toml")
    guess.path.write_text(edited(guess.text, logger, campaign), encoding="utf-8")
    import_records(files, map_=guess.path, out=tmp_path / "campaign")
    return tmp_path / "campaign"


@pytest.mark.parametrize("name", LOGGERS)
def test_files_of_a_logger_become_the_campaign_that_they_came_from(name, tmp_path):
    clean = clean_campaign(LOGGERS[name])
    imported_campaign = read_campaign(imported(name, clean, tmp_path))
    assert (imported_campaign.kind, dict(imported_campaign.rig)) == (clean.kind, dict(clean.rig))
    assert len(imported_campaign.channels) == len(clean.channels)
    for channel, expected in zip(imported_campaign.channels, clean.channels, strict=True):
        assert (channel.unit, channel.sensor) == (expected.unit, expected.sensor)
        assert_allclose(channel.noise_std, expected.noise_std, rtol=1e-12)
        if expected.angle is not None:
            assert_allclose([channel.angle, channel.radius], [expected.angle, expected.radius])
    for run, expected_run in zip(imported_campaign.runs, clean.runs, strict=True):
        time = expected_run.time
        assert_allclose(run.time, time[: run.time.size], atol=2e-6)
        assert run.time.size >= time.size - 2  # two clocks end together
        for column, values in run.inputs.items():
            wanted = expected_run.inputs[column][: run.time.size]
            known = np.isfinite(next(iter(run.signals.values())))
            # A counter tells the angle to one of 4096 pulses of a turn; lost rows are straight.
            near = 2e-3 * (1.0 + np.abs(wanted).max())
            assert_allclose(values[known], wanted[known], atol=near)
        pairs = zip(run.signals.values(), expected_run.signals.values(), strict=True)
        missing = 0
        for values, wanted in pairs:
            known = np.isfinite(values)
            missing += int((~known).sum())
            assert known.mean() > 0.95
            scale = np.abs(wanted).max()
            assert_allclose(values[known], wanted[: run.time.size][known], atol=1e-6 * scale)
        result = checked_document(tmp_path / "campaign" / "import.json")["missing"]
        counted = sum(count["rows"] for count in result if count["run"] == run.name)
        assert (counted > 0) == (missing > 0)
