import re

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.fe.curve_files import read_curves, write_curves
from tests.simulation.synthetic_curves import curve_set

HEADER = "theta_deg,delta_s,delta_f,g_s,g_f"


def rows(n=8, **changed):
    cells = [[f"{360.0 * k / n}", "0", "0", "0", "0"] for k in range(n)]
    for where, text in changed.items():
        row, column = map(int, where[1:].split("_"))
        cells[row][column] = text
    return "\n".join(",".join(row) for row in cells)


def test_curves_come_back_to_twelve_digits(tmp_path):
    curves = curve_set()
    write_curves(tmp_path / "curves.csv", curves)
    result = read_curves(tmp_path / "curves.csv", radius=0.412)
    assert set(result) == set(curves)
    for name, curve in curves.items():
        # Twelve significant digits are written.
        assert_allclose(result[name].axial, curve.axial, rtol=1e-11, err_msg=name)
        assert_allclose(result[name].radial, curve.radial, rtol=1e-11, err_msg=name)
        assert (result[name].name, result[name].unit_load, result[name].radius) == (
            name,
            curve.unit_load,
            0.412,
        )


def test_finite_element_curves_come_back(tmp_path, flexible_deflection, stiff_deflection):
    curves = {
        "delta_s": stiff_deflection.curves["both"],
        "delta_f": flexible_deflection.curves["both"],
    }
    curves |= {"g_s": stiff_deflection.curves["pin_1"], "g_f": flexible_deflection.curves["pin_1"]}
    write_curves(tmp_path / "curves.csv", curves)
    assert (tmp_path / "curves.csv").read_text().startswith(f"{HEADER},delta_s_radial,")
    assert_allclose(
        read_curves(tmp_path / "curves.csv")["g_f"].axial, curves["g_f"].axial, rtol=1e-11
    )


def test_absent_radial_columns_count_as_zero(tmp_path):
    path = tmp_path / "curves.csv"
    path.write_text(f"{HEADER}\n{rows(c3_2='1e-7')}\n")
    result = read_curves(path, radius=0.4)["delta_f"]
    assert result.axial[3] == 1e-7
    assert not result.radial.any()
    assert result.radius == 0.4


REFUSED = [
    (f"{HEADER},rho\n", "no rows", r"0 rows of numbers; expected at least eight angles"),
    ("", "empty file", r"0 rows of numbers"),
    (f"{HEADER}\n{rows(7)}", "too few", r"7 rows of numbers"),
    (
        f"{HEADER},delta_x\n{rows().replace(chr(10), ',0' + chr(10))},0",
        "unknown",
        r"unknown column 'delta_x'",
    ),
    (
        f"theta_deg,delta_s,delta_f,g_s,g_s_radial\n{rows()}",
        "missing",
        r"no column 'g_f'; expected theta_deg, delta_s",
    ),
    (
        f"theta_deg,delta_s,delta_f,g_s,g_f,g_f\n{rows().replace(chr(10), ',0' + chr(10))},0",
        "twice",
        r"'g_f'",
    ),
    (f"{HEADER}\n{rows(c2_1='x')}", "text", r"line 4 holds 'x'; expected a finite number"),
    (f"{HEADER}\n{rows(c2_1='nan')}", "nan", r"line 4 holds 'nan'; expected a finite number"),
    (f"{HEADER}\n{rows(c2_1='')}", "empty cell", r"line 4 holds ''"),
    (f"{HEADER}\n{rows()}\n0,0\n", "short line", r"line 10 has 2 cells; expected 5"),
    (
        f"{HEADER}\n{rows(c1_0='46')}",
        "steps",
        r"theta_deg is not one turn in equal steps from 0; expected 0, 45, ...",
    ),
    (f"{HEADER}\n{rows(c0_0='360')}", "start", r"theta_deg is not one turn in equal steps from 0"),
]


@pytest.mark.parametrize(
    ("text", "_kind", "message"), REFUSED, ids=[kind for _, kind, _ in REFUSED]
)
def test_a_wrong_curve_file_is_refused_by_name(tmp_path, text, _kind, message):
    path = tmp_path / "curves.csv"
    path.write_text(text)
    with pytest.raises(ValueError, match=rf"curves\.csv: .*{message}"):
        read_curves(path)


@pytest.mark.parametrize(
    "content",
    [b"\xff\xfe\x00theta", b'"' + b"1" * 200_000 + b'"\n'],
    ids=["binary", "one huge cell"],
)
def test_a_file_that_is_no_csv_is_refused_by_name(tmp_path, content):
    path = tmp_path / "curves.csv"
    path.write_bytes(content)
    with pytest.raises(ValueError, match=r"curves\.csv"):
        read_curves(path)


def test_a_file_too_long_for_one_turn_is_refused(tmp_path):
    path = tmp_path / "curves.csv"
    path.write_text(HEADER + "\n" + "0,0,0,0,0\n" * 100_001)
    with pytest.raises(ValueError, match="more than 100000 rows; expected one turn"):
        read_curves(path)


def test_curves_of_different_length_are_refused_and_nothing_is_written(tmp_path):
    curves = curve_set()
    short = type(curves["g_f"])("g_f", 0.412, 1.0, np.zeros(8), np.zeros(8))
    with pytest.raises(
        ValueError, match=re.escape("deflection curves have [8, 360] samples; expected one length")
    ):
        write_curves(tmp_path / "curves.csv", curves | {"g_f": short})
    assert list(tmp_path.iterdir()) == []


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch):
    path = tmp_path / "curves.csv"
    path.write_text("theta_deg old")

    def fail(*_):
        raise OSError("disk full")

    with monkeypatch.context() as patch:
        patch.setattr("os.replace", fail)
        with pytest.raises(OSError, match="disk full"):
            write_curves(path, curve_set())
    assert [(file.name, file.read_text()) for file in tmp_path.iterdir()] == [
        ("curves.csv", "theta_deg old")
    ]
