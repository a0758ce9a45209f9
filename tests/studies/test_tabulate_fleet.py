"""A small simulated fleet through seal, batch and score."""

import pytest

from carrierflex.blind_check.sealing.check import SEALS_FILE, read_seals
from studies import tabulate_fleet

pytestmark = pytest.mark.long


def test_a_sealed_fleet_is_scored_and_taken_up(tmp_path):
    text = tabulate_fleet.main(out=tmp_path, turbines=3, days=1, seed=5, quiet=True)
    digest = read_seals(tmp_path / SEALS_FILE).digest
    assert digest in text
    assert "| another cause named, any size | - | 0% |" in text
    entries = {path: path.read_bytes() for path in (tmp_path / "fleet").rglob("batch.json")}
    assert len(entries) == 3
    again = tabulate_fleet.main(out=tmp_path, turbines=3, days=1, seed=5, quiet=True)
    assert again == text
    assert entries == {path: path.read_bytes() for path in entries}
    with pytest.raises(ValueError, match="expected another --out"):
        tabulate_fleet.main(out=tmp_path, turbines=3, days=1, seed=6, quiet=True)
