"""Files that other programs or libraries wrote, and two written by hand after their description."""

import datetime
import re
import struct
import warnings

import h5py
import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.io import savemat
from scipy.io.matlab import MatlabOpaque

from carrierflex.identification.logs.log_files import _mat_objects, read_log
from carrierflex.identification.logs.log_formats import LOG_FORMATS
from carrierflex.identification.logs.log_table import table_with
from carrierflex.identification.logs.optional_readers import _library_errors
from carrierflex.workflows.identification.import_records import main as import_records
from carrierflex.workflows.identification.new_campaign import main as new_campaign

TIME = 0.01 * np.arange(400)
FORCE = 1e3 * np.sin(5.0 * TIME) + 1.0 / 3.0
TRAVEL = 2.0 * np.sin(5.0 * TIME - 0.1)

#: Data set 58 field by field, columns counted in the published formats (SDRL, University of
#: Cincinnati): 5(80A1) / 2(I5,I10),2(1X,10A1,I10,I4) / 3I10,3E13.5 / 4 of I10,3I5,2(1X,20A1) /
#: single precision, even: 6E13.5.
HAND_WRITTEN_58 = "\n".join(
    [
        "    -1",
        f"{58:6d}",
        f"{'Mount 3, axial':<80}",
        *[f"{'NONE':<80}"] * 4,
        f"{1:5d}{1:10d}{0:5d}{0:10d} {'NONE':<10}{7:10d}{-3:4d} {'NONE':<10}{0:10d}{0:4d}",
        f"{2:10d}{8:10d}{1:10d}  5.00000e-01  2.50000e-01  0.00000e+00",
        f"{17:10d}{0:5d}{0:5d}{0:5d} {'Time':<20} {'s':<20}",
        f"{8:10d}{0:5d}{0:5d}{0:5d} {'Weg':<20} {'mm':<20}",
        *[f"{0:10d}{0:5d}{0:5d}{0:5d} {'NONE':<20} {'NONE':<20}"] * 2,
        "  1.00000e+00 -2.50000e+00  3.25000e-02  4.00000e+00  5.00000e+00  6.00000e+00",
        "  7.00000e+00 -8.12500e+03",
        "    -1",
        "",
    ]
)


def universal_set(pyuff, values, **facts):
    """A time response of data set 58 as pyuff prepares it."""
    known = {
        "func_type": 1,
        "rsp_dir": 3,
        "ref_node": 0,
        "ref_dir": 0,
        "abscissa_spec_data_type": 17,
        "abscissa_axis_units_lab": "s",
        "abscissa_spacing": 1,
        "orddenom_spec_data_type": 0,
        "z_axis_spec_data_type": 0,
    }
    return pyuff.prepare_58(data=values, x=TIME[: values.size], **(known | facts))


def write_sets(path, *sets):
    """Write data sets with pyuff, which leaves the file open of a binary one."""
    pyuff = pytest.importorskip("pyuff")
    file = pyuff.UFF(str(path))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)
        for data_set in sets:
            file.write_sets(data_set, "add")
    return path


def write_universal(folder, **first):
    pyuff = pytest.importorskip("pyuff")
    travel = {"ordinate_spec_data_type": 8, "ordinate_axis_units_lab": "mm"} | first
    force = {"ordinate_spec_data_type": 13, "ordinate_axis_units_lab": "N"}
    return write_sets(
        folder / "run.uff",
        universal_set(pyuff, TRAVEL, rsp_node=2, binary=0, **travel),
        universal_set(pyuff, FORCE, rsp_node=1, binary=1, **force),
    )


def write_mdf(folder, version="4.10", suffix=".mf4"):
    asammdf = pytest.importorskip("asammdf")
    with asammdf.MDF(version=version) as file:
        force = asammdf.Signal(FORCE, TIME, name="Force", unit="N")
        travel = asammdf.Signal(TRAVEL, TIME, name="Displacement", unit="mm")
        file.append([force, travel])
        file.append([asammdf.Signal(FORCE[::4], TIME[::4], name="Temperature", unit="degC")])
        return file.save(folder / f"run{suffix}", compression=2 if suffix == ".mf4" else 0)


def write_workbook(folder):
    pytest.importorskip("python_calamine")
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.active.title = "Info"
    book.active.append(["Test rig", "3"])
    sheet = book.create_sheet("Data")
    sheet.append(["Mount 3", None, None])
    sheet.append(["Time", "Force", "Displacement"])
    sheet.append(["s", "N", "mm"])
    for row in zip(TIME, FORCE, TRAVEL, strict=True):
        sheet.append([float(value) for value in row])
    book.save(folder / "run.xlsx")
    return folder / "run.xlsx"


def openfast_bytes(kind, names, units, columns, step):
    """Binary output of OpenFAST after ReadFASTbinary.m of its MATLAB toolbox (format 2, 3, 4)."""
    channels, steps = len(names), len(columns[0])
    length = 12 if kind == 4 else 10
    head = struct.pack("<h", kind) + (struct.pack("<h", length) if kind == 4 else b"")
    head += struct.pack("<ii", channels, steps) + struct.pack("<dd", 0.0, step)
    scale, offset = np.full(channels, 1000.0, "<f4"), np.full(channels, 2.0, "<f4")
    if kind != 3:
        head += scale.tobytes() + offset.tobytes()
    words = b"by hand"
    head += struct.pack("<i", len(words)) + words
    for text in ("Time", *names, "(s)", *units):
        head += text.encode().ljust(length)
    values = np.column_stack(columns)
    if kind == 3:
        return head + values.astype("<f8").tobytes()
    return head + np.rint(values * 1000.0 + 2.0).astype("<i2").tobytes()


def write_openfast(folder):
    pytest.importorskip("openfast_io.FAST_output_reader")
    columns = [FORCE, TRAVEL]
    content = openfast_bytes(3, ["Force", "Disp"], ["(N)", "(mm)"], columns, 0.01)
    (folder / "run.outb").write_bytes(content)
    return folder / "run.outb"


WRITERS = {
    "uff": write_universal,
    "mdf": write_mdf,
    "mdf 3": lambda folder: write_mdf(folder, "3.30", ".mdf"),
    "excel": write_workbook,
    "openfast": write_openfast,
}


#: Of the signals in a group.
NAMES, UNITS = ("time", "force", "disp"), ("s", "N", "mm")


def write_groups(folder, groups):
    """HDF5 file of groups of (time, force or None, displacement or None)."""
    with h5py.File(folder / "run.h5", "w") as file:
        for group, signals in groups.items():
            for name, unit, values in zip(NAMES, UNITS, signals, strict=True):
                if values is not None:
                    file[f"{group}/{name}"] = values
                    file[f"{group}/{name}"].attrs["unit"] = unit
    return folder / "run.h5"


def write_structures(folder, groups):
    names = ("time", "force_N", "disp_mm")
    content = {
        group: {name: v for name, v in zip(names, signals, strict=True) if v is not None}
        for group, signals in groups.items()
    }
    savemat(folder / "run.mat", content)
    return folder / "run.mat"


def write_tdms(folder, channels):
    """TDMS file of (group, name, unit, values, properties)."""
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(folder / "run.tdms") as file:
        file.write_segment(
            [
                nptdms.ChannelObject(group, name, values, {"unit_string": unit, **facts})
                for group, name, unit, values, facts in channels
            ]
        )
    return folder / "run.tdms"


def write_tdms_groups(folder, groups):
    channels = [
        (group, name, unit, values, {})
        for group, signals in groups.items()
        for name, unit, values in zip(NAMES, UNITS, signals, strict=True)
        if values is not None
    ]
    return write_tdms(folder, channels)


def write_started_waveforms(folder, groups):
    """Waveforms whose clocks are stated by the instant of their first sample."""
    midnight = np.datetime64("2026-05-04T00:00:00.000000")
    channels = []
    for group, (time, *signals) in groups.items():
        begin = midnight + np.timedelta64(round(1e6 * time[0]), "us")
        facts = {"wf_start_time": begin, "wf_start_offset": 0.0, "wf_increment": time[1] - time[0]}
        channels += [
            (group, name, unit, values, facts)
            for name, unit, values in zip(("force", "disp"), ("N", "mm"), signals, strict=True)
            if values is not None
        ]
    return write_tdms(folder, channels)


def write_dated_groups(folder, groups):
    midnight = np.datetime64("2026-05-04T00:00:00.000000")
    dated = {
        group: (midnight + (1e6 * time).round().astype("timedelta64[us]"), *signals)
        for group, (time, *signals) in groups.items()
    }
    return write_tdms_groups(folder, dated)


@pytest.mark.parametrize(
    "write",
    [
        write_groups,
        write_structures,
        write_tdms_groups,
        write_started_waveforms,
        write_dated_groups,
    ],
)
def test_groups_of_one_length_keep_their_clocks(write, tmp_path):
    # As many samples at half the rate, one second later.
    late = 1.0 + 2.0 * TIME
    travel = 2.0 * np.sin(5.0 * late - 0.1)
    path = write(tmp_path, {"fast": (TIME, FORCE, None), "slow": (late, None, travel)})
    guess = new_campaign(kind="element", from_=[path], drive="force", out=tmp_path / "map.toml")
    assert not guess.open_keys
    imported = import_records([path], map_=guess.path, out=tmp_path / "campaign").imported
    run = imported.campaign.runs[0]
    (measured,) = run.signals.values()
    assert_allclose(run.time, late[: run.time.size], atol=1e-9)
    assert_allclose(measured, 2e-3 * np.sin(5.0 * run.time - 0.1), atol=1e-9)
    force = 1e3 * np.sin(5.0 * run.time) + 1.0 / 3.0
    # Spline and filter of the change of clock; the other clock would be off by the amplitude.
    assert_allclose(run.inputs["force"], force, atol=1.0)


def write_mdf_groups(folder, groups):
    asammdf = pytest.importorskip("asammdf")
    with asammdf.MDF(version="4.10") as file:
        for time, *signals in groups.values():
            file.append(
                [
                    asammdf.Signal(values, time, name=name, unit=unit)
                    for name, unit, values in zip(NAMES[1:], UNITS[1:], signals, strict=True)
                ]
            )
        return file.save(folder / "run.mf4")


@pytest.mark.parametrize("n_second", [400, 300])
@pytest.mark.parametrize(
    "write",
    [write_groups, write_structures, write_tdms_groups, write_started_waveforms, write_mdf_groups],
)
def test_groups_of_the_same_columns_are_runs(write, n_second, tmp_path):
    rows = slice(n_second)
    groups = {
        "group 1": (TIME, FORCE, TRAVEL),
        "group 2": (TIME[rows], 2.0 * FORCE[rows], 3.0 * TRAVEL[rows]),
    }
    path = write(tmp_path, groups)
    guess = new_campaign(kind="element", from_=[path], drive="force", out=tmp_path / "map.toml")
    assert not guess.open_keys
    assert not guess.left_out
    imported = import_records([path], map_=guess.path, out=tmp_path / "campaign").imported
    first, second = imported.campaign.runs
    assert (first.name, second.name) == ("group_1", "group_2")
    for run, (time, force, travel) in zip((first, second), groups.values(), strict=True):
        (measured,) = run.signals.values()
        assert_allclose(run.time, time, atol=1e-9)
        assert_allclose(run.inputs["force"], force, rtol=1e-12)
        assert_allclose(measured, 1e-3 * travel, rtol=1e-12)


def test_runs_in_groups_may_share_the_time_above_them(tmp_path):
    path = write_groups(tmp_path, {"a": (None, FORCE, TRAVEL), "b": (None, -FORCE, TRAVEL)})
    with h5py.File(path, "r+") as file:
        file["time"] = TIME
    guess = new_campaign(kind="element", from_=[path], drive="force", out=tmp_path / "map.toml")
    imported = import_records([path], map_=guess.path, out=tmp_path / "campaign").imported
    assert_array_equal(imported.campaign.runs[1].inputs["force"], -FORCE)
    assert_array_equal(imported.campaign.runs[1].time, TIME)
    guess.path.write_text(guess.text.replace('group = "b"', 'group = "c"'), encoding="utf-8")
    with pytest.raises(ValueError, match=r"run b: run\.h5: no group 'c' .*of the file's: a, b"):
        import_records([path], map_=guess.path, out=tmp_path / "other")


def test_columns_of_other_groups_are_named_as_left_out(tmp_path):
    groups = {"drive": (TIME, FORCE, TRAVEL), "room": (TIME, FORCE, None)}
    path = write_groups(tmp_path, groups)
    guess = new_campaign(kind="element", from_=[path], drive="force", out=tmp_path / "map.toml")
    assert guess.left_out == ("room/force", "room/time")
    imported = import_records([path], map_=guess.path, out=tmp_path / "campaign").imported
    (run,) = imported.campaign.runs
    assert_array_equal(run.inputs["force"], FORCE)


def guessed_time(folder, columns):
    """Column and unit of the time in a new map of a table."""
    pd.DataFrame(columns).to_csv(folder / "a.csv", index=False)
    guess = new_campaign(
        kind="element", from_=[folder / "a.csv"], drive="force", out=folder / "a.toml"
    )
    return re.search(r'\[time\]\ncolumn = "(.*?)".*\nunit = "(.*?)"', guess.text).groups()


@pytest.mark.parametrize(
    ("clocks", "guess"),
    [
        ({"Time A [s]": TIME, "Time B [s]": 2.0 * TIME}, ("?", "s")),
        ({"Time A [s]": TIME, "Time B [s]": TIME + 0.5}, ("?", "s")),
        ({"Time [s]": TIME, "timestamp": 1e3 * TIME + 1.7e12}, ("Time [s]", "s")),
        ({"A": TIME, "B": 2.0 * TIME}, ("?", "s")),
        ({"A": TIME, "Angle": 2.0 * TIME}, ("A", "s")),
        ({"A": TIME, "Position [mm]": 2.0 * TIME}, ("A", "s")),
    ],
)
def test_clocks_of_one_table_that_differ_are_asked_about(clocks, guess, tmp_path):
    assert guessed_time(tmp_path, clocks | {"Force [N]": FORCE, "Weg [mm]": TRAVEL}) == guess


@pytest.mark.parametrize(
    ("name", "values", "guess"),
    [
        ("Time", TIME, ("Time", "s")),
        ("Time", 1e3 * TIME, ("Time", "ms")),
        ("Timestamp", 1.7e9 + 100.0 * TIME, ("Timestamp", "s")),
        ("Timestamp", 1.7e12 + 1e3 * TIME, ("Timestamp", "ms")),
        ("Timestamp", 1.7e15 + 1e6 * TIME, ("Timestamp", "us")),
        # Days of a table, hours, microseconds or anything, a date as one number, rows that count.
        ("Date", 45352.5 + TIME / 86400.0, ("Date", "?")),
        ("Time", TIME / 3600.0, ("Time", "?")),
        ("Time", 1e6 * TIME, ("Time", "?")),
        ("Time", 20240301115900.0 + np.arange(400.0), ("Time", "?")),
        ("Sample", np.arange(400.0), ("?", "s")),
    ],
)
def test_the_unit_of_a_time_without_one_is_guessed_or_asked(name, values, guess, tmp_path):
    columns = {name: values, "Force [N]": FORCE, "Weg [mm]": TRAVEL}
    assert guessed_time(tmp_path, columns) == guess


@pytest.mark.parametrize("name", WRITERS)
def test_files_of_other_libraries_become_a_campaign_with_their_units(name, tmp_path):
    path = WRITERS[name](tmp_path)
    guess = new_campaign(kind="element", from_=[path], drive="force", out=tmp_path / "map.toml")
    assert not guess.open_keys
    imported = import_records([path], map_=guess.path, out=tmp_path / "campaign").imported
    run = imported.campaign.runs[0]
    assert_allclose(run.time, TIME, atol=1e-12)
    (measured,) = run.signals.values()
    assert_allclose(run.inputs["force"], FORCE, rtol=1e-10)
    assert_allclose(measured, 1e-3 * TRAVEL, rtol=1e-10)


def write_two_columns(folder, stamps):
    rows = zip(stamps, FORCE.tolist(), TRAVEL.tolist(), strict=True)
    lines = [f"{t:%Y-%m-%d},{t:%H:%M:%S.%f},{force!r},{x!r}" for t, force, x in rows]
    (folder / "a.csv").write_text("\n".join(["Date,Clock,Force [N],Displacement [mm]", *lines, ""]))
    return folder / "a.csv"


def write_dated_workbook(folder, stamps):
    pytest.importorskip("python_calamine")
    book = pytest.importorskip("openpyxl").Workbook()
    book.active.append(["Stamp", "Force [N]", "Displacement [mm]"])
    for row in zip(stamps, FORCE.tolist(), TRAVEL.tolist(), strict=True):
        book.active.append(row)
    book.save(folder / "a.xlsx")
    return folder / "a.xlsx"


def write_dated_table(folder, stamps, index=None):
    index = pd.DatetimeIndex(stamps) if index is None else index
    columns = {"Force [N]": FORCE, "Displacement [mm]": TRAVEL}
    pd.DataFrame(columns, index=index).to_parquet(folder / "a.parquet")
    return folder / "a.parquet"


def write_durations(folder, stamps):
    return write_dated_table(folder, stamps, pd.to_timedelta(TIME, "s"))


@pytest.mark.parametrize(
    "write", [write_two_columns, write_dated_workbook, write_dated_table, write_durations]
)
def test_a_record_over_midnight_keeps_its_clock_however_it_is_dated(write, tmp_path):
    # The workbook writes the stamp of midnight itself without a time of day.
    begin = datetime.datetime(2024, 2, 29) - datetime.timedelta(seconds=float(TIME[-10]))
    stamps = [begin + datetime.timedelta(microseconds=round(1e6 * t)) for t in TIME.tolist()]
    path = write(tmp_path, stamps)
    guess = new_campaign(kind="element", from_=[path], drive="force", out=tmp_path / "map.toml")
    assert not guess.open_keys
    imported = import_records([path], map_=guess.path, out=tmp_path / "campaign").imported
    run = imported.campaign.runs[0]
    assert_allclose(run.time - run.time[0], TIME, atol=1e-6)
    assert_allclose(run.inputs["force"], FORCE, rtol=1e-10)


def test_a_prediction_of_openfast_is_the_baseline_of_a_measurement(tmp_path):
    measured, predicted = write_workbook(tmp_path), write_openfast(tmp_path)
    guess = new_campaign(kind="element", from_=[measured], drive="force", out=tmp_path / "map.toml")
    (channel,) = re.findall(r'name = "(measured_\w+)"', guess.text)
    columns = f"""
[simulated]
time = {{ column = "Time", unit = "s" }}

[[simulated.channels]]
channel = "{channel}"
column = "Disp"
unit = "mm"
"""
    guess.path.write_text(guess.text + columns, encoding="utf-8")
    imported = import_records(
        [measured], map_=guess.path, simulated=[predicted], out=tmp_path / "campaign"
    ).imported
    assert imported.campaign.baseline.source == "columns"
    assert abs(imported.shifts["run"].seconds) < 1e-6  # the same signal
    inner = slice(5, -5)  # a shift of rounding has no sample before the first
    predictions = imported.campaign.runs[0].predictions[channel]
    assert_allclose(predictions[inner], 1e-3 * TRAVEL[inner], rtol=1e-5, atol=1e-9)


def test_a_universal_file_written_by_hand_after_the_published_format(tmp_path):
    pytest.importorskip("pyuff")
    (tmp_path / "a.unv").write_text(HAND_WRITTEN_58)
    (table,) = read_log(tmp_path / "a.unv")
    assert (table.start, table.step) == (0.5, 0.25)
    assert table.units == {"Mount 3, axial": "mm"}
    values = [1.0, -2.5, 0.0325, 4.0, 5.0, 6.0, 7.0, -8125.0]
    assert_array_equal(table.columns["Mount 3, axial"], values)


def test_names_of_universal_records_are_quantity_node_and_direction(tmp_path):
    (table,) = read_log(write_universal(tmp_path))
    assert table.names == ("displacement 2+Z", "force 1+Z")


def test_uneven_universal_records_bring_their_time(tmp_path):
    path = write_universal(tmp_path, abscissa_spacing=0, abscissa_axis_units_lab="ms")
    tables = read_log(path)
    uneven = table_with(tables, "displacement 2+Z")
    assert_allclose(uneven.columns["time"], 1e-3 * TIME, rtol=1e-12)


def test_universal_frequency_responses_are_no_records(tmp_path):
    pyuff = pytest.importorskip("pyuff")
    data = universal_set(pyuff, TRAVEL + 1j * FORCE, rsp_node=1, func_type=4)
    write_sets(tmp_path / "a.uff", data)
    with pytest.raises(ValueError, match=r"a\.uff: .*frequency responses; expected .*export the"):
        read_log(tmp_path / "a.uff")


def test_universal_mode_shapes_are_no_records(tmp_path):
    pyuff = pytest.importorskip("pyuff")
    shape = np.array([1.0, 0.5])
    data = pyuff.prepare_55(
        model_type=1, analysis_type=2, data_ch=2, spec_data_type=8, load_case=0, mode_n=1,
        freq=12.0, node_nums=np.array([1, 2]), r1=shape, r2=shape, r3=shape,
    )  # fmt: skip
    write_sets(tmp_path / "a.uff", data)
    with pytest.raises(ValueError, match=r"of data sets \[55\]; expected data set 58"):
        read_log(tmp_path / "a.uff")


def test_universal_records_that_were_cut_are_refused(tmp_path):
    pytest.importorskip("pyuff")
    (tmp_path / "a.uff").write_text(HAND_WRITTEN_58.replace("  7.00000e+00 -8.12500e+03\n", ""))
    with pytest.raises(ValueError, match="states 8 values and holds 6"):
        read_log(tmp_path / "a.uff")


def test_groups_of_an_mdf_file_have_clocks_of_their_own(tmp_path):
    fast, slow = read_log(write_mdf(tmp_path))
    assert_allclose(fast.columns["time"], TIME, atol=1e-12)
    assert_allclose(slow.columns["time"], TIME[::4], atol=1e-12)
    assert slow.units["Temperature"] == "degC"


@pytest.mark.parametrize("kind", [2, 4])
def test_packed_openfast_output_has_values_after_the_published_scaling(kind, tmp_path):
    pytest.importorskip("openfast_io.FAST_output_reader")
    travel = np.array([0.25, -1.5, 3.125])
    content = openfast_bytes(kind, ["A", "B"], ["(kN-m)", "(m)"], [travel, 2.0 * travel], 0.5)
    (tmp_path / "a.outb").write_bytes(content)
    (table,) = read_log(tmp_path / "a.outb")
    # Written as round(1000 x + 2), read as (written - 2) / 1000.
    assert_allclose(table.columns["A"], travel, rtol=1e-12)
    assert_allclose(table.columns["Time"], [0.0, 0.5, 1.0], rtol=1e-12)
    assert table.units == {"Time": "s", "A": "kN-m", "B": "m"}


def test_openfast_output_of_a_stopped_run_is_refused_before_it_is_read(tmp_path):
    pytest.importorskip("openfast_io.FAST_output_reader")
    path = write_openfast(tmp_path)
    path.write_bytes(path.read_bytes()[:900])
    with pytest.raises(ValueError, match=r"run\.outb: states 2 channels of 400 values in 900"):
        read_log(path)


def test_text_output_of_openfast_is_a_table_of_text(tmp_path):
    # As OpenFAST 3 and 4 write it: six lines, names, units, tabulators.
    lines = [
        "",
        "Predictions were generated on 27-Nov-2026 by OpenFAST",
        " linked with",
        "",
        "",
        "",
    ]
    lines += ["Time      \tBldPitch1 \tRotTorq   ", "(s)       \t(deg)     \t(kN-m)    "]
    lines += [f"{t:10.4f}\t{1.0 + t:12.5E}\t{f:12.5E}" for t, f in zip(TIME, FORCE, strict=True)]
    (tmp_path / "run.out").write_text("\n".join(lines) + "\n")
    (table,) = read_log(tmp_path / "run.out")
    assert table.units == {"Time": "s", "BldPitch1": "deg", "RotTorq": "kN-m"}
    assert_allclose(table.columns["RotTorq"], FORCE, rtol=1e-5)


def test_simulinks_structure_with_time_has_its_labels_as_names(tmp_path):
    signals = np.zeros(2, dtype=[("values", "O"), ("label", "O")])
    signals[0], signals[1] = (FORCE[:, None], "F"), (TRAVEL[:, None], "s")
    content = {"out": {"time": TIME[:, None], "signals": signals}}
    savemat(tmp_path / "a.mat", content)
    (table,) = read_log(tmp_path / "a.mat")
    assert table.names == ("time", "F", "s")


def test_objects_of_matlab_are_named_with_what_to_do(tmp_path):
    with h5py.File(tmp_path / "a.mat", "w", userblock_size=512) as file:
        file["x"] = TRAVEL
        # As MATLAB 7.3 writes an object: a reference into a subsystem of its own.
        file["ts"] = np.arange(6, dtype=np.uint32).reshape(1, 6)
        file["ts"].attrs["MATLAB_class"] = np.bytes_("timeseries")
        file["ts"].attrs["MATLAB_object_decode"] = 3
    (table,) = read_log(tmp_path / "a.mat")
    assert table.names == ("x",)
    assert "'ts' is a MATLAB object of class timeseries, which is not read" in table.notes[0]
    assert "s.data = ts.Data; save('run.mat', '-struct', 's')" in table.notes[0]
    with h5py.File(tmp_path / "a.mat", "r+") as file:
        del file["x"]
    with pytest.raises(ValueError, match=r"a\.mat: no list of numbers; 'ts' is a MATLAB object"):
        read_log(tmp_path / "a.mat")


def test_objects_of_a_mat_5_file_are_known_by_scipys_class():
    row = np.zeros(1, dtype=[("s0", "O"), ("s1", "O"), ("s2", "O"), ("arr", "O")])
    row[0] = (b"ts", b"MCOS", b"timeseries", np.zeros(6))
    assert _mat_objects({None: row.view(MatlabOpaque), "x": TRAVEL}) == {"ts": "timeseries"}


@pytest.mark.parametrize(
    "log_format",
    [log_format for log_format in LOG_FORMATS if log_format.extra],
    ids=lambda log_format: log_format.extra,
)
def test_without_its_package_a_format_names_the_extra(log_format, tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, log_format.module, None)
    path = tmp_path / f"a{log_format.suffixes[0]}"
    path.write_bytes(b"content")
    with pytest.raises(ValueError, match=rf"needs the package .*carrierflex\[{log_format.extra}\]"):
        read_log(path)


@pytest.mark.parametrize(
    "log_format",
    [log_format for log_format in LOG_FORMATS if log_format.extra],
    ids=lambda log_format: log_format.extra,
)
def test_other_bytes_under_a_suffix_are_refused_in_one_line(log_format, tmp_path):
    pytest.importorskip(log_format.module)
    path = tmp_path / f"a{log_format.suffixes[0]}"
    path.write_bytes(bytes(range(256)) * 20)
    with pytest.raises(ValueError, match=r"a\.") as refusal:
        read_log(path)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("error", [KeyError((0, 1)), ValueError(""), IndexError(7)])
def test_an_error_of_a_library_without_words_is_damage(error, tmp_path):
    path = tmp_path / "a.mf4"
    with (
        pytest.raises(ValueError, match=r"a\.mf4: not an MDF file: damaged; export it again"),
        _library_errors(path),
    ):
        raise error
