"""Motion beside the shaft's orders, as the report and the verdict know it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated


@dataclass(frozen=True, eq=False)
class OffOrderMotion:
    """A line or a band beside the shaft's orders."""

    id: Annotated[
        str,
        "Class: ``nonsynchronous/0.47X``, or ``channel/0.47X`` where one channel alone shows it",
    ]
    label: Annotated[
        str,
        "Its strongest line: ``0.47X`` where it keeps its order, ``0.83Hz`` where its frequency",
    ]
    channels: Annotated[tuple[str, ...], "Channels that show it"]
    runs: Annotated[tuple[str, ...], "Runs that show it"]
    is_in_every_run: Annotated[bool, "Whether these are all runs"]
    band_hz: Annotated[tuple[float, float], "Lowest and highest frequency over lines and runs [Hz]"]
    mean_square: Annotated[Mapping[str, float], "Mean square over the channels by run"]
    explained: Annotated[float, "Share of its power that amplitudes fitted to other turns predict"]
    p_value: Annotated[float, "Probability that noise makes it anywhere in the records"]
