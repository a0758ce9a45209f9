"""Names and sizes in files are data: no markup, no formula, no command, no memory."""

import os
import re

import pytest

from carrierflex.identification.campaign.campaign_files import write_campaign
from carrierflex.simulation.carrier.case_files import shipped_case
from tests.identification.synthetic_campaigns import carrier_campaign

NAMES = ["[x]", "[bold]r", "<script>", "$x_{$"]


def is_progress(line):
    return re.match(r"\[\d+/\d+\] .* s$", line) is not None


def one_line(result, code=2):
    assert result.returncode == code, result.stderr
    lines = [line for line in result.stderr.splitlines() if not is_progress(line)]
    assert len(lines) == 1, result.stderr
    assert len(lines[0]) < 2200
    return lines[0]


def changed(tmp_path, case, *changes):
    text = shipped_case(case).read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    (tmp_path / "case.toml").write_text(text)
    return tmp_path / "case.toml"


@pytest.mark.long
@pytest.mark.parametrize("name", NAMES)
def test_names_are_shown_drawn_and_written_as_they_are(tmp_path, command, name):
    case = changed(
        tmp_path, "carrier_lc1_to_lc4", ('name = "LC1"', f'name = "{name}"'), ("s047", f"s{name}")
    )
    folder = f"c{name}"
    result = command("simulate", case, "--out", folder)
    assert result.returncode == 0, result.stderr
    assert all(is_progress(line) for line in result.stderr.splitlines())
    assert f" {name}" in result.stdout or f"\n{name}" in result.stdout
    result = command("identify", folder, "--model", "m1", "--out", f"i{name}")
    assert result.returncode == 0, result.stderr
    assert (tmp_path / f"i{name}" / f"signals_{name}.png").is_file()


@pytest.mark.parametrize("name", ["[/x]", "a/b", "..", "\\u001b]0;x", "a\\nb", ".x"])
def test_names_that_no_file_has_are_refused_before_the_work(tmp_path, command, name):
    case = changed(tmp_path, "carrier_lc1_to_lc4", ('name = "LC1"', f'name = "{name}"'))
    line = one_line(command("simulate", case, "--out", "out"))
    assert "case.toml: [[runs]] 1: key 'name' is " in line
    assert line.isprintable() or line[:-1].isprintable()


@pytest.mark.parametrize(
    ("case", "old", "new", "message"),
    [
        ("carrier_lc1_to_lc4", "duration = ", "duration = 1e12 #", "'duration [s]' 1e+12"),
        ("carrier_lc1_to_lc4", "duration = ", "duration = 6e5 #", "'sample_rate_hz [1/s]'"),
        ("mounting_2011", "sample_rate = ", "sample_rate = 1e9 #", "'sample_rate [1/s]' 1e+09"),
        ("stage_lc1", "duration = ", "duration = 1e12 #", "'duration [s]' 1e+12"),
    ],
)
def test_sizes_that_follow_from_a_case_are_told(tmp_path, command, case, old, new, message):
    path = changed(tmp_path, case, (old, new))
    line = one_line(command("simulate", path, "--out", "out"))
    assert f"{path}: keys " in line
    assert message in line
    assert "GB); expected at most" in line


def test_whole_numbers_beyond_64_bits_are_one_line(tmp_path, command):
    number = "1" + "0" * 30
    path = changed(tmp_path, "carrier_lc1_to_lc4", ("theta_H_deg = ", f"theta_H_deg = {number} #"))
    line = one_line(command("simulate", path, "--out", "out"))
    assert "case.toml: key 'runs.motion.theta_H_deg' is 1000" in line


def test_curves_that_are_a_pipe_are_refused(tmp_path, command):
    os.mkfifo(tmp_path / "curves.csv")
    line = one_line(command("simulate", shipped_case(), "--curves", "curves.csv", "--out", "out"))
    assert "curves.csv: a device or a pipe; expected a CSV file of deflection curves" in line


def test_a_refusal_in_the_middle_of_the_work_names_its_input(tmp_path, command, monkeypatch):
    write_campaign(carrier_campaign(), tmp_path / "c")

    def singular(*arguments, **options):
        from numpy.linalg import LinAlgError

        raise LinAlgError("SVD did not converge")

    monkeypatch.setattr("carrierflex.workflows.diagnosis.examination.problem_of", singular)
    line = one_line(command("diagnose", "c", "--out", "out"))
    assert line.startswith("carrierflex: c: its numbers leave no equations that can be solved")
    assert "SVD" not in line
