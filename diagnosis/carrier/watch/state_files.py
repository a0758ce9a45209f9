"""State of a watch as one file: numbers bit for bit, no code in it; a watch goes on from it."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.carrier.watch.change_test import DetectorState, RevolutionNoise
from carrierflex.diagnosis.carrier.watch.rim_revolutions import RimBaseline
from carrierflex.diagnosis.carrier.watch.turbine_watch import Alarm, TurbineWatch, WatchOptions
from carrierflex.files.archives import DAMAGED_ARCHIVE
from carrierflex.files.json_files import plain
from carrierflex.files.shown_values import shortened, shown
from carrierflex.files.whole_files import whole_file

Array = NDArray[Any]

FORMAT, VERSION = "carrierflex-watch-state", 1
#: Numbers of the state that are no arrays.
_NUMBERS = ("position", "floor", "threshold", "revolutions_a_day")
_COUNTS = ("n_revolutions", "n_omitted", "n_needed", "n_recent")
#: What a damaged file raises.
_BAD = (*DAMAGED_ARCHIVE, ValueError, TypeError, ArithmeticError, RuntimeError, MemoryError)


def write_state(path: Path, watch: TurbineWatch, key: str) -> None:
    """Write the state, whole or not at all; `key` says of what baseline and options it is."""
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

    ValueError where the file is no state, damaged, of a newer version, or of another baseline or
    other options.
    """
    expected = (
        "expected the file that carrierflex watch wrote: move it, or choose another folder by --out"
    )
    try:
        with path.open("rb") as opened, np.load(opened, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        header = json.loads(str(arrays["header"]))
        stated = header["format"], header["version"], header["key"]
    except _BAD as error:
        raise ValueError(
            f"{path}: is no state of a watch ({_reason(error)}); {expected}"
        ) from error
    if stated[:2] != (FORMAT, VERSION):
        raise ValueError(
            f"{path}: is {shown(stated[0])} of version {shown(stated[1])}; expected '{FORMAT}' of "
            f"version {VERSION}: continue with the version of carrierflex that wrote it, or choose "
            "another folder by --out"
        )
    if stated[2] != key:
        raise ValueError(
            f"{path}: is of a watch with another baseline or other options; expected the same "
            "--baseline and options, or another folder by --out"
        )
    try:
        return _watch(arrays, header, TurbineWatch(baseline, options))
    except _BAD as error:
        raise ValueError(f"{path}: is damaged ({_reason(error)}); {expected}") from error


def _reason(error: Exception) -> str:
    return shortened(" ".join(str(error).split()), 200)


def _watch(
    arrays: Mapping[str, Array], header: Mapping[str, Any], watch: TurbineWatch
) -> TurbineWatch:
    """A new watch with all that the file holds."""
    from pydantic import TypeAdapter

    def like(name: str, other: Array) -> Array:
        value = arrays[name]
        if (value.shape, value.dtype) != (other.shape, other.dtype):
            raise ValueError(
                f"{name} is {value.dtype} of shape {value.shape}; expected {other.dtype} of shape "
                f"{other.shape}"
            )
        return value

    numbers = like("numbers", np.zeros(len(_NUMBERS)))
    for name, value in zip(_NUMBERS, numbers.tolist(), strict=True):
        setattr(watch, name, value)
    for name in _COUNTS:
        if not isinstance(header[name], int) or header[name] < 0:
            raise ValueError(f"{name} is {shown(header[name])}; expected a whole number")
        setattr(watch, name, header[name])
    watch.file = str(header["file"])
    watch.silent, watch.masked = like("silent", watch.silent), like("masked", watch.masked)
    watch.recent = {name: like(f"recent_{name}", values) for name, values in watch.recent.items()}
    if "noise_mean" in arrays:
        p, C = watch.baseline.shape
        noise = RevolutionNoise(np.zeros((p, C)), np.zeros(p), np.zeros((p, C, C)))
        watch.noise = RevolutionNoise(
            **{name: like(f"noise_{name}", of) for name, of in vars(noise).items()}
        )
        state = watch.test.begin()
        watch.state = DetectorState(
            **{name: like(f"state_{name}", of) for name, of in vars(state).items()}
        )
    watch.alarms = TypeAdapter(list[Alarm]).validate_python(header["alarms"])
    return watch
