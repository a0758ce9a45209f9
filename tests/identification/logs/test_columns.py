"""One column of a logger: unit, angle, dropouts; and the map that says what it is."""

import re

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.files.problems import problems_of
from carrierflex.identification.campaign.campaign_files import read_campaign
from carrierflex.identification.campaign.campaign_kinds import campaign_kind
from carrierflex.identification.logs.angles import angle_of_pulses, unwrapped_angle
from carrierflex.identification.logs.log_files import read_log
from carrierflex.identification.logs.logged_signals import contract_unit, marked, stuck, zeroed
from carrierflex.identification.logs.logged_units import factor_to, unit_behind
from carrierflex.identification.logs.map_guesses import map_guess
from carrierflex.workflows.identification.import_records import main as import_records
from carrierflex.workflows.identification.new_campaign import main as new_campaign

TIME = np.arange(0.0, 60.0, 0.05)
ANGLE = 2.3 * TIME + 0.02 * np.sin(TIME)


@pytest.mark.parametrize(
    ("unit", "expected", "factor"),
    [
        ("µm", "m", 1e-6),
        ("mils", "m", 2.54e-5),
        ("kNm", "N m", 1e3),
        ("Nm", "N m", 1.0),  # pint's own Nm counts yarn
        ("ft-lb", "N m", 1.3558179483),
        ("kip", "N", 4448.2216152605),
        ("°", "rad", np.pi / 180.0),
        ("U/min", "rad/s", np.pi / 30.0),
        ("1/min", "rad/s", np.pi / 30.0),
        ("g", "m/s^2", 9.80665),
    ],
)
def test_units_of_loggers(unit, expected, factor):
    assert_allclose(factor_to(unit, expected), factor, rtol=1e-9)


@pytest.mark.parametrize(
    ("unit", "expected", "words"),
    [
        ("Hz", "rad/s", "turns or radians; expected rpm or rad/s"),
        ("kN", "m", r"measures .*; expected one of the kind of m"),
        ("wibble", "m", "is not known"),
        ("1 + __import__('os')", "m", "is not known"),
    ],
)
def test_units_of_something_else_are_refused(unit, expected, words):
    with pytest.raises(ValueError, match=words):
        factor_to(unit, expected)


def test_the_unit_behind_a_name():
    names = ("Weg [µm]", "Torque (kN m)", "Zeit in ms", "Force/kN", "disp_um", "s_047", "F_y")
    assert [unit_behind(name) for name in names] == ["µm", "kN m", "ms", "kN", "um", "", ""]


@pytest.mark.parametrize("name", ["load (1)", "pos [2]", "Force/3"])
def test_a_number_behind_a_name_is_a_channel_and_no_unit(name):
    assert unit_behind(name) == ""


def guessed_input(folder, header):
    (folder / "log.csv").write_text(
        header + "\n" + "".join(f"{0.01 * i:.2f},{i % 7},{i % 5},{i % 3}\n" for i in range(50))
    )
    guess = map_guess("element", [folder / "log.csv"], "displacement")
    return guess.inputs["displacement"].column


@pytest.mark.parametrize(
    "names", ["x-force,y-force,z-force", "Fx,u velocity,s rate", "y load,b,c", "u,F,c"]
)
def test_a_letter_within_a_name_makes_no_displacement_of_it(names, tmp_path):
    assert guessed_input(tmp_path, f"time,{names}") == "?"


@pytest.mark.parametrize("name", ["x", "x 1", "s2", "y [mm]", "x-displacement", "pos (1)"])
def test_a_letter_alone_and_words_are_displacements(name, tmp_path):
    assert guessed_input(tmp_path, f"time,{name},force,c") == name


@pytest.mark.parametrize(
    ("names", "column"),
    [("target pos (1),pos (1),load", "pos (1)"), ("Weg Soll [mm],Weg [mm],F", "Weg [mm]")],
)
def test_a_set_point_gives_way_to_the_signal_that_follows_it(names, column, tmp_path):
    assert guessed_input(tmp_path, f"time,{names}") == column


def one_column(folder, name, values):
    (folder / name).write_text("".join(f"{value:.6f}\n" for value in values))
    return folder / name


@pytest.mark.parametrize("n_runs", [1, 2])
@pytest.mark.parametrize(
    "names", [("displacement{}_mm.txt", "load{}_kN.txt"), ("Kraft{}_N.csv", "Weg{}_um.csv")]
)
def test_files_of_one_column_each_are_parts_of_a_run(names, n_runs, tmp_path):
    t = np.arange(0.0, 10.0, 0.02)
    numbers = ["", "_2"][:n_runs]
    files = [
        one_column(tmp_path, name.format(number), size * np.sin(t + phase))
        for phase, number in enumerate(numbers)
        for name, size in zip(names, (2.0, 5.0), strict=True)
    ]
    guess = map_guess("element", files, "displacement")
    assert [run.files for run in guess.runs] == [
        tuple(name.format(number) for name in names) for number in numbers
    ]
    (_, channel, _), given = guess.channels[0], guess.inputs["displacement"]
    roles = {"displacement": given, "force": channel}
    first = 1 if "Kraft" in names[0] else 0
    assert given.column == f"file {first + 1}: column 1"
    assert channel.column == f"file {2 - first}: column 1"
    assert {role: guess.unit for role, guess in roles.items()} in (
        {"displacement": "mm", "force": "kN"}, {"displacement": "um", "force": "N"},
    )  # fmt: skip
    new_campaign(kind="element", drive="displacement", from_=files, out=tmp_path / "map.toml")
    text = (tmp_path / "map.toml").read_text()
    text = re.sub(r"(?m)^\[time\][^\[]*", '[time]\nunit = "s"\nrate_hz = 50.0\n', text)
    text = text.replace('"?"', '"loop"')
    ambiguous = text.replace('column = "file 1: column 1"', 'column = "column 1"')
    (tmp_path / "ambiguous.toml").write_text(ambiguous)
    with pytest.raises(ValueError, match=r"'column 1' stands in several of .*'file 2: column 1'"):
        import_records(files, map_=tmp_path / "ambiguous.toml", out=tmp_path / "none")
    (tmp_path / "map.toml").write_text(text)
    import_records(files, map_=tmp_path / "map.toml", out=tmp_path / "campaign")
    run = read_campaign(tmp_path / "campaign").runs[0]
    factors = (1e-3, 1e3) if first == 0 else (1e-6, 1.0)
    sizes = (2.0, 5.0) if first == 0 else (5.0, 2.0)
    for signal, factor, size in zip(
        ("displacement", "measured_force"), factors, sizes, strict=True
    ):
        assert_allclose(
            {**run.inputs, **run.signals}[signal], factor * size * np.sin(t), atol=2e-6 * factor
        )


def test_runs_of_one_column_stay_runs(tmp_path):
    files = [one_column(tmp_path, f"force_{n}.txt", np.sin(np.arange(50.0) + n)) for n in (1, 2)]
    assert len(map_guess("element", files, "free_decay").runs) == 2


@pytest.mark.parametrize(
    ("begin", "words"),
    [
        (b"PK\x03\x04[Content_Types].xml", r"an Excel workbook or .*; expected the suffix \.xlsx"),
        (b"\xd0\xcf\x11\xe0\xa1\xb1", r"an Excel workbook \(\.xls\); expected text or \.xlsx"),
        (b"\x1f\x8b\x08", "packed by gzip; expected text: unpack it"),
        (b"MDF     4.10", r"an MDF file; expected the suffix \.mf4"),
        (b"PAR1", r"a Parquet file; expected the suffix \.parquet"),
        (b"    -1\n    58\nNONE\n", r"a universal file .UFF. of data set 58; expected .* \.uff"),
        (b"  -1\r\n  58b     1     2\r\n", "a universal file .UFF. of data set 58"),
    ],
)
def test_a_file_that_is_no_text_is_called_what_it_is(begin, words, tmp_path):
    (tmp_path / "run.dat").write_bytes(begin + bytes(range(256)) * 9)
    with pytest.raises(ValueError, match=rf"run\.dat: {words}"):
        read_log(tmp_path / "run.dat")


@pytest.mark.parametrize("kind", ["mounting", "element"])
@pytest.mark.parametrize(("unit", "what"), [("m/s^2", "an acceleration"), ("mm/s", "a velocity")])
def test_integrals_are_refused_with_the_reason(kind, unit, what):
    contract = campaign_kind(kind, {"drive": "force"})
    with pytest.raises(ValueError, match=f"that of {what}; expected a displacement: "):
        contract_unit(unit, "m", "displacement", contract)


def test_an_angle_goes_on_through_turns_that_a_gap_swallowed():
    wrapped = np.rad2deg(ANGLE) % 360.0
    recorded = np.delete(np.arange(TIME.size), slice(300, 460))  # 8 s: three turns
    angle = unwrapped_angle(wrapped[recorded], TIME[recorded], 360.0)
    assert_allclose(angle, np.rad2deg(ANGLE)[recorded], atol=1e-9)


def test_a_train_of_pulses_is_an_angle():
    time = np.arange(0.0, 20.0, 2e-3)
    angle = 2.3 * time
    train = 5.0 * (np.floor(angle / (2.0 * np.pi) * 120.0) % 2.0)  # 60 rising edges a turn
    there = angle_of_pulses(train, time, 60.0)
    # An edge lies within a sample of where it is seen.
    assert_allclose(there - there[0], angle - angle[0], atol=2.5 * 2.3 * 2e-3)


def test_dropouts_are_told_from_the_signal():
    rng = np.random.default_rng(0)
    values = 1e-3 * np.sin(TIME) + 1e-6 * rng.standard_normal(TIME.size)
    moves = np.ones(TIME.size, dtype=bool)
    assert not (stuck(values, moves) | zeroed(values, moves) | marked(values)).any()
    faulty = values.copy()
    faulty[100:120] = faulty[100]
    faulty[200:203] = 0.0
    faulty[300] = -9999.0
    faulty[301] = np.inf
    assert np.flatnonzero(stuck(faulty, moves)).tolist() == list(range(101, 120))
    assert np.flatnonzero(zeroed(faulty, moves)).tolist() == [200, 201, 202]
    assert np.flatnonzero(marked(faulty)).tolist() == [300, 301]
    # A machine at rest may give one value for ever.
    assert not stuck(faulty, np.zeros(TIME.size, dtype=bool)).any()


def test_a_cell_that_is_no_number_is_told_by_its_line(tmp_path):
    rows = [f"{k};{k},5" for k in range(40)]
    rows[10] = "10;abc"
    (tmp_path / "a.csv").write_text("t;x\n" + "\n".join(rows))
    with pytest.raises(
        ValueError, match=r"a\.csv: line 12, column 'x' is 'abc'; expected a number"
    ):
        read_log(tmp_path / "a.csv")


@pytest.mark.parametrize("suffix", [".csv", ".h5", ".mat", ".parquet", ".tdms"])
def test_what_is_no_file_of_its_suffix_is_refused_by_name(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    path.write_bytes(b"no table at all \x00\x01\x02")
    with pytest.raises(ValueError, match=f"a{suffix}"):
        read_log(path)


def test_a_tdms_file_that_is_cut_short_is_refused(tmp_path):
    """Its channels end at different samples, which would pass for records of two clocks."""
    from nptdms import ChannelObject, TdmsWriter

    path = tmp_path / "a.tdms"
    with TdmsWriter(path) as file:
        for _ in range(2):
            file.write_segment([ChannelObject("g", name, TIME) for name in ("x", "y")])
    (table,) = read_log(path)
    assert len(table.columns) == 2
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(ValueError, match=r"a\.tdms: ends within its last segment"):
        read_log(path)


def test_a_new_map_is_refused_until_it_is_filled_in_and_everything_is_told_at_once(tmp_path):
    rows = "\n".join(f"{t:.3f},{np.sin(t):.6f},{np.cos(t):.6f}" for t in TIME)
    (tmp_path / "run.csv").write_text("t,probe,angle\n" + rows)
    files = [tmp_path / "run.csv"]
    new = new_campaign(kind="carrier", from_=files, out=tmp_path / "map.toml")
    with pytest.raises(ValueError, match="expected") as refused:
        import_records(files, map_=new.path, out=tmp_path / "campaign")
    problems = problems_of(refused.value)
    assert len(problems) == len(new.open_keys) > 4
    assert not (tmp_path / "campaign").exists()
    with pytest.raises(ValueError, match="exists already"):
        new_campaign(kind="carrier", from_=files, out=tmp_path / "map.toml")
