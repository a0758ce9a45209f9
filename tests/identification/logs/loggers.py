"""Twelve loggers: the records of a campaign in files of as many dialects, each with its traps."""

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pa_parquet
from scipy.io import savemat

from carrierflex.identification.campaign.campaign import Campaign

#: Rows that a logger loses.
LOST = slice(150, 156)
START = datetime(2024, 2, 29, 23, 59, 50)


@dataclass(frozen=True, eq=False)
class Logger:
    """One dialect.

    `write` makes the files of a campaign in a folder; `factor` is the channels' unit in theirs of
    the contract, `edits` what a user changes in the map beside what is marked '?'.
    """

    kind: str
    write: Callable[[Campaign, Path], list[Path]]
    factor: float
    edits: dict[str, str] = field(default_factory=dict)
    simulated_by: str = "force"
    units: dict[str, str] = field(default_factory=dict)


def table_of(run, scales, *, angle=None):
    """Columns of a run by name, times a scale; the carrier's angle by a function of its own."""
    columns = {}
    for name, values in run.columns().items():
        columns[name] = scales.get(name, scales.get("", 1.0)) * values
    if angle is not None:
        columns["carrier_angle"] = angle(run.inputs["carrier_angle"])
    return columns


def text_rows(cells, separator, *, comma=False, lost=None):
    """Lines of cells, with a decimal comma where wanted, without the rows that are lost."""
    lines = [separator.join(row) for row in zip(*cells, strict=True)]
    if comma:
        lines = [line.replace(".", ",") for line in lines]
    if lost is not None:
        del lines[lost]
    return lines


def numbers(values, digits=6):
    return [f"{value:.{digits}f}" for value in values]


def wrapped_degrees(angle):
    return np.rad2deg(angle) % 360.0


def overflowing_counter(angle):
    """4096 pulses of a turn, counted in 14 bits."""
    return np.floor(angle * 4096 / (2.0 * np.pi)) % 16384


def german_carrier(campaign, folder):
    """UTF-16, semicolons, decimal commas, preamble, ms, wrapped degrees, kN m, lost rows."""
    files = []
    for run in campaign.runs:
        scales = {"torque": 1e-3, "ntl_y": 1e-3, "ntl_z": 1e-3, "": 1e6}
        columns = table_of(run, scales, angle=wrapped_degrees)
        names = ["Zeit", "Winkel", "Drehmoment", "NTL y", "NTL z"]
        names += [f"Sensor {name[1:]}" for name in run.signals]
        units = ["ms", "°", "kNm", "kN", "kN", *["µm"] * len(run.signals)]
        cells = [numbers(run.time * 1e3, 3), *(numbers(values) for values in columns.values())]
        head = ["Messung;Prüfstand 3", "Kunde;Wind AG;;", "", ";".join(names), ";".join(units)]
        lines = head + text_rows(cells, ";", comma=True, lost=LOST)
        path = folder / f"{run.name}.csv"
        path.write_bytes("\r\n".join(lines).encode("utf-16"))
        files.append(path)
    return files


def dated_carrier(campaign, folder):
    """ISO dates over the end of February, a counter that overflows, marks, empty cells."""
    files = []
    for run in campaign.runs:
        scales = {"torque": 1e-3, "ntl_y": 1.0, "ntl_z": 1.0, "": 1e3}
        columns = table_of(run, scales, angle=overflowing_counter)
        names = ["Timestamp", "Encoder counts", "Torque [kN*m]", "NTL_y [N]", "NTL_z [N]"]
        names += [f"Probe {name[1:]}deg [mm]" for name in run.signals]
        dates = [
            (START + timedelta(seconds=float(t))).isoformat(sep=" ", timespec="microseconds")
            for t in run.time
        ]
        cells = [dates, *(numbers(values, 9) for values in columns.values())]
        cells[-1][30:34] = ["-9999.0"] * 4
        cells[-2][60:63] = [""] * 3
        path = folder / f"{run.name}.csv"
        path.write_text("\n".join([",".join(names), *text_rows(cells, ",")]))
        files.append(path)
    return files


def two_clocks_carrier(campaign, folder):
    """HDF5 with a fast table of sensors and a slow one of loads, radians, units as attributes."""
    files = []
    for run in campaign.runs:
        path = folder / f"{run.name}.h5"
        with h5py.File(path, "w") as file:
            fast, slow = file.create_group("probes"), file.create_group("loads")
            fast["time"] = run.time
            for name, values in run.signals.items():
                fast[name] = values * 1e6
                fast[name].attrs["unit"] = "um"
            # Two samples of three would be another clock with the same length as none.
            every = run.time[0] + 0.1 * np.arange(int((run.time[-1] - run.time[0]) / 0.1) + 1)
            slow["time"] = every
            names = {"carrier_angle": "azimuth", "torque": "main_torque"}
            for name, values in run.inputs.items():
                unit = {"carrier_angle": "rad", "torque": "N m"}.get(name, "N")
                column = slow.create_dataset(
                    names.get(name, name), data=np.interp(every, run.time, values)
                )
                column.attrs["unit"] = unit
        files.append(path)
    return files


def windows_mounting(campaign, folder):
    """Windows' code page, semicolons at the end of lines, rpm, rows that repeat."""
    files = []
    for run in campaign.runs:
        scales = {"torque": 1e-3, "speed": 30.0 / np.pi, "ntl_y": 1e-3, "ntl_z": 1e-3, "": 1e6}
        columns = table_of(run, scales, angle=wrapped_degrees)
        names = ["Zeit [s]", "Moment [kNm]", "Drehzahl [U/min]", "Winkel [°]", "FY [kN]", "FZ [kN]"]
        names += [f"{name} [µm]" for name in run.signals]
        cells = [numbers(run.time, 3), *(numbers(values, 5) for values in columns.values())]
        # The logger stood still for a channel.
        cells[-1][400:410] = [cells[-1][400]] * 10
        lines = [line + ";" for line in [";".join(names), *text_rows(cells, ";", comma=True)]]
        path = folder / f"{run.name}.txt"
        path.write_bytes("\r\n".join(lines).encode("cp1252"))
        files.append(path)
    return files


def mat_mounting(campaign, folder):
    """MAT 5 with structures, milliseconds, angle in turns backwards."""
    files = []
    for run in campaign.runs:
        columns = table_of(run, {"": 1e3, "torque": 1.0, "speed": 1.0, "ntl_y": 1.0, "ntl_z": 1.0})
        inputs = {name: columns.pop(name) for name in run.inputs}
        inputs["carrier_angle"] = -run.inputs["carrier_angle"] / (2.0 * np.pi)
        path = folder / f"{run.name}.mat"
        savemat(
            path,
            {
                "time_ms": run.time * 1e3,
                "rig": {
                    "torque_Nm": inputs["torque"],
                    "speed": inputs["speed"],
                    "rotor_angle_turn": inputs["carrier_angle"],
                    "FY": inputs["ntl_y"],
                    "FZ": inputs["ntl_z"],
                },
                "housing": {f"{name}_mm": values for name, values in columns.items()},
                "note": "Station 4",
            },
            do_compression=True,
        )
        files.append(path)
    return files


def tdms_mounting(campaign, folder):
    """TDMS whose waveforms state their clock; one channel has dropouts as zeros."""
    from nptdms import ChannelObject, TdmsWriter

    files = []
    for run in campaign.runs:
        columns = table_of(run, {name: 1.0 for name in run.inputs} | {"": 1e6})
        columns["spy"] = columns["spy"].copy()
        largest = int(np.argmax(np.abs(columns["spy"])))
        columns["spy"][largest : largest + 3] = 0.0
        facts = {"wf_increment": float(run.time[1] - run.time[0]), "wf_start_offset": 0.0}
        units = {"torque": "N*m", "speed": "rad/s", "carrier_angle": "rad"}
        units |= dict.fromkeys(("ntl_y", "ntl_z"), "N")
        path = folder / f"{run.name}.tdms"
        with TdmsWriter(path) as writer:
            writer.write_segment(
                [
                    ChannelObject(
                        "rig", name, values, facts | {"unit_string": units.get(name, "um")}
                    )
                    for name, values in columns.items()
                ]
            )
        files.append(path)
    return files


def _element_columns(run):
    (drive,) = run.inputs.values() if run.inputs else (None,)
    (channel,) = run.signals.values()
    return drive, channel


def labview_element(campaign, folder):
    """Tabs and commas, a long preamble, kN and mm, lost rows."""
    files = []
    for run in campaign.runs:
        force, motion = _element_columns(run)
        head = ["LabVIEW Measurement", "Writer_Version\t2", "Separator\tTab", "***End_of_Header***"]
        head += ["", "Zeit\tKraft\tWeg", "[s]\t[kN]\t[mm]"]
        cells = [numbers(run.time, 3), numbers(force * 1e-3, 9), numbers(motion * 1e3, 7)]
        path = folder / f"{run.name}.lvm"
        lines = head + text_rows(cells, "\t", comma=True, lost=LOST)
        path.write_text("\n".join(lines), encoding="utf-8")
        files.append(path)
    return files


def american_element(campaign, folder):
    """Dates of the month first with AM and PM, force in lbf, motion in mils."""
    files = []
    for run in campaign.runs:
        force, motion = _element_columns(run)
        dates = [
            (START + timedelta(seconds=float(t))).strftime("%m/%d/%Y %I:%M:%S.%f %p")
            for t in run.time
        ]
        cells = [dates, numbers(force / 4.4482216152605, 8), numbers(motion / 2.54e-5, 5)]
        lines = ["Date,Load (lbf),Stroke (mils)", *text_rows(cells, ",")]
        path = folder / f"{run.name}.csv"
        path.write_text("\n".join(lines))
        files.append(path)
    return files


def blank_element(campaign, folder):
    """Columns apart by blanks below a comment, a stretch that stands still."""
    files = []
    for run in campaign.runs:
        force, motion = _element_columns(run)
        cells = [numbers(run.time, 4), numbers(force, 6), numbers(motion * 1e6, 4)]
        cells[2][700:712] = [cells[2][700]] * 12
        lines = ["# t_s  F_N  x_um", *("  " + row for row in text_rows(cells, "   "))]
        path = folder / f"{run.name}.dat"
        path.write_text("\n".join(lines))
        files.append(path)
    return files


def mat73_element(campaign, folder):
    """MAT 7.3: rows of a matrix, 512 bytes of MATLAB's before the HDF5 file."""
    files = []
    for run in campaign.runs:
        force, motion = _element_columns(run)
        path = folder / f"{run.name}.mat"
        with h5py.File(path, "w", userblock_size=512) as file:
            for name, values in (("t", run.time), ("force_N", force), ("disp_mm", motion * 1e3)):
                file[name] = values.reshape(1, -1)
        files.append(path)
    return files


def parquet_element(campaign, folder):
    """Parquet in single precision with nulls, micrometres."""
    files = []
    for run in campaign.runs:
        force, motion = _element_columns(run)
        values = [None if 300 <= k < 304 else float(v) for k, v in enumerate(motion * 1e6)]
        table = pa.table(
            {
                "time (s)": run.time,
                "force (N)": pa.array(force, pa.float32()),
                "displacement (um)": pa.array(values, pa.float32()),
            }
        )
        path = folder / f"{run.name}.parquet"
        pa_parquet.write_table(table, path)
        files.append(path)
    return files


def overloaded_element(campaign, folder):
    """UTF-8 with a mark, bars, words in place of numbers, milliseconds without a unit."""
    files = []
    for run in campaign.runs:
        motion, force = _element_columns(run)
        cells = [numbers(run.time * 1e3, 1), numbers(motion * 1e3, 12), numbers(force, 6)]
        cells[2][500:503] = ["OVERLOAD"] * 3
        lines = ["time|disp/mm|force/N", *text_rows(cells, "|")]
        path = folder / f"{run.name}.csv"
        path.write_text("\r\n".join(lines), encoding="utf-8-sig")
        files.append(path)
    return files


CARRIER = {"nominal_torque": "360e3", "sensor_radius": "0.412"}
LOGGERS = {
    "german carrier": Logger("carrier", german_carrier, 1e-6),
    "dated carrier": Logger(
        "carrier",
        dated_carrier,
        1e-3,
        {"pulses_per_turn": "4096", "# wraps_at": "wraps_at = 16384"},
    ),
    "carrier of two clocks": Logger("carrier", two_clocks_carrier, 1e-6),
    "windows mounting": Logger("mounting", windows_mounting, 1e-6),
    "mat mounting": Logger(
        "mounting",
        mat_mounting,
        1e-3,
        {"# factor": "factor = -1.0"},
        units={"speed": "rad/s", "ntl_y": "N", "ntl_z": "N"},
    ),
    "tdms mounting": Logger("mounting", tdms_mounting, 1e-6),
    "labview element": Logger("element", labview_element, 1e-3),
    "american element": Logger("element", american_element, 2.54e-5),
    "blank element": Logger("element", blank_element, 1e-6),
    "mat 7.3 element": Logger("element", mat73_element, 1e-3),
    "parquet element": Logger("element", parquet_element, 1e-6),
    "overloaded element": Logger("element", overloaded_element, 1.0, simulated_by="displacement"),
}


def edited(text, logger, campaign):
    """Map as a user leaves it: every '?' told, the noise and the rig's facts given."""
    facts = {**CARRIER, **logger.edits}
    if logger.kind == "mounting":
        facts |= {name: repr(value) for name, value in campaign.rig.items()}
    for name, value in facts.items():
        if name.startswith("#"):
            text = re.sub(rf"^{name} = .*$", value, text, flags=re.MULTILINE)
        else:
            text = re.sub(rf'^{name} = "\?"', f"{name} = {value}", text, flags=re.MULTILINE)
    for name, unit in logger.units.items():
        text = re.sub(rf'(name = "{name}"\ncolumn = .*\nunit = )"\?"', rf'\1"{unit}"', text)
    noise = campaign.channels[0].noise_std / logger.factor
    text = re.sub("^# noise_std = .*$", f"noise_std = {noise!r}", text, flags=re.MULTILINE)
    if logger.kind == "element":
        rig = {name: value for name, value in campaign.rig.items() if name != "drive"}
        lines = [f"{name} = {str(value).lower()}" for name, value in rig.items()]
        text = re.sub(r"^# mass = .*$", "\n".join(lines), text, flags=re.MULTILINE)
    return text
