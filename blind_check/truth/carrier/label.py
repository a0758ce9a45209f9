"""What a label says of a carrier.

True values by the names of the contract, and the largest cell of the gap.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from carrierflex.blind_check.truth.carrier.rig import SENSOR_ANGLES, SENSOR_NAMES, CarrierState
from carrierflex.blind_check.truth.carrier.signals import WAVE_ORDERS, RimRecord

FloatArray = NDArray[np.float64]


def named_parameters(name: str, state: CarrierState) -> dict[str, float]:
    """True values by the names of diagnosis.json.

    Those of sensors end with their channel, waves that are not there are zero.
    """
    sensors = {
        "sensor_gain": ("g", state.gain),
        "sensor_angle": ("dv", state.turned),
        "sensor_zero": ("z", state.zero),
    }
    if name in sensors:
        symbol, values = sensors[name]
        place = int(np.argmax(np.abs(values)))
        return {f"{symbol}_{SENSOR_NAMES[place]}": float(values[place])}
    if name == "sensor_delay":
        return {"tau": state.delay}
    waves = (
        {f"{part}_{order}": 0.0 for order in WAVE_ORDERS for part in ("a", "b")}
        if name == "face_runout"
        else {}
    )
    return {own: float(value) for own, value in {**waves, **state.effects[name]}.items()}


def largest_cell(gap: Sequence[FloatArray], records: Sequence[RimRecord]) -> dict[str, float | str]:
    """Run, order and pattern of the largest part of the gap.

    ``A_m(n) = 1/4 sum_i Y_i(n) exp(j m v_i)`` with Y_i(n) the part of channel i at n times the
    carrier angle.

    Parameters
    ----------
    gap : sequence of ndarray, shape (4, n)
        Signals of the gap.
    records : sequence of RimRecord
        Runs with the carrier angle.

    Returns
    -------
    dict
        ``run``, ``order``, ``channel_pattern`` (static tilts are "m=+1").
    """
    best, found = -1.0, dict[str, float | str]()
    for signal, record in zip(gap, records, strict=True):
        for order in range(9):
            turned = np.exp(-1j * order * record.angle)
            amplitude = signal @ turned / record.time.size * (2.0 if order else 1.0)
            for m, text in ((0, "m=0"), (1, "m=+1"), (-1, "m=-1"), (2, "m=2")):
                if order == 0 and m == -1:
                    continue  # the conjugate of m = +1
                size = abs(np.mean(amplitude * np.exp(1j * m * SENSOR_ANGLES))) ** 2 * (
                    0.5 if order else 2.0 if m == 1 else 1.0
                )
                if size > best:
                    best, found = (
                        size,
                        {"run": f"run{record.number + 1}", "order": order, "channel_pattern": text},
                    )
    return found
