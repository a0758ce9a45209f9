import pytest

from carrierflex.geometry.parameter_files import StageParameters, read_parameters
from carrierflex.geometry.parameters import CarrierParameters, GearData

REFUSED = [
    ("[carrier\n", r"not a TOML file: Expected ']' .*line 1, column 9"),
    ("[caRrier]\nouter_radius = 0.44\n", r"unknown key 'caRrier'; did you mean 'carrier'\?"),
    (
        "outer_radius = 0.44\n",
        r"unknown key 'outer_radius'; expected one of carrier, pin, gear, main_shaft",
    ),
    (
        "[carrier]\nouter_diameter = 0.88\n",
        r"\[carrier\]: unknown key 'outer_diameter'; did you mean 'hub_outer_diameter'\?",
    ),
    (
        "[carrier]\nouter_radius = '0.44'\n",
        r"\[carrier\]: key 'outer_radius' is '0.44'; expected a positive number",
    ),
    ("[pin]\ndiameter = true\n", r"\[pin\]: key 'diameter' is true; expected a positive number"),
    (
        "[carrier]\nouter_radius = nan\n",
        r"\[carrier\]: key 'outer_radius' is nan; expected a positive number",
    ),
    ("[gear]\nring_teeth = 98\n", r"\[gear\] ring_teeth is 98; expected"),
    (
        "[pin]\ndiameter = 0.15\n",
        r"\[pin\] diameter is 0.15 m; expected the carrier's pin_hole_diameter 0.16",
    ),
    (
        "[gear]\ncentre_distance = 0.3\n",
        r"\[gear\] centre_distance is 0.3 m; expected the carrier's centre_distance 0.308",
    ),
]


@pytest.mark.parametrize(("text", "message"), REFUSED)
def test_a_wrong_parameter_file_is_refused_by_name(tmp_path, text, message):
    path = tmp_path / "stage.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match=rf"stage\.toml.*{message}"):
        read_parameters(path)


def test_a_binary_file_is_refused_by_name(tmp_path):
    path = tmp_path / "stage.toml"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ValueError, match=r"stage\.toml: not a TOML file"):
        read_parameters(path)


def test_a_file_too_large_for_parameters_is_refused_unread(tmp_path):
    path = tmp_path / "stage.toml"
    path.write_text("#" * 100_001, encoding="utf-8")
    with pytest.raises(
        ValueError,
        match=r"stage\.toml: 100001 bytes; expected a parameter file of at most 100000 bytes",
    ):
        read_parameters(path)


def test_a_missing_parameter_file_is_named(tmp_path):
    with pytest.raises(
        FileNotFoundError,
        match=r"absent\.toml: no such file; expected a parameter file \(TOML with tables",
    ):
        read_parameters(tmp_path / "absent.toml")


def test_no_file_gives_the_defaults():
    assert read_parameters(None) == StageParameters(CarrierParameters())


def test_given_keys_replace_defaults_and_the_others_stay(tmp_path):
    path = tmp_path / "stage.toml"
    path.write_text("[carrier]\nplate_gap = 0.25\n[gear]\nring_teeth = 99\n", encoding="utf-8")
    assert read_parameters(path) == StageParameters(
        CarrierParameters(plate_gap=0.25), gear=GearData()
    )
