"""A new map.toml with its guesses, a comment beside every key, and ``?`` where the user tells."""

import json
from collections.abc import Iterator
from typing import Any

from carrierflex.files.toml_values import TomlTable
from carrierflex.identification.logs.map_guesses import Guess, MapGuess
from carrierflex.identification.logs.map_tables import MAP_OF_KIND, OPEN
from carrierflex.simulation.mounting.rig_keys import RIG_KEYS

_BASELINE = {"carrier": '["axial_offset"]', "mounting": "[]", "element": "[]"}
_RIG_OF_CARRIER = (
    ("nominal_torque", "torque on the main shaft that counts as 100 % [N m]"),
    ("sensor_radius", "radius of the circle that the sensors face [m]"),
    ("n_planets", "number of planets, 3 to 8; other than 3 needs deflection_curves"),
)
_DRIVES = (
    "displacement: input displacement, channel force; force: input force, channel displacement; "
    "free_decay: no input; base: input base_displacement or base_acceleration"
)
_COMMENT_AT = 44


def map_text(guess: MapGuess, schema: str) -> str:
    """Text of a map.

    Parameters
    ----------
    guess : MapGuess
        What is known or guessed.
    schema : str
        First comment, which tells editors the schema.
    """
    return "\n".join([schema, *_head(guess), *_rig(guess), *_signals(guess), *_runs(guess), ""])


def _line(name: str, value: Any, comment: str = "") -> str:
    return _commented(f"{name} = {_toml(value)}", comment)


def _commented(text: str, comment: str) -> str:
    return f"{text:<{_COMMENT_AT}}  # {comment}" if comment else text


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_toml(item) for item in value) + "]"
    if isinstance(value, str):
        # JSON's strings are TOML's, but for one sign.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    return repr(value)


def _head(guess: MapGuess) -> Iterator[str]:
    yield "# What the columns of the logger's files are. Guesses: look at each line, fill in '?'."
    yield "# Units are those of the files; [rig] is in SI units. docs/import.md has all keys."
    for name, words in guess.dialects.items():
        yield f"# {_on_one_line(name)}: {_on_one_line(words)}"
    yield _line("format", "carrierflex-map")
    yield _line("version", 1)
    yield _line("kind", guess.kind, "carrier | mounting | element")
    yield _line("name", f"{guess.kind} of {guess.runs[0].files[0]}", "title of the campaign")
    yield ""
    yield "[time]"
    if guess.time.column:
        rate = f"; {guess.rate_hz:.6g} samples a second" if guess.rate_hz else ""
        yield _line("column", guess.time.column, guess.time.why + rate)
    yield _line("unit", guess.time.unit, "'s', 'ms' ..., or 'date'")
    if guess.date_format:
        yield _line("format", guess.date_format, "of dates, without the fraction of the second")
    yield _commented("# rate_hz = 100.0", "rate of the campaign; default: the slowest")
    yield _commented("#", "channel's. Faster ones are filtered first.")
    yield ""
    yield _commented("[baseline]", "the simulation whose gap is to be explained")
    yield _line("source", "model", "with --simulated: the other simulator's predictions")
    yield f"effects = {_BASELINE[guess.kind]}"


def _rig(guess: MapGuess) -> Iterator[str]:
    yield ""
    yield _commented("[rig]", "nominal facts, SI units")
    if guess.kind == "carrier":
        for name, words in _RIG_OF_CARRIER:
            yield _line(name, 3 if name == "n_planets" else OPEN, words)
        if "radial_load" in guess.rig:
            yield _line("radial_load", "none", "no column of it found; else delete this line")
        yield _commented(
            '# deflection_curves = "curves.csv"', "of another carrier, in the folder of this map"
        )
    elif guess.kind == "mounting":
        for name, entry in RIG_KEYS.items():
            unit = f" [{entry.unit}]" if entry.unit else ""
            yield _line(name, OPEN, f"{entry.words}{unit}")
    else:
        yield _line("drive", guess.rig["drive"], _DRIVES)
        yield _commented("# mass = 12.0", "on the element [kg]; fitted where absent")
        yield _commented("# settle_samples = 100", "first samples that are left out")
        yield _commented("# periodic = true", "where the drive repeats, with")
        yield _commented("# period_samples = 2000", "the samples of a period")


def _signals(guess: MapGuess) -> Iterator[str]:
    for name, column in guess.inputs.items():
        yield ""
        yield "[[inputs]]"
        yield _line("name", name)
        yield from _column(column)
        if column.unit == "pulses":
            yield _line("pulses_per_turn", OPEN, "of the carrier, gears between included")
            yield _commented("# wraps_at = 65536", "where the counter begins anew")
        if name == "carrier_angle":
            yield _commented("# factor = -1.0", "where it turns against the torque")
            yield _commented("# offset = 12.5", "so that it is zero with pin 1 up")
    for name, column, facts in guess.channels:
        yield ""
        yield "[[channels]]"
        yield _line("name", name, "a name of your own")
        yield from _column(column)
        words = _words_of(guess.kind)
        for key, value in facts.items():
            yield _line(key, value, words.get(key, ""))
        yield _commented("# noise_std = 2.0", "in the unit above; default: from repeats")
    if guess.others:
        yield ""
        yield f"# Columns that were left out: {_on_one_line(', '.join(guess.others))}"


def _column(guess: Guess) -> Iterator[str]:
    yield _line("column", guess.column, _on_one_line(guess.why))
    yield _line("unit", guess.unit, "unit of the column")


def _words_of(kind: str) -> dict[str, str]:
    """Words of a channel's keys, as the schema has them."""
    annotation = MAP_OF_KIND[kind].model_fields["channels"].annotation
    table: type[TomlTable] = annotation.__args__[0]  # type: ignore[union-attr]
    return {name: (entry.description or "") for name, entry in table.model_fields.items()}


def _runs(guess: MapGuess) -> Iterator[str]:
    for run in guess.runs:
        yield ""
        yield "[[runs]]"
        yield _line("name", run.name)
        yield _line("files", run.files)
        if run.group:
            yield _line("group", run.group, "in the file")
        yield _line("condition", run.name, "runs of the same words are repeats of one another")
        if len(run.files) > 1:
            yield _commented(
                f"# starts = {{ {_toml(run.files[1])} = 0.5 }}", "seconds to add to a file's time"
            )


def _on_one_line(text: str) -> str:
    return "".join(sign if sign.isprintable() else " " for sign in " ".join(text.split()))
