"""Records that grow on disk.

The same files as whole ones, taken over by the campaign, and refusals.
"""

from dataclasses import replace

import pytest

from carrierflex.identification.campaign.campaign_files import read_campaign, write_campaign
from carrierflex.identification.campaign.growing_runs import growing_runs
from tests.identification.synthetic_campaigns import carrier_campaign


@pytest.fixture
def campaign():
    return carrier_campaign()


def pieces_of(run, n):
    """The run in consecutive pieces of at most n samples."""
    for first in range(0, len(run.time), n):
        piece = slice(first, first + n)
        inputs, signals = (
            {name: values[piece] for name, values in columns.items()}
            for columns in (run.inputs, run.signals)
        )
        yield replace(run, time=run.time[piece], inputs=inputs, signals=signals)


def test_pieces_become_the_same_folder_as_the_whole(tmp_path, campaign):
    write_campaign(campaign, tmp_path / "whole")
    with growing_runs(tmp_path / "grown") as growing:
        for run in campaign.runs:
            for piece in pieces_of(run, 7):
                growing.append(piece)
        small = replace(campaign, runs=growing.runs)
        write_campaign(small, tmp_path / "grown", written_files=growing.files)
    assert growing.n_samples == {run.name: len(run.time) for run in campaign.runs}
    for path in (tmp_path / "whole").iterdir():
        assert (tmp_path / "grown" / path.name).read_bytes() == path.read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["grown", "whole"]


def test_a_cut_run_says_so_and_reads_back(tmp_path, campaign):
    first = campaign.runs[0]
    with growing_runs(tmp_path / "cut") as growing:
        growing.append(next(pieces_of(first, 5)))
        growing.cut(first.name, "interrupted")
        write_campaign(
            replace(campaign, runs=growing.runs), tmp_path / "cut", written_files=growing.files
        )
    (run,) = read_campaign(tmp_path / "cut").runs
    assert len(run.time) == 5
    assert run.condition == f"{first.condition}, cut at {first.time[4]:g} s: interrupted"


def test_pieces_out_of_order_and_foreign_folders_are_refused(tmp_path, campaign):
    first, second, *_ = pieces_of(campaign.runs[0], 5)
    with growing_runs(tmp_path / "new") as growing:
        growing.append(second)
        with pytest.raises(
            ValueError, match=r"a piece from .* s follows one until .* s; expected a later one"
        ):
            growing.append(first)
    assert list(tmp_path.iterdir()) == []  # nothing was taken over
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "notes.txt").write_text("mine", encoding="utf-8")
    with (
        pytest.raises(ValueError, match="holds something that is not a campaign"),
        growing_runs(tmp_path / "mine"),
    ):
        pass
