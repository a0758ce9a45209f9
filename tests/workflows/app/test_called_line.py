"""A command line as a process: its stages, its one line where it refuses, and its end."""

import asyncio

import pytest

from carrierflex.workflows.app.called_line import CalledLine, _tables_in


def call(folder, *words):
    noted = []
    called = CalledLine(folder)
    ended = asyncio.run(called.call(words, lambda text, share: noted.append((text, share))))
    assert not called.is_busy
    return ended, noted


@pytest.mark.long
def test_stages_are_noted_and_the_table_is_that_of_the_command(tmp_path, command):
    line = ("mesh", "--size", "0.1", "--out", "a.msh")
    ended, noted = call(tmp_path, *line)
    assert [share for _, share in noted] == [0.5, 1.0]
    assert not ended.refusal
    assert ended.tables == _tables_in(command(*line).stdout)
    _, rows = ended.tables[0]
    assert len({len(row) for row in rows}) == 1
    assert len(rows) > 3


def test_a_refusal_is_the_one_line_of_the_command(tmp_path, command):
    line = ("check", "nowhere")
    ended, _ = call(tmp_path, *line)
    assert command(*line).stderr == f"carrierflex: {ended.refusal}\n"
    assert not ended.tables


def test_a_command_that_is_stopped_leaves_nothing(tmp_path):
    async def stopped():
        called = CalledLine(tmp_path)
        asyncio.get_running_loop().call_later(1.5, called.end)
        return await called.call(["curves", "--no-cache", "--out", "curves"], lambda *_: None)

    ended = asyncio.run(stopped())
    assert ended.refusal
    assert not [path for path in tmp_path.rglob("*") if path.is_file()]


def test_columns_stand_where_every_row_has_two_blanks():
    output = (
        "check of a b      \nabout  finding      line\n-      no findings      \n"
        "probes\nname   read [deg]   sign\ns047   47.0 ± 0.0      +\n"
    )
    assert _tables_in(output) == [
        ("check of a b", [["about", "finding", "line"], ["-", "no findings", ""]]),
        ("probes", [["name", "read [deg]", "sign"], ["s047", "47.0 ± 0.0", "+"]]),
    ]
