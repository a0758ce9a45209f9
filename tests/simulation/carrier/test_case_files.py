import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.simulation.carrier.case_files import read_case, shipped_case
from tests.simulation.synthetic_curves import flexible_curve


def test_shipped_case_holds_the_load_cases_of_table_2():
    case = read_case(shipped_case(), flexible_curve())
    assert [run.name for run in case.runs] == ["LC1", "LC2", "LC3", "LC4"]
    assert [run.torque for run in case.runs] == [360e3, 180e3, 360e3, 360e3]
    assert [run.ntl_z for run in case.runs] == [0.0, 0.0, -200e3, 200e3]
    assert_allclose(case.runs[0].speed, 2.3143, rtol=1e-4)  # 22.1 rpm
    assert case.runs[0].duration * case.runs[0].speed / (2 * np.pi) > 22.0


def test_shipped_case_holds_the_sensors_of_the_paper():
    case = read_case(shipped_case(), flexible_curve())
    degrees = {s.name: (s.quantity, round(np.rad2deg(s.angle), 9), s.radius) for s in case.sensors}
    assert degrees["s317"] == ("axial_displacement", 317.0, 0.412)
    assert [degrees[name][1] for name in ("s047", "s137", "s227", "r040", "r310")] == [
        47,
        137,
        227,
        40,
        310,
    ]
    assert degrees["r310"][0] == "radial_displacement"


def test_deflection_is_proportional_to_torque_and_stiffens_above_half_torque():
    full, half, *_ = read_case(shipped_case(), flexible_curve()).runs
    assert_allclose(full.motion.rho_f, 42e-6 / (0.19e-6 * 360), rtol=1e-9)
    assert_allclose(half.motion.rho_f, full.motion.rho_f, rtol=1e-9)
    assert half.motion.rho_s == 0.0
    assert_allclose(full.motion.rho_s / (full.motion.rho_s + full.motion.rho_f), 0.3, rtol=1e-12)
    assert_allclose(full.motion.theta_PLC, np.deg2rad(60.0))


def test_an_unknown_shipped_case_names_those_there_are():
    with pytest.raises(
        ValueError, match="'lc9' does not come with the package; expected one of carrier_lc1_to_lc4"
    ):
        shipped_case("lc9")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("seed = 2012", "", "case.toml: missing key 'seed'; expected a whole number >= 0"),
        ("seed = 2012", "seed = 2012\ncolour = 3", "case.toml: unknown key 'colour'"),
        ("seed = 2012", "seed = 1.5", "case.toml: key 'seed' is 1.5; expected a whole number"),
        (
            "version = 1",
            "version = 2",
            "case.toml: key 'version' is 2, written by a newer version; expected 1",
        ),
        (
            '"carrierflex-case"',
            '"other"',
            "key 'format' is 'other'; expected 'carrierflex-case' for a case file",
        ),
        (
            "theta_H_deg = 90.0",
            "theta_H = 1.57",
            r"\[\[runs\]\] 1, \[motion\]: unknown key 'theta_H'",
        ),
        (
            "stiff_share = 0.3",
            "stiff_share = 1.3",
            r"1, \[motion\]: key 'stiff_share' is 1.3; .*0 <= share < 1",
        ),
        ('name = "s137"', 'name = "s047"', "case.toml: sensor name 's047' occurs twice"),
        (
            "angle_deg = 47.0",
            'angle_deg = "47"',
            r"\[\[sensors\]\] 1: key 'angle_deg' is '47'; expected a finite number",
        ),
        ("seed = 2012", "seed = ", "case.toml: not a TOML file"),
    ],
)
def test_a_wrong_case_is_refused_with_one_line(tmp_path, old, new, message):
    path = tmp_path / "case.toml"
    path.write_text(shipped_case().read_text().replace(old, new, 1))
    with pytest.raises(ValueError, match=message) as caught:
        read_case(path, flexible_curve())
    assert "\n" not in str(caught.value)


def test_a_missing_or_huge_case_is_refused(tmp_path):
    with pytest.raises(FileNotFoundError, match="no such file; expected a case file"):
        read_case(tmp_path / "none.toml", flexible_curve())
    huge = tmp_path / "huge.toml"
    huge.write_bytes(b"#" * 1_000_001)
    with pytest.raises(
        ValueError, match=r"huge\.toml: 1000001 bytes; expected a case file of at most 1000000"
    ):
        read_case(huge, flexible_curve())
