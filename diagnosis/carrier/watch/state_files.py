"""State of a watch as one file: numbers bit for bit, no code in it; a watch goes on from it."""

import json
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from carrierflex.diagnosis.carrier.watch.change_class import ChangeClass
from carrierflex.diagnosis.carrier.watch.change_test import DetectorState, RevolutionNoise
from carrierflex.diagnosis.carrier.watch.rim_revolutions import RimBaseline
from carrierflex.diagnosis.carrier.watch.turbine_watch import (
    Alarm,
    Regime,
    TurbineWatch,
    WatchOptions,
)
from carrierflex.files.json_files import plain
from carrierflex.files.whole_files import whole_file

FORMAT, VERSION = "carrierflex-watch-state", 1
#: Numbers of the state that are no arrays.
_NUMBERS = ("position", "floor", "threshold", "revolutions_a_day")
_COUNTS = ("n_revolutions", "n_omitted", "n_needed", "n_recent")


def write_state(path: Path, watch: TurbineWatch, key: str) -> None:
    """Write the state, whole or not at all.

    Parameters
    ----------
    path : Path
        File (.npz).
    watch : TurbineWatch
        Watch.
    key : str
        What the watch is of: baseline and options.
    """
    header = {
        "format": FORMAT,
        "version": VERSION,
        "key": key,
        "file": watch.file,
        "alarms": plain(watch.alarms),
        **{name: int(getattr(watch, name)) for name in _COUNTS},
    }
    arrays: dict[str, Any] = {
        "header": np.array(json.dumps(header)),
        "numbers": np.array([getattr(watch, name) for name in _NUMBERS]),
        "silent": watch.silent,
        "masked": watch.masked,
        **{f"recent_{name}": values for name, values in watch.recent.items()},
    }
    for name, fields in (("noise", watch.noise), ("state", watch.state)):
        if fields is not None:
            arrays |= {f"{name}_{key}": value for key, value in vars(fields).items()}
    with whole_file(path) as file:
        np.savez(file, allow_pickle=False, **arrays)


def read_state(path: Path, baseline: RimBaseline, options: WatchOptions, key: str) -> TurbineWatch:
    """Watch as it was when its state was written.

    Raises
    ------
    ValueError
        Where the file is no state, of a newer version, or of another baseline or other options.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        header = json.loads(str(arrays["header"]))
        stated = header["format"], header["version"]
    except (OSError, ValueError, KeyError, TypeError, zipfile.BadZipFile) as error:
        raise ValueError(
            f"{path}: is no state of a watch ({' '.join(str(error).split())}); expected the file "
            "that carrierflex watch wrote: move it, or choose another folder by --out"
        ) from error
    if stated != (FORMAT, VERSION):
        raise ValueError(
            f"{path}: is '{stated[0]}' of version {stated[1]}; expected '{FORMAT}' of version "
            f"{VERSION}: continue with the version of carrierflex that wrote it, or choose another "
            "folder by --out"
        )
    if header["key"] != key:
        raise ValueError(
            f"{path}: is of a watch with another baseline or other options; expected the same "
            "--baseline and options, or another folder by --out"
        )
    watch = TurbineWatch(baseline, options)
    for name, value in zip(_NUMBERS, arrays["numbers"].tolist(), strict=True):
        setattr(watch, name, value)
    for name in _COUNTS:
        setattr(watch, name, header[name])
    watch.file = header["file"]
    watch.silent, watch.masked = arrays["silent"], arrays["masked"]
    watch.recent = {name: arrays[f"recent_{name}"] for name in watch.recent}
    if "noise_mean" in arrays:
        watch.noise = RevolutionNoise(**_fields(arrays, "noise_"))
    if "state_last" in arrays:
        watch.state = DetectorState(**_fields(arrays, "state_"))
    watch.alarms = [_alarm(one) for one in header["alarms"]]
    return watch


def _fields(arrays: Mapping[str, Any], prefix: str) -> dict[str, Any]:
    return {
        name.removeprefix(prefix): value
        for name, value in arrays.items()
        if name.startswith(prefix)
    }


def _alarm(fields: Mapping[str, Any]) -> Alarm:
    """Alarm of what JSON made of it."""
    what = fields["change"]
    return Alarm(
        **{
            **fields,
            "change": None if what is None else ChangeClass(**what),
            "regime": Regime(**fields["regime"]),
            "before": Regime(**fields["before"]),
        }
    )
