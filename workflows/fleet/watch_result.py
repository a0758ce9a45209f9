"""What a watch has seen so far: of its document, its page and the screen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal

if TYPE_CHECKING:
    from carrierflex.diagnosis.carrier.watch.turbine_watch import Alarm


@dataclass(frozen=True, eq=False)
class WatchResult:
    """What a watch has seen."""

    source: Annotated[str, "Where the samples come from"]
    turbine: Annotated[str, "Name of the diagnosed campaign"]
    state: Annotated[Literal["learning", "watching", "new reference"], "What the watch does now"]
    revolutions: Annotated[int, "Whole revolutions"]
    omitted: Annotated[int, "Stretches between revolutions that are no whole turn"]
    position: Annotated[float | None, "Time of the last sample that was used [s]"]
    file: Annotated[str, "File of that sample; empty of standard input"]
    floor: Annotated[float | None, "Noise floor of the learning period, RMS [m]"]
    dead_band: Annotated[float | None, "Size of a change below which there is no alarm [m]"]
    threshold: Annotated[float | None, "h: evidence (natural logarithm) that raises an alarm"]
    run_length: Annotated[float | None, "Least mean revolutions between two false alarms, exp(h)"]
    deviation: Annotated[float | None, "Deviation of the last 12 revolutions, RMS [m]"]
    silent: Annotated[Sequence[str], "Channels that are constant or missing"]
    alarms: Annotated[Sequence[Alarm], "Alarms, the first one first"]
    lines: Annotated[Sequence[str], "The same in one line each"]
