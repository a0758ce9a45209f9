"""An error of the measurement as an explanation of the gap, and records beside their prediction."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.wiring.linear_records import LinearRecord
from carrierflex.identification.campaign.campaign import Campaign

FloatArray = NDArray[np.float64]

TORQUE_SIGN = "wiring/torque_sign"
SENSOR_ORDER = "wiring/sensor_order"
ANGLE_DIRECTION = "wiring/angle_direction"
CLOCK = "wiring/clock"
RUN_ORDER = "wiring/run_order"
INPUT_GAIN = "wiring/input_gain"
UNIT = "wiring/unit"
CLOCK_SHIFT = "wiring/clock_shift"


@dataclass(frozen=True)
class ClockDrift:
    """Signals that are later than the inputs, or ever later."""

    run: Annotated[str, "Run whose signals they are; empty for those of all runs"]
    delay: Annotated[float, "Delay in the middle of the run [s]"]
    growth: Annotated[float, "Growth of the delay over the run [s]"]


@dataclass(frozen=True)
class WiringRival:
    """The baseline refitted to a campaign whose wiring is corrected."""

    id: Annotated[str, "One of the ids above"]
    about: Annotated[str, "Input, channels or run that it is about"]
    text: Annotated[str, "What is corrected: ``the torque of the other sign``"]
    mean_square: Annotated[float, "Mean square that the refitted baseline leaves over all records"]
    line: Annotated[str, "File or key that it is about"]


@dataclass(frozen=True, eq=False)
class PredictedRecord:
    """Signals of one run and what the baseline predicts, shape (n, n_channels); NaN: missing."""

    run: str
    time: FloatArray
    measured: FloatArray
    predicted: FloatArray


@dataclass(frozen=True)
class WiringChecks:
    """What can be tried of a campaign's wiring."""

    rivals: Annotated[Callable[[], tuple[WiringRival, ...]], "``() -> tuple of WiringRival``"]
    predictions: Annotated[
        Callable[[FloatArray], tuple[PredictedRecord, ...]],
        "``(theta) -> tuple of PredictedRecord``, with the fitted parameters of the baseline; "
        "empty where the baseline is not the model's",
    ]
    refitted: Annotated[
        Callable[[Campaign], float],
        "``(campaign) -> mean square`` that the baseline leaves once it is fitted to another "
        "campaign with the same channels and inputs",
    ]
    linear: Annotated[
        Callable[[FloatArray], Iterable[LinearRecord]],
        "``(theta) -> records`` beside a baseline that can be made linear; none elsewhere",
    ] = lambda theta: ()
    late: Annotated[
        Callable[[], Sequence[ClockDrift]],
        "``() -> drifts``: first guesses of how late all signals, or those of one run, are, "
        "where the records tell it without a fit; none elsewhere",
    ] = lambda: ()
    unchecked: Annotated[
        str,
        "Why `predictions` are empty though the baseline is the model's; empty where they are not",
    ] = ""
