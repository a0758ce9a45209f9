"""Files of a REXS stage, and the way to a simulation and back."""

import json
import re
import shlex
import tomllib
from dataclasses import fields

import jsonschema
import numpy as np
import pytest

from carrierflex.geometry.parameter_files import read_parameters
from carrierflex.geometry.parameters import DEFAULT_SIZE
from carrierflex.reduction.mode_count import DEFAULT_FREQUENCY
from carrierflex.simulation.carrier.case_files import shipped_case
from carrierflex.simulation.rexs.rexs_files import read_rexs
from carrierflex.simulation.stage.stage_cases import read_stage_case
from carrierflex.workflows.outputs import schema_file
from carrierflex.workflows.simulation.copy_cases import main as cases
from carrierflex.workflows.simulation.rexs_case import CASE, PARAMETERS, SOURCES
from carrierflex.workflows.simulation.simulate_load_case import main as simulate
from tests.simulation.rexs.public_sample import public_stage, shipped_gearbox

SHIPPED = shipped_case("stage_lc1")
FORMS = {"a.rexs": "write_xml", "a.rexsj": "write_json", "a.rexsz": "write_archive"}


def texts(folder):
    """Both TOML files without the name of their source."""
    return [
        re.sub(r"a\.rexs[jz]?", "SOURCE", (folder / name).read_text(encoding="utf-8"))
        for name in (PARAMETERS, CASE)
    ]


@pytest.mark.parametrize("make", [public_stage, shipped_gearbox])
def test_the_three_forms_give_the_same_files(make, tmp_path):
    written = []
    for name, write in FORMS.items():
        folder = tmp_path / write
        cases(rexs=getattr(make(), write)(tmp_path / name), out=folder)
        written.append(texts(folder))
    assert written[0] == written[1] == written[2]


@pytest.mark.parametrize("make", [public_stage, shipped_gearbox])
def test_both_files_are_read_and_every_number_states_where_it_comes_from(make, tmp_path):
    made = cases(rexs=make().write_xml(tmp_path / "a.rexs"), out=tmp_path / "stage")
    assert not made.problems
    stage, case = read_parameters(made.folder / PARAMETERS), read_stage_case(made.folder / CASE)
    for entry in fields(stage.gear):
        assert getattr(stage.gear, entry.name) == getattr(case.data.gear, entry.name)
    assert case.rig["sensor_radius"] == stage.carrier.sensor_radius
    for name in (PARAMETERS, CASE):
        text = (made.folder / name).read_text(encoding="utf-8")
        for line in text.splitlines():
            if re.match(r"\w+ = -?[\d.]", line) and not line.startswith(("angle_deg", "version")):
                assert re.search(r"  # \S|  +# \S", line), line
    # The list of what the file lacks holds every default of the files, and nothing else.
    document = json.loads((made.folder / SOURCES).read_text(encoding="utf-8"))
    schema = json.loads(schema_file("rexs").read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator(schema).validate(document)
    values = document["result"]["values"]
    tables = [tomllib.loads((made.folder / name).read_text()) for name in (PARAMETERS, CASE)]
    for value in values:
        owners = [t for t in tables if value["table"] in ("", *t)]
        numbers = [(t[value["table"]] if value["table"] else t).get(value["key"]) for t in owners]
        assert value["number"] in numbers, value
        assert value["source"]
        if value["how"] == "file":
            assert not value["source"].startswith("default")
    assert {value["how"] for value in values} == {"file", "derived", "default"}


def test_the_lines_to_run_next_are_those_of_the_program(tmp_path):
    """Sizes and frequencies go with the ratio of the centre distances, 78 to 308 mm."""
    source = public_stage().write_xml(tmp_path / "a b.rexs")
    *reductions, last = cases(rexs=source, out=tmp_path / "a stage").commands
    words = [shlex.split(line) for line in reductions]
    assert [line[3] for line in words] == ["carrier", "pin", "main_shaft"]
    for line in words:
        options = dict(zip(line[2::2], line[3::2], strict=True))
        assert options["--parameters"] == str(tmp_path / "a stage" / PARAMETERS)
        assert float(options["--size"]) == pytest.approx(DEFAULT_SIZE * 78 / 308, rel=0.05)
        assert float(options["--up-to"]) == pytest.approx(DEFAULT_FREQUENCY * 308 / 78, rel=0.05)
    assert shlex.split(last)[2] == str(tmp_path / "a stage" / CASE)
    assert shlex.split(last)[-2:] == ["--rexs", str(source)]


def test_dimensions_that_do_not_fit_are_told_and_written(tmp_path):
    model = public_stage()
    model.attribute(265, "outer_diameter_begin")["value"] = 90.0
    made = cases(rexs=model.write_xml(tmp_path / "a.rexs"), out=tmp_path / "stage")
    assert "pin_hole_diameter is 0.09 m" in made.problems[0]
    assert "\n" not in made.problems[0]
    assert (made.folder / PARAMETERS).is_file()


def test_names_of_the_file_stay_on_their_line(tmp_path):
    model = public_stage()
    model.head["applicationVersion"] = 'x\n[rig]\nn_planets = 5 # "'
    next(e for e in model.components if e["id"] == 9)["name"] = 'a"\\\n[mesh]\x1b'
    made = cases(rexs=model.write_json(tmp_path / "a.rexsj"), out=tmp_path / "stage")
    assert read_stage_case(made.folder / CASE).name == 'a"\\ [mesh]\\x1b'


def test_what_the_command_refuses(tmp_path):
    source = public_stage().write_xml(tmp_path / "a.rexs")
    for options, words in (
        ({"rexs": source}, "expected --out FOLDER"),
        ({"stage": 9}, "without a REXS file"),
        ({"rexs": tmp_path / "b.rexs", "out": tmp_path / "s"}, "no such file"),
    ):
        with pytest.raises((ValueError, FileNotFoundError), match=words):
            cases(**options)
    assert not (tmp_path / "s").exists()
    cases(rexs=source, out=tmp_path / "stage")
    with pytest.raises(ValueError, match="exists already"):
        cases(rexs=source, out=tmp_path / "stage")


def test_results_need_loads_and_a_file_of_these_gears(tmp_path):
    source = public_stage().write_xml(tmp_path / "a.rexs")
    with pytest.raises(ValueError, match="expected --loads FOLDER too"):
        simulate(SHIPPED, out=tmp_path / "c", rexs=source)
    with pytest.raises(ValueError, match="teeth 61/22/17; expected one with 99/39/21"):
        simulate(SHIPPED, out=tmp_path / "c", loads=tmp_path / "loads", rexs=source)
    inside = shipped_gearbox().write_xml(tmp_path / "b.rexs")
    with pytest.raises(ValueError, match="in the folder of --loads"):
        simulate(SHIPPED, out=tmp_path / "c", loads=tmp_path, rexs=inside)


@pytest.mark.long
def test_a_gearbox_goes_in_runs_and_comes_back(tmp_path):
    """The shipped gearbox in REXS: its run carries the torque, and the copy states it."""
    source = shipped_gearbox().write_archive(tmp_path / "gearbox.rexsz")
    made = cases(rexs=source, out=tmp_path / "stage")
    text = (made.folder / CASE).read_text(encoding="utf-8")
    # Bodies of the shipped gearbox, whose dimensions these are; a run of half a second.
    text = re.sub(r"\[bodies\](.*\n){4}", "", text)
    text = re.sub(r"\nduration = .*", "\nduration = 0.5", text)
    (made.folder / "short.toml").write_text(text, encoding="utf-8")
    simulate(
        made.folder / "short.toml",
        out=tmp_path / "campaign",
        loads=tmp_path / "loads",
        rexs=source,
        quiet=True,
    )
    back = read_rexs(tmp_path / "loads" / "gearbox.rexsz")
    assert [case.id for case in back.load_cases] == [1, 2, 3, 4]
    for case, torque in zip(back.load_cases[2:], (360e3, 180e3), strict=True):

        def number(component, attribute, case=case):
            return back.number(back.components[component], attribute, case)

        assert number(40, "torque_around_u_axis") == pytest.approx(torque, rel=1e-3)
        # Across each pin T / (3 a), of two bearings; the weight of a planet is 0.5 % of it.
        for planet in range(3):
            forces = [
                np.array([number(b, f"force_acting_on_inner_component_{axis}") for axis in "uvw"])
                for b in (90 + planet, 95 + planet)
            ]
            across = np.linalg.norm(sum(forces)[1:])
            assert across == pytest.approx(torque / 3.0 / 0.308, rel=0.03)
        # At the sun T_sun / 3 over the reference radius, of 21 teeth of 10 mm and 7.5 deg.
        radius = 0.5 * 21 * 0.010 / np.cos(np.radians(7.5))
        tangential = torque / (1.0 + 99 / 21) / 3.0 / radius
        force = number(100, "nominal_tangential_force_at_reference_circle")
        assert force == pytest.approx(tangential, rel=0.03)
        assert number(10, "rotational_speed") == pytest.approx(22.1 * np.pi / 30.0, rel=0.01)
        assert 1.0 <= number(100, "mesh_load_factor_iso_6336_2019") < 1.2
    lives = [
        back.number(back.components[90], "nominal_rating_life_time_iso_281_2007", case)
        for case in back.load_cases[2:]
    ]
    # Half the torque: some 2^(10/3) times the life.
    assert lives[1] / lives[0] == pytest.approx(2.0 ** (10.0 / 3.0), rel=0.05)
