"""A value of a map changes, and nothing else of it."""

import tomllib

import pytest

from carrierflex.identification.logs.map_guesses import Guess, MapGuess, RunGuess
from carrierflex.identification.logs.map_text import map_text
from carrierflex.workflows.app.map_lines import map_lines, with_key, with_value


@pytest.fixture(scope="module")
def text():
    channels = [
        (
            name,
            Guess(f"{name} #1 [um]", "um", "a # in words"),
            {"quantity": "q", "angle_deg": angle},
        )
        for name, angle in (("a", 47.0), ("b", "?"))
    ]
    inputs = {"torque": Guess('M \\ "x"', "kN m")}
    runs = [RunGuess("LC1", ("a.csv", "b.csv"))]
    guess = MapGuess("carrier", {}, Guess("t", "s"), "", None, inputs, channels, runs, ["rest"])
    return map_text(guess, "#:schema x")


def line_of(text, table, nth, key):
    (line,) = [one for one in map_lines(text) if (one.table, one.nth, one.key) == (table, nth, key)]
    return line


def test_every_key_of_the_map_is_a_line_with_its_value(text):
    document = tomllib.loads(text)
    for line in map_lines(text):
        if line.is_given:
            table = document[line.table] if line.table else document
            table = table[line.nth] if isinstance(table, list) else table
            assert table[line.key] == line.value
    given = [line for line in map_lines(text) if line.is_given]
    tables = [document, *(value for value in document.values() if isinstance(value, dict))]
    lists = [one for value in document.values() if isinstance(value, list) for one in value]
    leaves = [
        key
        for table in (*tables, *lists)
        for key, value in table.items()
        if not isinstance(value, dict) and key not in ("inputs", "channels", "runs")
    ]
    assert sorted(line.key for line in given) == sorted(leaves)
    assert line_of(text, "channels", 0, "column").words == "a # in words"


@pytest.mark.parametrize(
    ("key_path", "given", "value"),
    [
        (("rig", 0, "nominal_torque"), "360e3", 360e3),
        (("channels", 1, "angle_deg"), "137.0", 137.0),
        (("channels", 0, "unit"), "1", "1"),
        (("channels", 0, "column"), 'M "#" \\ x', 'M "#" \\ x'),
        (("channels", 1, "noise_std"), "3", 3),
        (("runs", 0, "files"), '["c.csv"]', ["c.csv"]),
    ],
)
def test_one_value_changes_and_comments_stay(text, key_path, given, value):
    changed = with_value(text, line_of(text, *key_path), given)
    before, after = text.splitlines(), changed.splitlines()
    differing = [i for i, pair in enumerate(zip(before, after, strict=True)) if pair[0] != pair[1]]
    assert differing == [line_of(text, *key_path).number]
    assert line_of(changed, *key_path)._replace(value=None, raw="") == line_of(
        text, *key_path
    )._replace(value=None, raw="", is_given=True)
    assert line_of(changed, *key_path).value == value
    tomllib.loads(changed)


def test_an_example_that_is_emptied_is_a_comment_again_and_an_open_value_stays_open(text):
    line = line_of(text, "channels", 0, "noise_std")
    changed = with_value(text, line, "3.0")
    emptied = with_value(changed, line_of(changed, "channels", 0, "noise_std"), "")
    assert "noise_std" not in tomllib.loads(emptied)["channels"][0]
    assert with_value(text, line_of(text, "rig", 0, "nominal_torque"), "") == text


def test_a_key_joins_the_table_of_the_line_above(text):
    changed = with_key(text, line_of(text, "channels", 1, "column"), "factor", "-1.0")
    document = tomllib.loads(changed)
    assert document["channels"][1].pop("factor") == -1.0
    assert document == tomllib.loads(text)
