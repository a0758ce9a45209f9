"""The folder of the page: names stay in it, and nothing in it is replaced."""

import asyncio

import pytest

from carrierflex.workflows.app.work_folder import WorkFolder


def save(folder, name, content):
    async def write(path):
        path.write_bytes(content)

    asyncio.run(folder.save(name, write))


@pytest.mark.parametrize(
    "name",
    ["../a.csv", "b/a.csv", "/etc/passwd", "..", "a\\b.csv", ".hidden", "--out", "a\n.csv", ""],
)
def test_a_name_that_leads_out_is_hidden_or_looks_like_an_option_is_refused(name, tmp_path):
    work = tmp_path / "work"
    work.mkdir()
    with pytest.raises(ValueError, match="expected a plain name without folders"):
        save(WorkFolder(work), name, b"1")
    assert [path.name for path in tmp_path.rglob("*")] == ["work"]


def test_a_file_is_saved_once_and_another_one_of_its_name_is_refused(tmp_path):
    folder = WorkFolder(tmp_path)
    save(folder, "a.csv", b"1")
    save(folder, "a.csv", b"1")
    with pytest.raises(ValueError, match=r"a\.csv: is in the folder already"):
        save(folder, "a.csv", b"2")
    assert [path.name for path in tmp_path.iterdir()] == ["a.csv"]
    assert (tmp_path / "a.csv").read_bytes() == b"1"


def test_a_failed_upload_leaves_nothing(tmp_path):
    async def write(path):
        path.write_bytes(b"half")
        raise OSError("disk full")

    with pytest.raises(OSError, match="disk full"):
        asyncio.run(WorkFolder(tmp_path).save("a.csv", write))
    assert not list(tmp_path.iterdir())


def test_results_get_names_that_are_free_and_the_last_is_found_again(tmp_path):
    folder = WorkFolder(tmp_path)
    assert (folder.free("map", ".toml"), folder.last("map", ".toml")) == ("map.toml", None)
    for number in range(1, 12):
        (tmp_path / folder.free("map", ".toml")).write_text(str(number), encoding="utf-8")
    assert (tmp_path / folder.last("map", ".toml")).read_text(encoding="utf-8") == "11"
    (tmp_path / "campaign").mkdir()
    (tmp_path / "campaign" / "campaign.toml").touch()
    (tmp_path / "campaign_2").mkdir()  # of a command that was stopped
    assert folder.free("campaign") == "campaign_3"
    assert folder.last("campaign", document="campaign.toml") == "campaign"
    (tmp_path / "a.csv").touch()
    assert folder.log_files() == ["a.csv"]
