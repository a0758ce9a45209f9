"""What --json prints of every command fulfils the schema that comes along."""

import pytest

from carrierflex.identification.campaign.campaign_files import write_campaign
from carrierflex.workflows.shell.commands import COMMANDS, command_in
from tests.identification.synthetic_campaigns import carrier_campaign, run_case
from tests.simulation.rexs.public_sample import public_stage
from tests.workflows.checked_documents import VALIDATOR
from tests.workflows.checked_documents import checked_result as checked

#: Lines that take a moment, with the exit code of each.
QUICK = {
    "mesh --size 0.1 --out a.msh": 0,
    "cases": 0,
    "cases --rexs a.rexs --out stage": 0,
    "schema campaign": 0,
    "info copied": 0,
    "completion bash": 0,
    "new-campaign --kind carrier --from campaign/LC1.csv --out map.toml": 0,
    "app --port 70000": 2,
    "mesh --size 5 --out a.msh": 2,
    "mesh --no-such-option 1": 2,
    "diagnoze campaign": 2,
    "study torsoin --out torsion": 2,
    "curves --parameters map.toml --out curves": 2,
    "diagnose nowhere --out out": 2,
}
#: Lines of some seconds; each reads what one before it has written.
LONG = {
    "check copied": 1,
    "doctor": 0,
    "cad --out own": 0,
    "cad-faces own/carrier.step": 0,
    "parameters --out carrier.toml": 0,
    "cad-surfaces own/carrier.step --out proposal.toml": 0,
    "curves --size 0.1 --out curves --no-cache": 0,
    "curves --size 0.1 --preview --out curves": 0,
    "reduce --body pin --modes 1 --size 0.1 --shapes --out pin.h5 --no-cache": 0,
    "reduce --body pin --modes 1 --size 0.1 --out again.h5 --preview": 0,
    "certificate pin.h5": 0,
    "export pin.h5 --format op4 --out pin.op4": 0,
    "export pin.op4 --units m-N --format body --out read.h5": 0,
    "view pin.h5 --out pin.html": 0,
    "simulate carrier_lc1_to_lc4 --out campaign": 0,
    "check campaign": 0,
    "import campaign/LC1.csv --map map.toml --out measured": 2,
    "identify campaign --model m1 --out identification": 0,
    "plan campaign --out plan": 0,
    "fmu --out mounting.fmu": 0,
    "simulate mounting_2011 --out housing": 0,
    "papers printed-tables --out printed_tables": 0,
}
#: Lines of a minute and more, on coarse meshes and short records. Those of a
#: command that reads what others write follow theirs.
SLOW = {
    "diagnose": {
        "simulate carrier_lc1_to_lc4 --out campaign": 0,
        "diagnose campaign --out gap": 0,
        "report gap --out gap.html": 0,
        "compare gap gap": 0,
        "compare gap gap --out change": 0,
        "watch campaign --baseline gap --out watch --once": 0,
    },
    "batch": {
        "simulate carrier_lc1_to_lc4 --out campaign": 0,
        "batch campaign --out fleet --no-report": 0,
    },
    "study couplings": {"study couplings --size 0.1 --out couplings": 0},
    "study torsion": {"study torsion --size 0.1 --out torsion": 0},
    "study pin-fit": {"study pin-fit --size 0.06 --points-per-decade 1 --out fit": 0},
    "study sensitivities": {"study sensitivities --size 0.1 --modes 4 --out sensitivities": 0},
    "loads": {
        "reduce --body carrier --variant flexible --size 0.1 --modes 1 --out carrier.h5": 0,
        "simulate carrier_lc1_to_lc4 --out campaign": 0,
        "loads campaign --body carrier.h5 --draws 600 --out loads": 0,
    },
    "join": {
        "reduce --body carrier --size 0.1 --modes 1 --out carrier.h5": 0,
        "reduce --body pin --size 0.1 --modes 1 --out pin.h5": 0,
        "reduce --body main_shaft --size 0.1 --modes 1 --out shaft.h5": 0,
        "join --carrier carrier.h5 --pin pin.h5 --shaft shaft.h5 --out group.h5": 0,
    },
    "figures": {"figures --only 2011-5 --out figures": 0},
    "study gear-life": {"study gear-life --size 0.06 --out life": 0},
    "study order-one": {"study order-one --size 0.06 --out order_one": 0},
    "papers gap": {"papers gap --size 0.08 --starts 1 --no-check --out papers_gap": 0},
    "papers table-5": {"papers table-5 --size 0.06 --duration 2.72 --only LC1 --out table_5": 0},
}
#: What these print is looked at where their results are: tests/workflows/main_job/test_run.py,
#: tests/workflows/diagnosis/test_blind_check.py and test_calibrate_campaign.py.
LOOKED_AT_ELSEWHERE = {"run", "blind-check", "calibrate"}
#: Of these, commands of three minutes each.
SLOWEST = ("loads", "papers gap")


def _slow_mark(name):
    return pytest.mark.acceptance if name in SLOWEST else pytest.mark.long


def write_copied_record(folder):
    """Write a campaign whose second record is a copy of the first: a finding."""
    runs = [run_case("LC1", duration=6.0), run_case("LC2", duration=6.0)]
    write_campaign(carrier_campaign(runs), folder)
    (folder / "LC2.csv").write_bytes((folder / "LC1.csv").read_bytes())


@pytest.mark.long
def test_quick_commands_and_refusals_print_what_the_schema_says(command, tmp_path):
    write_copied_record(tmp_path / "campaign")
    write_copied_record(tmp_path / "copied")
    public_stage().write_xml(tmp_path / "a.rexs")
    for line, code in QUICK.items():
        done = command(*line.split(), "--json")
        assert done.returncode == code, (line, done.stderr)
        document = checked(done.stdout)
        assert document["command"] == command_in(line.split())
        assert document["exit_code"] == code
        if code == 2:
            assert document["format"] == "carrierflex-refusal"
            assert done.stderr == f"carrierflex: {document['error']}\n"
        else:
            assert document["met"] is (code == 0)


def test_what_was_given_and_written_is_told(command, tmp_path):
    document = checked(command("mesh", "--size", "0.1", "--out", "a.msh", "--json").stdout)
    assert document["given"] == {"size": 0.1, "out": "a.msh"}
    assert document["written"] == ["a.msh"]


@pytest.mark.parametrize(
    "change",
    [
        {"exit_code": 3},
        {"command": "diagnoze"},
        {"result": {"n_tets": 1}},
        {"elapsed": 1.0},
        {"format": "carrierflex-refusal"},
    ],
)
def test_another_key_value_or_result_breaks_the_schema(command, change):
    document = checked(command("mesh", "--size", "0.1", "--out", "a.msh", "--json").stdout)
    assert list(VALIDATOR.iter_errors(document | change))


@pytest.mark.long
def test_every_other_command_prints_what_the_schema_says(command, tmp_path):
    write_copied_record(tmp_path / "copied")
    command("new-campaign", "--kind", "carrier", "--from", "copied/LC1.csv", "--out", "map.toml")
    lines = {**QUICK, **LONG}.keys() | {line for group in SLOW.values() for line in group}
    tried = {command_in(line.split()) for line in lines}
    assert tried | LOOKED_AT_ELSEWHERE >= set(COMMANDS), "a command is tried by no line"
    print_what_the_schema_says(command, LONG)


@pytest.mark.parametrize("name", [pytest.param(name, marks=_slow_mark(name)) for name in SLOW])
def test_a_slow_command_prints_what_the_schema_says(command, name):
    print_what_the_schema_says(command, SLOW[name])


def print_what_the_schema_says(command, lines):
    for line, code in lines.items():
        done = command(*line.split(), "--json")
        assert done.returncode == code, (line, done.stderr)
        assert checked(done.stdout)["exit_code"] == code
