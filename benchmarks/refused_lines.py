"""Command lines that are refused: an option that no command has, a TOML file that is wrong."""

import inspect
from collections.abc import Iterator, Mapping
from pathlib import Path

from carrierflex.workflows.shell.commands import COMMANDS
from carrierflex.workflows.shell.early_refusals import READ_EARLY
from carrierflex.workflows.shell.written_signatures import written_command

_BAD = "no_such_key = 1\n"


def options_of(name: str) -> Mapping[str, inspect.Parameter]:
    """Options of a command by the name of the workflow's parameter."""
    module = f"carrierflex.workflows.{COMMANDS[name].workflow}"
    return written_command(module).signature.parameters


def with_unknown_option() -> Iterator[list[str]]:
    """One line a command: all it asks for, and an option that it has not."""
    for name in COMMANDS:
        yield [name, *_required(name), "--no-such-option", "1"]


def with_bad_toml() -> Iterator[list[str]]:
    """One line for every option of every command that names a TOML file, or a campaign's folder."""
    for name in COMMANDS:
        for key, option in options_of(name).items():
            if key not in READ_EARLY:
                continue
            words, flag = _required(name), _flag(key)
            if option.kind is option.POSITIONAL_OR_KEYWORD:
                words[0] = "bad" if key == "campaign" else "bad.toml"
            elif flag in words:
                words[words.index(flag) + 1] = "bad.toml"
            else:
                words += [flag, "bad.toml"]
            yield [name, *words]


def write_bad_files(folder: Path) -> None:
    """Write what :func:`with_bad_toml` names: bad.toml and bad/campaign.toml."""
    (folder / "bad").mkdir()
    for path in (folder / "bad.toml", folder / "bad" / "campaign.toml"):
        path.write_text(_BAD, encoding="utf-8")


def _required(name: str) -> list[str]:
    """Words that give a command all it asks for, none of them a file that exists."""
    words: list[str] = []
    for key, option in options_of(name).items():
        if option.default is not inspect.Parameter.empty or option.kind is option.VAR_POSITIONAL:
            continue
        choices = getattr(option.annotation, "__args__", ())
        value = choices[0] if choices and isinstance(choices[0], str) else "nowhere"
        is_positional = option.kind is option.POSITIONAL_OR_KEYWORD
        words += [value] if is_positional else [_flag(key), value]
    return words


def _flag(key: str) -> str:
    return f"--{key.strip('_').replace('_', '-')}"
