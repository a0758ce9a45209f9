"""Motion beside the shaft's orders, as the report and the verdict know it."""

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True, eq=False)
class OffOrderMotion:
    """A line or a band beside the shaft's orders.

    Parameters
    ----------
    id : str
        Class: ``nonsynchronous/0.47X``, or ``channel/0.47X`` where one channel alone shows it.
    label : str
        Its strongest line: ``0.47X`` where it keeps its order, ``0.83Hz`` where its frequency.
    channels, runs : tuple of str
        Where it shows.
    is_in_every_run : bool
        Whether these are all runs.
    band_hz : tuple of float
        Lowest and highest frequency over lines and runs [Hz].
    mean_square : mapping of str to float
        Mean square over the channels by run.
    explained : float
        Share of its power that amplitudes fitted to other turns predict.
    p_value : float
        Probability that noise makes it anywhere in the records.
    """

    id: str
    label: str
    channels: tuple[str, ...]
    runs: tuple[str, ...]
    is_in_every_run: bool
    band_hz: tuple[float, float]
    mean_square: Mapping[str, float]
    explained: float
    p_value: float
