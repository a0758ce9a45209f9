"""What could be added to a mounting's campaign: load cases and minutes on the rig."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.inference.planning.results import LOADS, MINUTES, Addition, Costs
from carrierflex.diagnosis.mounting.records import MountingRecord
from carrierflex.simulation.mounting.inputs import MountingInputs

FloatArray = NDArray[np.float64]

#: Added records: step and length [s].
_STEP, _LENGTH = 0.05, 120.0
_SHARES, _FREQUENCIES = (0.25, 0.5, 1.0), (0.05, 1.0)
_FACTORS = (2.0, 4.0)


@dataclass(frozen=True, eq=False)
class MountingPool:
    """Records as planned, blank records of loads that could be added, and the additions.

    Parameters
    ----------
    records : tuple of MountingRecord
        Planned ones first.
    n_planned : int
        How many are planned.
    planned : Addition
        What is planned alone.
    additions : tuple of Addition
        What could be added.
    """

    records: tuple[MountingRecord, ...]
    n_planned: int
    planned: Addition
    additions: tuple[Addition, ...]


def mounting_pool(
    records: Sequence[MountingRecord],
    channels: tuple[str, ...],
    costs: Costs,
    *,
    torque: float,
    radial_load: float,
) -> MountingPool:
    """What could be added to a campaign of kind mounting.

    Parameters
    ----------
    records : sequence of MountingRecord
        Runs as planned.
    channels : tuple of str
        Their channels.
    costs : Costs
        Costs by sort.
    torque, radial_load : float
        Limits of the rig [N m], [N].

    Returns
    -------
    MountingPool
        Torque, vertical and sideways load as a sine of 0.05 or 1 Hz at a quarter, half and all of
        the limit, 120 s each; torque beside a constant load; all runs two and four times as long.
    """
    once = {record.name: 1.0 for record in records}
    time = _STEP * np.arange(round(_LENGTH / _STEP), dtype=np.float64)
    rise = np.asarray(np.clip((time - 5.0) / 10.0, 0.0, 1.0), dtype=np.float64)
    loads: dict[str, dict[str, FloatArray]] = {}
    for name, words, largest, unit in (
        ("torque", "torque", torque, "kN m"),
        ("ntl_z", "vertical load", radial_load, "kN"),
        ("ntl_y", "sideways load", radial_load, "kN"),
    ):
        for share in _SHARES:
            for frequency in _FREQUENCIES:
                wave = rise * np.sin(2.0 * np.pi * frequency * time)
                size = f"{share * largest / 1e3:g} {unit}"
                text = f"{words} alone, a sine of {frequency:g} Hz and {size}"
                loads[text] = {name: share * largest * wave}
    beside = 0.5 * torque * rise * (1.0 + 0.5 * np.sin(np.pi * time))
    for name, words in (("ntl_z", "vertical"), ("ntl_y", "sideways")):
        text = (
            f"torque of {0.5 * torque / 1e3:g} kN m with a sine of 0.5 Hz beside a constant "
            f"{words} load of {radial_load / 1e3:g} kN"
        )
        loads[text] = {"torque": beside, name: radial_load * rise}
    added = [_blank_record(records[0], text, time, own) for text, own in loads.items()]
    cost = costs.load_case + costs.minute * _LENGTH / 60.0
    additions = [
        Addition(LOADS, f"{text}, {_LENGTH:.0f} s", {**once, text: 1.0}, channels, cost)
        for text in loads
    ]
    whole = sum(record.inputs.time[-1] - record.inputs.time[0] for record in records) / 60.0
    for factor in _FACTORS:
        longer = {name: factor for name in once}
        own = costs.minute * (factor - 1.0) * float(whole)
        text = f"every run {factor:g} times as long"
        additions.append(Addition(MINUTES, text, longer, channels, own))
    planned = Addition(MINUTES, "as planned", once, channels, 0.0)
    return MountingPool((*records, *added), len(records), planned, tuple(additions))


def _blank_record(
    record: MountingRecord, name: str, time: FloatArray, loads: dict[str, FloatArray]
) -> MountingRecord:
    """Record under some loads without signals; its noise is that of the sensors at its step."""
    still = {
        own: np.zeros(time.size) for own in ("torque", "speed", "carrier_angle", "ntl_y", "ntl_z")
    }
    return replace(
        record,
        name=name,
        condition=name,
        inputs=MountingInputs.from_columns(time, {**still, **loads}),
        measured=np.zeros((time.size, record.measured.shape[1])),
        block=np.zeros(time.size, dtype=np.int64),
        noise=record.noise * record.step / _STEP,
    )
