"""An error of the measurement as an explanation of the gap, and records beside their prediction."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

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
    """Signals that are later than the inputs, or ever later.

    Parameters
    ----------
    run : str
        Run whose signals they are; empty for those of all runs.
    delay : float
        Delay in the middle of the run [s].
    growth : float
        Growth of the delay over the run [s].
    """

    run: str
    delay: float
    growth: float


@dataclass(frozen=True)
class WiringRival:
    """The baseline refitted to a campaign whose wiring is corrected.

    Parameters
    ----------
    id : str
        One of the ids above.
    about : str
        Input, channels or run that it is about.
    text : str
        What is corrected: ``the torque of the other sign``.
    mean_square : float
        Mean square that the refitted baseline leaves over all records.
    line : str
        File or key that it is about.
    """

    id: str
    about: str
    text: str
    mean_square: float
    line: str


@dataclass(frozen=True, eq=False)
class PredictedRecord:
    """Signals of one run and what the baseline predicts, shape (n, n_channels); NaN: missing."""

    run: str
    time: FloatArray
    measured: FloatArray
    predicted: FloatArray


@dataclass(frozen=True)
class WiringChecks:
    """What can be tried of a campaign's wiring.

    Parameters
    ----------
    rivals : callable
        ``() -> tuple of WiringRival``.
    predictions : callable
        ``(theta) -> tuple of PredictedRecord``, with the fitted parameters of the baseline; empty
        where the baseline is not the model's.
    refitted : callable
        ``(campaign) -> mean square`` that the baseline leaves once it is fitted to another
        campaign with the same channels and inputs.
    linear : callable
        ``(theta) -> records`` beside a baseline that can be made linear; none elsewhere.
    late : callable
        ``() -> drifts``: first guesses of how late all signals, or those of one run, are, where the
        records tell it without a fit; none elsewhere.
    unchecked : str
        Why `predictions` are empty though the baseline is the model's; empty where they are not.
    """

    rivals: Callable[[], tuple[WiringRival, ...]]
    predictions: Callable[[FloatArray], tuple[PredictedRecord, ...]]
    refitted: Callable[[Campaign], float]
    linear: Callable[[FloatArray], Iterable[LinearRecord]] = lambda theta: ()
    late: Callable[[], Sequence[ClockDrift]] = lambda: ()
    unchecked: str = ""
