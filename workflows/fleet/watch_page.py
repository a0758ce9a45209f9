"""The live page of a watch and its lines.

One HTML file that loads itself again every half minute, without network.
"""

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from carrierflex.diagnosis.carrier.classes.answer import DELAY
from carrierflex.diagnosis.carrier.watch.change_class import (
    EXCHANGED,
    LOST,
    NO_CLASS,
    ONE_CHANNEL,
    REVERSED,
    ChangeClass,
)
from carrierflex.diagnosis.carrier.watch.turbine_watch import (
    READS_AGAIN,
    Alarm,
    Regime,
    TurbineWatch,
)
from carrierflex.diagnosis.comparison.effect_names import plain_name
from carrierflex.diagnosis.report.figures import BLUE, GREY, ORANGE, WIDTH, inline_svg
from carrierflex.diagnosis.report.page import rendered_page
from carrierflex.diagnosis.report.words import in_one_unit, listed
from carrierflex.files.quantities import number, sized
from carrierflex.files.versions import software_name
from carrierflex.workflows.fleet.watch_result import WatchResult

if TYPE_CHECKING:
    from matplotlib.figure import Figure


#: Words of faults of the measurement.
_FAULTS = {
    EXCHANGED: "exchanged signals",
    REVERSED: "a reversed signal",
    LOST: "a lost signal",
    ONE_CHANNEL: "a fault of one sensor",
    DELAY: "delay of all sensors",
}
#: What a class follows, in ids of a diagnosis.
_UNDETERMINED = "undetermined"
_MOST_ALARMS = 200


def watch_page(result: WatchResult, watch: TurbineWatch) -> str:
    """HTML text of a watch."""
    figures = []
    deviations = watch.deviations()
    if deviations.size:
        draw = partial(_deviation_figure, 1e6 * deviations, watch)
        figures.append(
            {
                "svg": inline_svg(draw, "deviation", "Deviation of the last revolutions"),
                "caption": (
                    "Deviation from the reference (the learning period, or what followed the last "
                    "alarm), RMS over channels and turn, mean of 12 revolutions. Orange: the dead "
                    "band; a lasting deviation above it is an alarm."
                ),
            }
        )
    content = {
        "result": result,
        "sentence": state_sentence(result),
        "figures": figures,
        "lines": list(reversed(result.lines))[:_MOST_ALARMS],
        "options": watch.options,
        "software": software_name(),
    }
    return rendered_page("watch.html.j2", content)


def state_sentence(result: WatchResult) -> str:
    """What the watch does, in one sentence."""
    position = "" if result.position is None else f", to {result.position:.0f} s"
    read = f"{result.revolutions} revolutions read{position}"
    if result.state == "learning":
        return f"Learning: {read}."
    n = len(result.alarms)
    alarms = "no alarm" if n == 0 else f"{n} alarm{'s' if n > 1 else ''}"
    doing = "Watching" if result.state == "watching" else "Taking a new reference"
    return f"{doing}: {alarms}; {read}."


def alarm_line(alarm: Alarm) -> str:
    """One line about an alarm: what, since when, how large, in which regime."""
    file = f"{alarm.file}, " if alarm.file else ""
    since = f"since revolution {alarm.since} ({file}{alarm.since_time:.1f} s)"
    regime = regime_words(alarm.regime)
    names = listed(list(alarm.channels))
    if alarm.change is None or alarm.size is None or alarm.size_ci95 is None:
        if alarm.kind == READS_AGAIN:
            return f"{names} reads again {since}; the noise is learnt anew"
        return (
            f"check the measurement: {names} is silent (constant or missing) {since}; {regime}; "
            "the watch goes on with the other channels"
        )
    texts, unit = in_one_unit([alarm.size, *alarm.size_ci95], "m")
    size = f"{texts[0]} {unit} [{texts[1]}, {texts[2]}], {number(alarm.floors or 0.0)} noise floors"
    other = (
        f"; the load changed with it (before: {regime_words(alarm.before)}): the baseline may not "
        "hold at this load"
        if alarm.is_other_load
        else ""
    )
    return f"{change_words(alarm.change)} {since}; {size}; {regime}{other}"


def change_words(change: ChangeClass) -> str:
    """What a change is of, with what cannot be distinguished from it."""
    if change.id == NO_CLASS:
        return (
            f"a change of no known class (the nearest explains {max(change.share, 0.0):.0%} of its "
            "mean square)"
        )
    words = _class_words(change.id)
    if change.effect and change.relative is not None:
        words += f": {plain_name(change.effect)} of the baseline, {change.relative:+.0%}"
    if change.channels:
        words += f" ({listed(list(change.channels))})"
    if change.ties:
        rivals = " or ".join(_class_words(name) for name in change.ties)
        words += f", or {rivals} (cannot be distinguished)"
    return f"check the measurement: {words}" if change.is_fault else words


def _class_words(name: str) -> str:
    """Class in words; what it follows is not known of one change."""
    return _FAULTS.get(name) or plain_name(f"{name}/{_UNDETERMINED}")


def regime_words(regime: Regime) -> str:
    """Loads and speed: ``98 % torque, radial load 141 kN, 22.0 rpm``."""
    low, high = regime.speed_range_rpm
    load = f", radial load {sized(regime.radial_load, 'N')}" if regime.radial_load else ""
    return f"{regime.torque:.0%} torque{load}, {low:.1f} to {high:.1f} rpm"


def _deviation_figure(deviations: "np.ndarray", watch: TurbineWatch) -> "Figure":
    """Deviation over the number of the revolution [um], with the dead band."""
    from matplotlib.figure import Figure

    last = watch.n_revolutions
    figure = Figure(figsize=(WIDTH, 2.2), layout="constrained")
    panel = figure.subplots()
    panel.plot(np.arange(last - deviations.size, last) + 1, deviations, color=BLUE, linewidth=1.2)
    panel.axhline(1e6 * watch.dead_band, color=ORANGE, linewidth=1.2)
    panel.axhline(1e6 * watch.floor, color=GREY, linewidth=0.8, linestyle=":")
    panel.set_ylim(bottom=0.0)
    panel.set_xlabel("revolution")
    panel.set_ylabel("deviation [µm]")
    panel.grid(alpha=0.25)
    return figure
