"""Command lines that are refused: an option that no command has, a TOML file that is wrong."""

import inspect
from collections.abc import Iterator, Mapping
from pathlib import Path

from carrierflex.workflows.shell.called_commands import options_of, workflow_of
from carrierflex.workflows.shell.commands import COMMANDS

_BAD = "no_such_key = 1\n"
_CASE = 'format = "carrierflex-case"\nversion = 1\n'
_CAMPAIGN = 'format = "carrierflex-campaign"\nversion = 2\n'
_MAP = 'format = "carrierflex-map"\nversion = 1\n'
#: Heads with which a file is taken for one of its kind: its keys are then looked at.
_HEADS = {
    "parameters": {"": ""},
    "surfaces": {"": 'format = "carrierflex-surfaces"\nversion = 1\n'},
    "interfaces": {"": 'format = "carrierflex-interfaces"\nversion = 1\n'},
    "law": {"": 'format = "carrierflex-law"\nversion = 3\n'},
    "mounting": {"": f'{_CASE}kind = "mounting"\n'},
    "case": {
        "carrier": f'{_CASE}kind = "carrier"\n',
        "mounting": f'{_CASE}kind = "mounting"\n',
        "stage": 'format = "carrierflex-stage-case"\nversion = 1\n',
    },
    "map_": {kind: f'{_MAP}kind = "{kind}"\n' for kind in ("carrier", "mounting", "element")},
    "rexs": {"": ""},
    "campaign": {
        kind: f'{_CAMPAIGN}kind = "{kind}"\n' for kind in ("carrier", "mounting", "element")
    },
}


#: What an option is refused without, before its file is read.
_STEP = ("--step", "bad.toml")
_COMPANIONS = {
    ("run", "surfaces"): _STEP,
    ("mesh", "surfaces"): _STEP,
    ("study pin-fit", "surfaces"): _STEP,
    ("study torsion", "surfaces"): _STEP,
    ("study gear-life", "surfaces"): _STEP,
    ("curves", "surfaces"): _STEP,
    ("study couplings", "surfaces"): _STEP,
    ("study sensitivities", "surfaces"): _STEP,
    ("reduce", "surfaces"): (*_STEP, "--body", "carrier"),
    ("cases", "rexs"): ("--out", "nowhere"),
    ("reduce", "interfaces"): ("--stiffness", "bad.toml", "--mass", "bad.toml"),
}
#: Values that are looked at before files are read.
_SOUND = {("reduce", "out"): "nowhere.h5", ("simulate", "case"): "carrier_lc1_to_lc4"}


def with_unknown_option() -> Iterator[list[str]]:
    """One line a command: all it asks for, and an option that it has not."""
    for name in COMMANDS:
        yield [*name.split(), *_required(name), "--no-such-option", "1"]


def with_bad_toml() -> Iterator[list[str]]:
    """Lines for every option of every command that names a TOML file, or a campaign's folder.

    One with a file that could be of any kind, and one for each kind that the option may name.
    """
    for name in COMMANDS:
        for key, option in _options(name).items():
            # simulate looks at its results before it takes them back to a REXS file.
            if key not in _HEADS or (name, key) == ("simulate", "rexs"):
                continue
            for file in ["bad", *(_bad_name(key, kind) for kind in _HEADS[key])]:
                words, flag = _required(name), _flag(key)
                path = file if key == "campaign" else f"{file}.toml"
                if option.kind is option.POSITIONAL_OR_KEYWORD:
                    words[0] = path
                elif flag in words:
                    words[words.index(flag) + 1] = path
                else:
                    words += [flag, path]
                    words += _COMPANIONS.get((name, key), ())
                yield [*name.split(), *words]


def write_bad_files(folder: Path) -> None:
    """Write what :func:`with_bad_toml` names."""
    texts = {("bad", option): _BAD for option in _HEADS}
    for option, heads in _HEADS.items():
        for kind, head in heads.items():
            texts[_bad_name(option, kind), option] = head + _BAD
    for (name, option), text in texts.items():
        path = folder / name / "campaign.toml" if option == "campaign" else folder / f"{name}.toml"
        path.parent.mkdir(exist_ok=True)
        path.write_text(text, encoding="utf-8")


def _bad_name(option: str, kind: str) -> str:
    return "_".join(word for word in ("bad", option.strip("_"), kind) if word)


def _required(name: str) -> list[str]:
    """Words that give a command all it asks for, none of them a file that exists."""
    words: list[str] = []
    for key, option in _options(name).items():
        if option.default is not inspect.Parameter.empty or option.kind is option.VAR_POSITIONAL:
            continue
        choices = getattr(option.annotation, "__args__", ())
        value = choices[0] if choices and isinstance(choices[0], str) else "nowhere"
        value = _SOUND.get((name, key), value)
        is_positional = option.kind is option.POSITIONAL_OR_KEYWORD
        words += [value] if is_positional else [_flag(key), value]
    return words


def _options(name: str) -> Mapping[str, inspect.Parameter]:
    return options_of(workflow_of(COMMANDS[name]))


def _flag(key: str) -> str:
    return f"--{key.strip('_').replace('_', '-')}"
