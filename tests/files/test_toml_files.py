"""Refusals of TOML files: one of each kind, all problems at once, a table of bad values."""

import math
import os
from dataclasses import dataclass
from typing import Annotated, Literal

import pytest
import tomli_w
from pydantic import Field

from carrierflex.files.problems import MOST_LISTED, refuse
from carrierflex.files.shown_values import shown
from carrierflex.files.toml_files import TomlKind, checked_document, read_toml, toml_document
from carrierflex.files.toml_values import (
    Count,
    Expected,
    FieldsOf,
    Flag,
    Harmonics,
    Key,
    KeysOf,
    NotNegative,
    Number,
    Positive,
    PositiveCount,
    Text,
    Texts,
    ThreePositive,
    TomlTable,
    TwoNumbers,
    different,
    key,
)

RIG = TomlKind("a rig file", most_bytes=10_000, format="rig", version=3, holds="the table [shaft]")


@dataclass(frozen=True)
class Shaft:
    outer: float = 0.2
    inner: float = 0.1

    def __post_init__(self):
        conflicts = {
            f"inner {self.inner} m reaches outer {self.outer} m": self.inner >= self.outer,
            "outer beyond 5 m": self.outer > 5,
        }
        refuse(text for text, holds in conflicts.items() if holds)


SHAFT = {name: Key(Positive, f"{name.capitalize()} diameter", "m") for name in ("outer", "inner")}


class Disc(TomlTable):
    type: Literal["disc"] = key("Kind")
    radius: Positive = key("Radius", "m")


class Bar(TomlTable):
    type: Literal["bar"] = key("Kind")
    length: Positive = key("Length", "m")


class Run(TomlTable):
    name: Text = key("Name")
    loads: dict[str, Number] = key("Loads", "N", default_factory=dict)


class Rig(TomlTable):
    format: Literal["rig"] = key("Kind of the file")
    version: Literal[1, 2, 3] = key("Version")
    text: Text = key("Text", default="a")
    texts: Texts = key("Texts", default_factory=list)
    flag: Flag = key("Flag", default=False)
    number: Number = key("Number", default=0.0)
    positive: Positive = key("Positive", default=1.0)
    not_negative: NotNegative = key("Not negative", default=0.0)
    count: Count = key("Count", default=0)
    positive_count: PositiveCount = key("Positive count", default=1)
    harmonics: Harmonics = key("Harmonics", default=3)
    three: ThreePositive = key("Three", default=(1.0, 1.0, 1.0))
    two: TwoNumbers = key("Two", default=(1.0, 1.0))
    colour: Annotated[Literal["red", "blue"], Expected("one of red, blue")] = key(
        "Colour",
        default="red",
    )
    shaft: Annotated[Shaft, FieldsOf(SHAFT)] = key("Shaft", default_factory=Shaft)
    spare: Annotated[TomlTable, KeysOf(SHAFT, required=False)] | None = key(
        "Spare shaft",
        default=None,
    )
    parts: dict[str, Annotated[Disc | Bar, Field(discriminator="type")]] = key(
        "Parts",
        default_factory=dict,
    )
    runs: Annotated[list[Run], Field(min_length=1), different("run name")] = key("Runs")


HEAD = {"format": "rig", "version": 3, "runs": [{"name": "A"}]}


def refusal(**changes):
    """What is told about a document with some keys changed; None takes a key away."""
    document = {name: value for name, value in {**HEAD, **changes}.items() if value is not None}
    with pytest.raises(ValueError, match=r"rig\.toml") as caught:
        checked_document(document, Rig, "rig.toml", version=3)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def written(tmp_path, content):
    path = tmp_path / "rig.toml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def test_a_good_file_comes_back_with_its_values_and_defaults(tmp_path):
    document = {
        **HEAD,
        "number": 2,
        "harmonics": 4.0,
        "three": [1, 2, 3.5],
        "shaft": {"outer": 0.3},
    }
    rig = read_toml(written(tmp_path, tomli_w.dumps(document)), RIG, Rig)
    assert (rig.number, rig.harmonics, rig.three, rig.text) == (2.0, 4, (1.0, 2.0, 3.5), "a")
    assert isinstance(rig.harmonics, int)
    assert rig.shaft == Shaft(outer=0.3)
    assert set(rig.given()) == {*HEAD, "number", "harmonics", "three", "shaft"}


@pytest.mark.parametrize("line_end", ["\n", "\r\n", "\r"])
def test_line_ends_of_any_system_are_read(tmp_path, line_end):
    content = line_end.join(["a = 1", "b = 2", ""]).encode()
    assert toml_document(written(tmp_path, content), RIG) == {"a": 1, "b": 2}


def test_a_missing_file_says_what_it_would_hold(tmp_path):
    with pytest.raises(
        FileNotFoundError,
        match=r"none\.toml: no such file; expected a rig file \(TOML with the table",
    ):
        toml_document(tmp_path / "none.toml", RIG)
    with pytest.raises(FileNotFoundError, match="no such file"):
        toml_document(written(tmp_path, "") / "below_a_file.toml", RIG)


def test_folders_pipes_and_devices_are_refused_unread(tmp_path):
    with pytest.raises(ValueError, match="a folder; expected a rig file"):
        toml_document(tmp_path, RIG)
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(ValueError, match="a device or a pipe; expected a rig file"):
        toml_document(tmp_path / "pipe", RIG)


def test_a_large_file_is_refused_by_its_size_before_it_is_read(tmp_path):
    path = tmp_path / "rig.toml"
    with path.open("wb") as file:
        file.truncate(2**40)  # a terabyte without a byte on the disk
    with pytest.raises(
        ValueError,
        match=rf"{2**40} bytes; expected a rig file of at most 10000 bytes",
    ):
        toml_document(path, RIG)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"a = 1\nb = '\xe9'\n", "byte 0xe9 in line 2 is no UTF-8 text"),
        ("a = 1\n".encode("utf-16"), "begins with a byte order mark; expected UTF-8 without one"),
        ("a = 1\n".encode("utf-8-sig"), "begins with a byte order mark"),
        (b"a = 1\nb = \n", "Invalid value .at line 2, column 5"),
        (b"a = 1\na = 2\n", "Cannot overwrite a value .at line 2, column 6"),
        (b"a = " + b"[" * 5000, "lists or tables are nested too deep"),
        (b"a = " + b"9" * 5000, "Exceeds the limit"),
        (b"\x00\x01", "Invalid statement .at line 1, column 1"),
    ],
)
def test_what_is_no_toml_is_refused_with_its_place(tmp_path, content, message):
    with pytest.raises(ValueError, match=rf"rig\.toml: not a TOML file: {message}") as caught:
        toml_document(written(tmp_path, content), RIG)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("head", "message"),
    [
        ({}, "missing key 'format'; expected 'rig' for a rig file"),
        ({"format": "case", "version": 9}, "key 'format' is 'case'; expected 'rig' for a rig file"),
        ({"format": "rig"}, "missing key 'version'; expected 3"),
        ({"format": "rig", "version": True}, "key 'version' is true; expected 3"),
        ({"format": "rig", "version": "3"}, "key 'version' is '3'; expected 3"),
        ({"format": "rig", "version": 0}, "key 'version' is 0; expected 3"),
        (
            {"format": "rig", "version": 4, "new": 1},
            "'version' is 4, written by a newer version; expected 3: update",
        ),
    ],
)
def test_format_and_version_are_told_before_anything_else(tmp_path, head, message):
    path = written(tmp_path, tomli_w.dumps({**head, "unknown": 1}))
    with pytest.raises(ValueError, match=message) as caught:
        read_toml(path, RIG, Rig)
    assert "unknown" not in str(caught.value)


def test_an_unknown_key_is_named_with_the_nearest_known_one():
    assert refusal(positiv=1.0) == "rig.toml: unknown key 'positiv'; did you mean 'positive'?"
    assert refusal(Shaft={}) == "rig.toml: unknown key 'Shaft'; did you mean 'shaft'?"
    message = refusal(shaft={"weight": 1})
    assert message == "rig.toml: [shaft]: unknown key 'weight'; expected one of outer, inner"
    assert refusal(runs=[{"name": "A", "q" * 5000: 1}]).startswith(
        "rig.toml: [[runs]] 1: unknown key 'qqqq",
    )
    assert len(refusal(runs=[{"name": "A", "q" * 5000: 1}])) < 200


def test_a_misspelt_required_key_is_one_problem_not_two():
    message = refusal(runs=[{"nam": "A"}])
    assert message == "rig.toml: [[runs]] 1: unknown key 'nam'; did you mean 'name'?"


def test_missing_keys_say_what_they_hold():
    assert refusal(runs=None) == "rig.toml: missing key 'runs'; expected at least one table"
    assert "[[runs]] 1: missing key 'name'; expected a non-empty string on" in refusal(runs=[{}])
    message = refusal(parts={"a": {"type": "disc"}})
    assert message == "rig.toml: [parts.a]: missing key 'radius'; expected a positive number"


def test_a_table_whose_form_depends_on_a_key_is_checked_by_that_form():
    assert "[parts.a]: unknown key 'radius'; expected one of type, length" in refusal(
        parts={"a": {"type": "bar", "radius": 1, "length": 2}},
    )
    assert "[parts.a]: key 'type' is 'cone'; expected one of bar, disc" in refusal(
        parts={"a": {"type": "cone"}},
    )
    assert "[parts.a]: key 'type' is ['disc']; expected one of bar, disc" in refusal(
        parts={"a": {"type": ["disc"]}},
    )
    assert "[parts.a]: missing key 'type'; expected one of bar, disc" in refusal(parts={"a": {}})


NOT_NUMBERS = ("1", True, [1.0], {}, math.nan, math.inf, -math.inf)
BAD_VALUES = {
    "text": (
        ("", " ", "a\nb", 1, True, ["a"], {}, [{"name": "b"}]),
        "a non-empty string on one line",
    ),
    "texts": (("a", [1], [""], [["a"]], {}), "a list of strings"),
    "flag": ((0, 1, "true", []), "true or false"),
    "number": (NOT_NUMBERS, "a finite number"),
    "positive": ((*NOT_NUMBERS, 0, 0.0, -1e-300), "a positive number"),
    "not_negative": ((*NOT_NUMBERS, -1, -1e-300), "a number >= 0"),
    "count": (("1", True, 1.0, -1, math.nan), "a whole number >= 0"),
    "positive_count": (("1", True, 1.0, 0, -1), "a whole number >= 1"),
    "harmonics": (("1", True, 1.5, -1, math.nan, math.inf), "a whole number >= 0"),
    "three": (
        (1.0, [], [1, 2], [1, 2, 3, 4], [1, 2, 0], [1, 2, "3"], [1, True, 2], {}),
        "three positive numbers",
    ),
    "two": (([1], [1, 2, 3], [1, math.inf], "12"), "two finite numbers"),
    "colour": (("green", 1, ["red"], ""), "one of red, blue"),
    "shaft": ((1, "a", [{}]), "a table"),
    "runs": ((1, "a", [], {}), "at least one table"),
}


@pytest.mark.parametrize("name", BAD_VALUES)
def test_every_bad_value_is_named_with_what_is_expected(name):
    values, words = BAD_VALUES[name]
    for value in values:
        expected = f"rig.toml: key '{name}' is {shown(value)}; expected {words}"
        assert refusal(**{name: value}) == expected


def test_all_problems_of_a_file_are_told_at_once():
    message = refusal(
        positive=-1.0,
        colour="green",
        colours="red",
        shaft={"outer": 0.1, "inner": 0.2},
        parts={"a": {"type": "disc", "radius": "x"}, "b": {"type": "cone"}},
        runs=[{"name": "A"}, {"name": 3, "loads": {"x": math.nan}}],
    )
    problems = [
        "key 'positive' is -1.0; expected a positive number",
        "key 'colour' is 'green'; expected one of red, blue",
        "[shaft]: inner 0.2 m reaches outer 0.1 m",
        "[parts.a]: key 'radius' is 'x'; expected a positive number",
        "[parts.b]: key 'type' is 'cone'; expected one of bar, disc",
        "[[runs]] 2: key 'name' is 3; expected a non-empty string on one line",
        "[[runs]] 2, [loads]: key 'x' is nan; expected a finite number",
        "unknown key 'colours'; did you mean 'colour'?",
    ]
    listed = "; ".join(f"({number}) {problem}" for number, problem in enumerate(problems, start=1))
    assert message == f"8 problems in rig.toml: {listed}"


def test_all_conflicts_of_one_table_are_told_at_once():
    message = refusal(shaft={"outer": 6, "inner": 7})
    assert message.startswith(
        "2 problems in rig.toml: (1) [shaft]: inner 7.0 m reaches outer 6.0 m;",
    )
    assert message.endswith("; (2) [shaft]: outer beyond 5 m")


def test_repeated_names_are_counted():
    message = refusal(runs=[{"name": "A"}] * 3)
    assert message == "rig.toml: run name 'A' occurs 3 times; expected different names"


def test_a_long_list_of_problems_is_cut_and_counted():
    message = refusal(runs=[{"name": number} for number in range(100)])
    assert message.startswith("100 problems in rig.toml: (1) ")
    assert f"({MOST_LISTED}) " in message
    assert f"({MOST_LISTED + 1}) " not in message
    assert message.endswith("; and 80 more")


def test_long_values_are_cut():
    hexadecimal = int("f" * 5000, 16)  # too long for Python to write in decimals
    for value in ("x" * 10_000, [1.0] * 10_000, {"a": "b" * 10_000}, 10**4000, hexadecimal):
        assert len(refusal(flag=value)) < 160


def test_a_table_that_does_not_state_every_field_of_its_class_is_a_mistake_of_the_program():
    class Half(TomlTable):
        shaft: Annotated[Shaft, FieldsOf({"outer": SHAFT["outer"]})]

    with pytest.raises(TypeError, match=r"Shaft: fields and keys differ by \['inner'\]"):
        Half.model_validate({"shaft": {"outer": 1.0}})
