"""Watch of one turbine, revolution by revolution: learning, test, alarm, new reference.

After the learning period every revolution is compared with it. An alarm names the change; the
revolutions after it become the new reference, so that a further change is a further alarm.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated, Literal

import numpy as np
from scipy.constants import day, hour

from carrierflex.diagnosis.carrier.watch.change_class import ChangeClass, named_change
from carrierflex.diagnosis.carrier.watch.change_test import (
    ChangeTest,
    DetectorState,
    RevolutionNoise,
    change_point,
    learned_noise,
    threshold_of,
)
from carrierflex.diagnosis.carrier.watch.rim_revolutions import Revolution, RimBaseline
from carrierflex.diagnosis.comparison.problem import BoolArray, FloatArray, IntArray
from carrierflex.identification.estimation.resampling import NORMAL_95

#: Revolutions after an alarm that become the new reference.
SETTLING = 50
#: Revolutions in a row in which a channel is silent before it is reported, or reads again.
_SILENT = 3
#: Revolutions that are kept for the change point at least.
_RECENT = 256
#: Change of the mean torque, over nominal, or of the radial load, over the torque's force at the
#: sensor circle, that is another load.
_OTHER_LOAD = 0.1
READS_AGAIN: Literal["channel_reads_again"] = "channel_reads_again"


@dataclass(frozen=True)
class WatchOptions:
    """What decides an alarm."""

    learn: int = 200  # Revolutions of the learning period
    least: float = 1.0  # Smallest change that is looked for, in noise floors: the dead band
    false_alarms: float = 1e-3  # Mean number of false alarms a turbine-day
    #: Drift of the offset of all axial channels that is followed [noise floors an hour]
    drift: float = 5.0
    #: What the diagnosed baseline leaves above the noise [m]: no change below it is looked for
    remaining: float = 0.0


@dataclass(frozen=True, eq=False)
class Regime:
    """Loads and speed over some revolutions."""

    torque: Annotated[float, "Mean torque over nominal"]
    torque_range: Annotated[Sequence[float], "Least and largest torque over nominal"]
    radial_load: Annotated[float, "Mean radial load [N]"]
    speed_rpm: Annotated[float, "Mean speed [rpm]"]
    speed_range_rpm: Annotated[Sequence[float], "Least and largest speed [rpm]"]


@dataclass(frozen=True, eq=False, kw_only=True)
class Alarm:
    """One alarm."""

    kind: Annotated[
        Literal["change", "silent_channel", "channel_reads_again"],
        "Change of the signals, or of whether a channel reads",
    ]
    revolution: Annotated[int, "Number of the revolution that raised it, from 1"]
    since: Annotated[int, "Number of the first revolution after the change"]
    file: Annotated[str, "File that it was raised in; empty of standard input"]
    time: Annotated[float, "End of the revolution that raised it [s]"]
    since_time: Annotated[float, "Begin of the first revolution after the change [s]"]
    change: Annotated[ChangeClass | None, "What the change is of; null of a silent channel"] = None
    size: Annotated[float | None, "RMS of the change over channels and turn [m]"] = None
    size_ci95: Annotated[Sequence[float] | None, "95 % interval of the size [m]"] = None
    floors: Annotated[float | None, "Size over the noise floor"] = None
    channels: Annotated[Sequence[str], "Channels of a fault of the measurement"]
    regime: Annotated[Regime, "Loads and speed since the change"]
    before: Annotated[Regime, "Loads and speed of the revolutions before it"]
    is_other_load: Annotated[bool, "Whether the load changed with it"] = False
    evidence: Annotated[float | None, "ln of the evidence against no change"] = None


@dataclass
class TurbineWatch:
    """State of a watch; `take` is its only action."""

    baseline: RimBaseline  # What is predicted
    options: WatchOptions  # What decides an alarm
    n_revolutions: int = 0
    n_omitted: int = 0
    position: float = -np.inf
    file: str = ""
    floor: float = np.nan
    threshold: float = np.nan
    revolutions_a_day: float = np.nan
    #: Revolutions that the reference still needs; while it does there is no test.
    n_needed: int = field(default=0)
    alarms: list[Alarm] = field(default_factory=list)
    noise: RevolutionNoise | None = None
    state: DetectorState | None = None
    silent: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    masked: BoolArray = field(default_factory=lambda: np.zeros(0, dtype=np.bool_))
    recent: dict[str, FloatArray] = field(default_factory=dict)
    n_recent: int = 0

    def __post_init__(self) -> None:
        p, C = self.baseline.shape
        if not self.recent:
            n = max(_RECENT, self.options.learn)
            shapes = {"residual": (p, C), "predicted": (p, C), "scatter": (C,)}
            shapes |= {"loads": (4,), "times": (2,)}
            self.recent = {name: np.zeros((n, *shape)) for name, shape in shapes.items()}
            self.silent = np.zeros(C, dtype=np.int64)
            self.masked = np.zeros(C, dtype=np.bool_)
            self.n_needed = self.options.learn

    @property
    def is_learning(self) -> bool:
        """Whether the noise is not known yet."""
        return self.noise is None

    def take(self, columns: Mapping[str, FloatArray], file: str = "") -> Alarm | None:
        """Take the samples of the next turn, which ends in a file; the alarm that it raises."""
        self.position, self.file = float(columns["time"][-1]), file
        revolution = self.baseline.revolution(columns)
        if revolution is None:
            self.n_omitted += 1
            self._forget_last()
            return None
        self.n_revolutions += 1
        alarm = self._silence(revolution)
        self._remember(revolution)
        if alarm is not None or (revolution.is_silent & ~self.masked).any():
            self._forget_last()
        elif self.n_needed:
            self._learned()
        else:
            alarm = self._tested(revolution)
        if alarm is not None:
            self.alarms.append(alarm)
        return alarm

    def _forget_last(self) -> None:
        """After a gap there is no revolution before."""
        if self.state is not None:
            self.state = replace(self.state, last=np.full_like(self.state.last, np.nan))

    def _remember(self, one: Revolution) -> None:
        """Put a revolution among the last ones, unless a channel has just fallen silent in it."""
        if (one.is_silent & ~self.masked).any():
            return
        values = vars(one) | {"times": (one.start, one.end)}
        for name, rows in self.recent.items():
            rows[self.n_recent % len(rows)] = values[name]
        self.n_recent += 1

    def _last(self, name: str, n: int) -> FloatArray:
        """Values of the last n revolutions, the oldest first."""
        size = len(self.recent[name])
        n = min(n, self.n_recent, size)
        return self.recent[name][np.arange(self.n_recent - n, self.n_recent) % size]

    def _silence(self, one: Revolution) -> Alarm | None:
        """Alarm of channels that are silent for three revolutions, or read again."""
        changed = one.is_silent != self.masked
        self.silent = np.where(changed, self.silent + 1, 0)
        turned = self.silent >= _SILENT
        if not turned.any():
            return None
        self.masked = np.where(turned, one.is_silent, self.masked)
        self.silent = np.where(turned, 0, self.silent)
        is_silent = bool(one.is_silent[turned].any())
        if self.is_learning or not is_silent:
            # A channel is another one, or is missing from now on.
            self.noise, self.state = None, None
            self.n_needed = self.options.learn
        return Alarm(
            kind="silent_channel" if is_silent else READS_AGAIN,
            revolution=self.n_revolutions,
            since=self.n_revolutions - _SILENT + 1,
            file=self.file,
            time=one.end,
            since_time=one.start - (_SILENT - 1) * 2.0 * np.pi / one.loads[3],
            channels=[self.baseline.channels[c].name for c in np.flatnonzero(turned)],
            regime=self._regime(one.loads[None], one.loads),
            before=self._regime(self._last("loads", SETTLING), one.loads),
        )

    def _learned(self) -> None:
        """Count a revolution of the reference; with the last of them the test begins."""
        self.n_needed -= 1
        if self.n_needed:
            return
        if self.noise is None:
            vectors = self._last("residual", self.options.learn)
            self.noise = learned_noise(vectors)
            scatter = self._last("scatter", self.options.learn)[:, ~self.masked].mean()
            about = np.mean(np.sum((vectors - self.noise.mean) ** 2, axis=(1, 2)))
            self.floor = float(np.sqrt(scatter + about))
            times = self._last("times", self.options.learn)
            seconds = float(np.mean(times[:, 1] - times[:, 0]))
            self.revolutions_a_day = day / seconds
            self.threshold = threshold_of(self.revolutions_a_day, self.options.false_alarms)
        else:
            self.noise = replace(self.noise, mean=self._last("residual", SETTLING).mean(axis=0))
        self.state = self.test.begin()

    @property
    def dead_band(self) -> float:
        """Size of a change below which there is no alarm [m]."""
        return max(self.options.least * self.floor, self.options.remaining)

    @property
    def test(self) -> ChangeTest:
        """The test of this turbine."""
        assert self.noise is not None
        drift = self.options.drift * self.floor
        drift *= day / self.revolutions_a_day / hour
        return ChangeTest(
            memory=self.noise.memory[None],
            covariance=self.noise.covariance[None],
            dead_band=np.array([self.dead_band]),
            threshold=self.threshold,
            nuisance=self.common_offset,
            drift=np.array([drift]),
        )

    @property
    def common_offset(self) -> FloatArray:
        """Unit vector of the offset of all axial channels, shape (p, C)."""
        result = np.zeros(self.baseline.shape)
        result[0] = [channel.quantity == "axial_displacement" for channel in self.baseline.channels]
        return result / max(float(np.linalg.norm(result)), 1.0)

    def _reference(self) -> FloatArray:
        """Mean vector without a change, shape (p, C)."""
        assert self.noise is not None
        assert self.state is not None
        return self.noise.mean + float(self.state.offset[0]) * self.common_offset

    def _tested(self, one: Revolution) -> Alarm | None:
        assert self.noise is not None
        assert self.state is not None
        reference = self._reference()
        deviation = np.where(self.masked, 0.0, one.residual - self.noise.mean)
        self.state = self.test.advanced(self.state, deviation[None])
        if self.state.evidence[0] < self.threshold:
            return None
        alarm = self._alarm(one, reference, float(self.state.evidence[0]))
        # The next revolutions are the new reference.
        self.n_needed = SETTLING
        return alarm

    def _alarm(self, one: Revolution, reference: FloatArray, evidence: float) -> Alarm:
        """Change point, size, class and regime of a change."""
        assert self.noise is not None
        assert self.state is not None
        window = int(np.argmax(self.state.sums[0]))
        d = self.state.estimate[0, window]
        size = float(np.linalg.norm(d))
        residual = np.where(self.masked, 0.0, self._last("residual", _RECENT) - reference)
        first = change_point(residual, d / size, size)
        n = len(residual) - first
        change = residual[first:].mean(axis=0)
        size = float(np.linalg.norm(change))
        std = float(np.sqrt(self.noise.variance_along(change / size, n)))
        loads = self._last("loads", n)
        expected = reference + self._last("predicted", n).mean(axis=0)
        what = named_change(change, n, self.noise, self.baseline, expected, loads.mean(axis=0))
        before = self._regime(self._last("loads", n + SETTLING)[:-n], one.loads)
        after = self._regime(loads, one.loads)
        largest = max(after.radial_load, before.radial_load)
        return Alarm(
            kind="change",
            revolution=self.n_revolutions,
            since=self.n_revolutions - n + 1,
            file=self.file,
            time=one.end,
            since_time=float(self._last("times", n)[0, 0]),
            change=what,
            size=size,
            size_ci95=(max(size - NORMAL_95 * std, 0.0), size + NORMAL_95 * std),
            floors=size / self.floor,
            channels=what.channels,
            regime=after,
            before=before,
            is_other_load=abs(after.torque - before.torque) > _OTHER_LOAD
            or abs(after.radial_load - before.radial_load) > _OTHER_LOAD * largest,
            evidence=evidence,
        )

    def deviations(self, n: int = 12) -> FloatArray:
        """RMS of the mean deviation of n revolutions, up to each of the last ones [m].

        Empty while the reference is learnt.
        """
        if self.state is None or self.n_needed or self.n_recent < n:
            return np.zeros(0)
        x = np.where(self.masked, 0.0, self._last("residual", _RECENT) - self._reference())
        sums = np.cumsum(np.concatenate([np.zeros_like(x[:1]), x]), axis=0)
        return np.asarray(np.linalg.norm((sums[n:] - sums[:-n]) / n, axis=(1, 2)))

    def _regime(self, loads: FloatArray, present: FloatArray) -> Regime:
        """Regime of some revolutions; of the present one where there are none."""
        loads = loads if len(loads) else present[None]
        torque = loads[:, 0] / self.baseline.rig.nominal_torque
        rpm = loads[:, 3] * 30.0 / np.pi
        return Regime(
            torque=float(torque.mean()),
            torque_range=(float(torque.min()), float(torque.max())),
            radial_load=float(np.hypot(loads[:, 1], loads[:, 2]).mean()),
            speed_rpm=float(rpm.mean()),
            speed_range_rpm=(float(rpm.min()), float(rpm.max())),
        )
