"""`carrierflex simulate` on a mounting case from the shell.

A run that stops keeps what it has; bad input writes nothing.
"""

import csv
import os
import subprocess
import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.identification.campaign.campaign_files import read_campaign
from carrierflex.simulation.carrier.case_files import shipped_case
from carrierflex.simulation.mounting.case_files import read_mounting_case
from carrierflex.simulation.mounting.history_inputs import history_inputs
from carrierflex.simulation.mounting.linearised import frequency_response, mounting_modes
from carrierflex.simulation.mounting.simulate import simulate
from carrierflex.workflows.simulation.simulate_load_case import main
from tests.workflows.checked_documents import checked_document

COMMAND = [sys.executable, "-m", "carrierflex.workflows.command_line"]

#: A true Ctrl-C at a known instant: the signal comes after the third piece of the run.
INTERRUPTED = """
import os, signal, sys
from carrierflex.simulation.mounting import simulate
from carrierflex.workflows.simulation import simulate_mounting

def watched(*arguments, **options):
    for number, piece in enumerate(simulate.signal_pieces(*arguments, **options)):
        yield piece
        if number == 3:
            os.kill(os.getpid(), signal.SIGINT)

simulate_mounting.signal_pieces = watched
sys.argv = ["carrierflex", *sys.argv[1:]]
from carrierflex.workflows.command_line import main
main()
"""


def run(command, folder):
    environment = {**os.environ, "COLUMNS": "200"}
    return subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, check=False
    )


def changed_case(folder, *changes):
    text = shipped_case("mounting_2011").read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    path = folder / "case.toml"
    path.write_text(text)
    return path


def one_line(result, code):
    assert result.returncode == code, result.stderr
    *_, line = result.stderr.strip().splitlines()
    assert line.startswith("carrierflex: ")
    return line


#: A linear bushing far too soft for its torque: the roll passes 0.3 rad while the torque rises.
SOFT = [
    ("K1 = 17.6e6", "K1 = 1.0e5"),
    *(
        (f"{name} = {value}", f"{name} = 0.0")
        for name, value in (("K3", "65.05e9"), ("K5", "1.55e15"), ("C3", "1.15e6"))
    ),
]


def test_a_diverging_run_tells_time_and_coordinate_and_keeps_its_record(tmp_path, command):
    case = changed_case(tmp_path, *SOFT)
    line = one_line(command("simulate", case, "--out", "out", "--linearised", "lin"), 2)
    assert line.startswith(f"carrierflex: {case}: theta_x: diverged after 5")
    assert line.endswith("s; the signals up to there are kept")
    last_time = float(line.split("after ")[1].split(" s")[0])
    assert 535.0 < last_time < 555.0  # while the torque rises
    (written_run,) = read_campaign(tmp_path / "out").runs
    assert_allclose(written_run.time[-1], last_time, rtol=1e-5)
    assert written_run.condition == f"figure 6, cut at {written_run.time[-1]:g} s: theta_x diverged"
    # The record is that of the run that would have gone on: all six sensors, zeroed, with the noise
    # of the case.
    what = read_mounting_case(case)
    inputs = history_inputs(what.runs[0].history).shortened(len(written_run.time))
    full = simulate(what.rig, what.truth, inputs).by_sensor()
    for name, signal in written_run.signals.items():
        assert_allclose(np.std(signal - full[name]), 2e-6, rtol=0.03)
    assert np.ptp(full["spy"]) > 1e-3  # the other block has come as far
    assert sorted(path.name for path in tmp_path.iterdir()) == ["case.toml", "out"]


@pytest.mark.long
def test_an_interrupted_run_keeps_its_record(tmp_path):
    case = changed_case(tmp_path)
    line = one_line(
        run([sys.executable, "-c", INTERRUPTED, "simulate", case, "--out", "out"], tmp_path), 130
    )
    assert "interrupted" in line
    (written_run,) = read_campaign(tmp_path / "out").runs
    assert written_run.time.size == 3 * 2000 + 1
    assert written_run.condition == "figure 6, cut at 300 s: interrupted"
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        "campaign.toml",
        "case.toml",
        "load_case.csv",
    ]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ([("torque = 80e3", "torque = nan")], r"key 'torque' is nan; expected a finite number"),
        ([("torque = 80e3", "torque = inf")], r"key 'torque' is inf; expected a finite number"),
        ([("ntl_z = -100e3", "ntl_z = -inf")], r"key 'ntl_z' is -inf; expected a finite number"),
        (
            [("K1 = 17.6e6", "K1 = -17.6e6")],
            "[truth]: key 'K1' is -17600000.0; expected a value from 100000 to 1e+09 N/m",
        ),
        (
            [("bushing_radial_stiffness = 20.2e6", "bushing_radial_stiffness = -1.0")],
            "[rig]: key 'bushing_radial_stiffness' is -1.0; expected a positive number",
        ),
        (
            [("K5 = 1.55e15", "K5 = 1.55e15\nk = -1.0")],
            "[truth]: key 'k' is -1.0; expected a value from 0 to 1e+09 N/m",
        ),
        # Hard bushings under a large torque, and steps of a whole sample: half a wave does not fit.
        (
            [("seed", "step = 0.05\nseed"), ("torque = 80e3", "torque = 360e3")],
            "step 0.05 s is too large",
        ),
        ([("seed", "step = -0.001\nseed")], "key 'step' is -0.001; expected a positive number"),
        (
            [("sample_rate = 20.0", "sample_rate = 0.001")],
            "duration 655.0 s, sample_rate 0.001 1/s",
        ),
    ],
)
def test_bad_input_is_told_in_one_line_and_leaves_nothing(tmp_path, command, changes, message):
    case = changed_case(tmp_path, *changes)
    result = command("simulate", case, "--out", "out", "--linearised", "lin")
    assert message in one_line(result, 2)
    assert result.stdout == ""
    assert [path.name for path in tmp_path.iterdir()] == ["case.toml"]


@pytest.mark.long
def test_a_torque_that_is_not_finite_is_refused_by_the_shell(tmp_path):
    case = changed_case(tmp_path, ("torque = 80e3", "torque = nan"))
    line = one_line(run([*COMMAND, "simulate", case, "--out", "out"], tmp_path), 2)
    assert "key 'torque' is nan; expected a finite number" in line
    assert [path.name for path in tmp_path.iterdir()] == ["case.toml"]


def test_a_bushing_that_gives_way_ends_the_run_with_what_it_has(tmp_path, command):
    # Beyond 3.4 mm this law pushes outward, and the radial load goes further.
    case = changed_case(tmp_path, ("K3 = 65.05e9", "K3 = -5e11"), ("K5 = 1.55e15", "K5 = 0.0"))
    line = one_line(command("simulate", case, "--out", "out"), 2)
    assert line.startswith(
        f"carrierflex: {case}: theta_x, theta_y: the bushing forces did not converge after 9"
    )
    (written_run,) = read_campaign(tmp_path / "out").runs
    assert 90.0 < written_run.time[-1] < 105.0
    assert written_run.condition.endswith("theta_x diverged")


@pytest.mark.long
def test_linearised_files_hold_what_the_model_gives(tmp_path):
    case = shipped_case("mounting_2011")
    what = main(case, out=tmp_path / "out", linearised=tmp_path / "lin", quiet=True).case
    names = ["campbell.csv", "frequency_response.csv", "linearised.png", "modes.csv"]
    files = sorted(path.name for path in (tmp_path / "lin").iterdir())
    assert files == ["linearised.json", *(f"load_case_{name}" for name in names)]
    point = checked_document(tmp_path / "lin" / "linearised.json")["operating_points"]["load_case"]
    loads = np.array([point["torque"], point["ntl_y"], point["ntl_z"]])
    assert_allclose(loads, [81.6e3, 30.6e3, -102e3], rtol=1e-4)
    with (tmp_path / "lin" / "load_case_modes.csv").open() as file:
        rows = list(csv.DictReader(file))
    modes = mounting_modes(what.rig, what.truth, loads)
    assert_allclose(
        [float(row["frequency_hz"]) for row in rows[-3:]], modes.frequency_hz, rtol=1e-7
    )
    assert [row["leading_coordinate"] for row in rows[-3:]] == list(modes.leading_coordinates())
    with (tmp_path / "lin" / "load_case_frequency_response.csv").open() as file:
        row = list(csv.DictReader(file))[100]
    expected = frequency_response(
        what.rig, what.truth, loads, np.array([float(row["frequency_hz"])])
    )[0]
    assert_allclose(float(row["spz_per_ntl_z_im [m/N]"]), expected[3, 2].imag, rtol=1e-6)
    assert_allclose(float(row["ssz_per_torque_re [m/(N m)]"]), expected[2, 0].real, rtol=1e-6)
    with (tmp_path / "lin" / "load_case_campbell.csv").open() as file:
        row = list(csv.DictReader(file))[-1]
    assert_allclose(float(row["speed [rad/s]"]), 1.2 * 2.3143)
    assert_allclose([float(row[f"mode_{n}_hz"]) for n in (1, 2, 3)], modes.frequency_hz, rtol=1e-5)


def test_a_folder_of_something_else_is_refused_before_the_run(tmp_path, monkeypatch):
    (tmp_path / "notes").mkdir()
    (tmp_path / "notes" / "mine.txt").write_text("keep")
    monkeypatch.setattr(
        "carrierflex.workflows.simulation.simulate_mounting.signal_pieces", None
    )  # it must not come so far
    with pytest.raises(ValueError, match="holds something that is not a campaign"):
        main(shipped_case("mounting_2011"), out=tmp_path / "notes", quiet=True)
    assert [path.name for path in (tmp_path / "notes").iterdir()] == ["mine.txt"]


def test_only_mountings_and_stages_are_linearised(tmp_path):
    with pytest.raises(
        ValueError,
        match=r"--linearised is for mountings and stages; carrier_lc1_to_lc4\.toml is neither",
    ):
        main(shipped_case("carrier_lc1_to_lc4"), out=tmp_path / "out", linearised=tmp_path / "lin")
    assert not any(tmp_path.iterdir())
