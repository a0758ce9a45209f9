"""The help of every option: its unit, its default as people say it, one meaning a name."""

import inspect
import re
import typing

import pytest

from carrierflex.workflows import command_line
from carrierflex.workflows.shell.called_commands import _units_of, options_of, workflow_of
from carrierflex.workflows.shell.commands import COMMANDS, GROUPS, HOLDERS, RELATED

WORKFLOWS = {name: workflow_of(command) for name, command in COMMANDS.items()}
OPTIONS = {name: options_of(workflow) for name, workflow in WORKFLOWS.items()}
#: Numbers without a unit say so in words.
WITHOUT_UNIT = re.compile(r"\bshare\b|\bper cent\b|%")
#: What each of these stands for wherever a command has it.
ONE_MEANING = {
    "step": "STEP file",
    "surfaces": "surfaces|Surfaces",
    "size": "lement edge length",
    "parameters": "TOML file",
    "seed": "[Ss]eed|Of the reference's noise",
    "workers": "Processes",
    "scheduler": "Dask scheduler",
    "out": r"^ (Folder|File) to write",
    "curves": "[Dd]eflection curves",
    "torque": "[Tt]orque",
    "duration": "Length",
}


def command_of(name):
    app = command_line.application()
    for word in name.split():
        app = app[word]
    return app


def texts(docstring):
    """Description by parameter."""
    result, names = {}, []
    for line in docstring.partition("Parameters\n----------\n")[2].splitlines():
        if set(line) == {"-"}:
            break
        if line and not line.startswith(" "):
            names = [option.strip() for option in line.partition(" :")[0].split(",")]
            result |= dict.fromkeys(names, "")
        else:
            for name in names:
                result[name] += " " + line.strip()
    return result


def options():
    for name, of_command in OPTIONS.items():
        for key, option in of_command.items():
            if key != "quiet":
                yield pytest.param(name, key, option, id=f"{name} {key}")


def is_float(annotation):
    return annotation is float or float in typing.get_args(annotation)


@pytest.mark.parametrize(("name", "key", "option"), options())
def test_every_option_is_described_with_its_unit(name, key, option):
    text = texts(inspect.getdoc(WORKFLOWS[name]))[key]
    assert text.strip()
    if is_float(option.annotation):
        assert _units_of(inspect.getdoc(WORKFLOWS[name])).get(key) or WITHOUT_UNIT.search(text), (
            text
        )


@pytest.mark.parametrize(("name", "key", "option"), options())
def test_an_option_means_one_thing_over_all_commands(name, key, option):
    meaning = ONE_MEANING.get(key)
    if meaning is not None:
        assert re.search(meaning, texts(inspect.getdoc(WORKFLOWS[name]))[key])


@pytest.mark.parametrize("name", COMMANDS)
def test_every_option_has_help_on_the_screen(name):
    shown = command_of(name).assemble_argument_collection(parse_docstring=True)
    helpless = [item.name for item in shown if item.show and not item.parameter.help]
    assert not helpless


def test_every_command_is_shown_once_and_the_first_help_shows_28_at_most(command):
    first = [name for names in GROUPS.values() for name in names]
    nested = [name for name in COMMANDS if name.split()[0] in HOLDERS]
    related = [name for names in RELATED.values() for name in names]
    assert sorted([*first, *nested, *related]) == sorted([*COMMANDS, *HOLDERS])
    assert {*RELATED} <= {*first}
    assert len(first) <= 28
    shown = command("--help").stdout
    listed = [line.split()[0] for line in shown.splitlines() if re.match(r"  [a-z]", line)]
    assert [name for name in listed if name != "carrierflex"] == first
    assert shown.count("\n") <= 50


@pytest.mark.parametrize("name", RELATED)
def test_a_help_ends_with_the_commands_that_belong_to_it(command, name):
    shown = command(name, "--help").stdout if name != "run" else command("--help").stdout
    related = shown.partition("Related:")[2]
    for other in RELATED[name]:
        assert f"carrierflex {other} " in related
        assert COMMANDS[other].help in related


@pytest.mark.parametrize("name", COMMANDS)
def test_no_flag_is_switched_off_that_is_off_and_no_list_emptied(command, name):
    shown = command(*name.split(), "--help").stdout
    on = [key for key, option in OPTIONS[name].items() if option.default is True]
    negative = {f"--no-{key.replace('_', '-')}" for key in on}
    assert set(re.findall(r"--no-[\w-]+", shown)) == negative
    assert "--empty-" not in shown


@pytest.mark.parametrize("name", COMMANDS)
def test_what_is_named_by_its_place_has_no_option(command, name):
    shown = command(*name.split(), "--help").stdout
    for key, option in OPTIONS[name].items():
        if option.kind is option.POSITIONAL_OR_KEYWORD:
            assert f"--{key.replace('_', '-')} " not in shown


@pytest.mark.parametrize("name", COMMANDS)
def test_every_default_is_shown(command, name):
    shown = " ".join(command(*name.split(), "--help").stdout.split())
    for key, option in OPTIONS[name].items():
        is_number = isinstance(option.default, int | float) and not isinstance(option.default, bool)
        if key == "quiet" or not (
            is_number or (isinstance(option.default, str) and option.default)
        ):
            continue
        flag = f"--{key.strip('_').replace('_', '-')}"
        help_text = shown.partition(f"{flag} ")[2]
        assert "[default: " in help_text.partition(" --")[0], (flag, help_text[:300])


def test_defaults_have_the_unit_that_people_use(command):
    shown = " ".join(command("study", "torsion", "--help").stdout.split())
    assert "[default: 360 kN m (360000 N m)]" in shown
    shown = " ".join(command("study", "order-one", "--help").stdout.split())
    assert "[default: 30 mm (0.03 m)]" in shown


@pytest.mark.parametrize("name", [*COMMANDS, *HOLDERS])
def test_the_help_of_a_command_fits_on_one_screen(command, name):
    assert command(*name.split(), "--help").stdout.count("\n") <= 50


def test_the_complete_help_of_a_command_is_that_of_its_docstring(command):
    short = " ".join(command("reduce", "--help").stdout.split())
    complete = " ".join(command("reduce", "--help", "--verbose").stdout.split())
    for key, text in texts(inspect.getdoc(WORKFLOWS["reduce"])).items():
        if key != "quiet":
            assert " ".join(text.split()) in complete
    assert "Harwell-Boeing" in complete
    assert "Harwell-Boeing" not in short
    assert "Stiffness matrix of another program" in short
