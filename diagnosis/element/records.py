"""One run of an element campaign, prepared once: motion, drive, blocks and bands."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.element_drive import drive_and_response
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign.signals import (
    band_end,
    band_limited,
    even_time,
    flat_end,
    trusted_frequency,
)
from carrierflex.identification.campaign_check.sample_statistics import quantisation_step
from carrierflex.identification.estimation.free_decay import released_motion
from carrierflex.simulation.element.drives import BASE, BY_FORCE, FREE_DECAY, PER_MASS

FloatArray = NDArray[np.float64]
#: Deflection, speed and acceleration.
Motion = tuple[FloatArray, FloatArray, FloatArray]

#: Blocks over all runs that the records are cut into, and samples a block holds at least.
BLOCKS = 24
_FEWEST_IN_BLOCK = 64
#: Periods of the usable band's end that a derivative needs on either side, and the share of a
#: record they may take at either end.
_EDGE_PERIODS, _LARGEST_EDGE = 10.0, 0.1
#: The same of a decay, which is largest where it begins; stretches in which its band is sought,
#: and samples of one at least.
_RELEASED_PERIODS = 1.0
_RELEASED_STRETCHES = 8
_FEWEST_IN_STRETCH = 64
#: Square of a step over the variance of values spread evenly over it.
_UNIFORM = 12.0


@dataclass(frozen=True, eq=False)
class ElementRecord:
    """One run on an even time grid."""

    #: name, condition: run and its condition
    name: str
    condition: str
    step: float  # Sampling interval [s]
    #: drive, response: input and channel, gaps filled, shape (n,)
    drive: FloatArray
    response: FloatArray
    counts: NDArray[np.bool_]  # Samples that are scored: measured and settled, shape (n,)
    block: NDArray[np.int64]  # Block of every sample; -1 where it does not count, shape (n,)
    #: Deflection, speed and acceleration in the trusted band, shape (n,)
    motion: Motion
    cutoff_hz: float  # End of the usable band
    period: int  # Samples a period; 0 where the drive is not periodic
    in_steady_state: bool  # Whether the record starts in the steady state of a periodic drive
    #: Measured less predicted where the baseline is another simulator's prediction, shape (n,)
    gap: FloatArray | None = None
    #: Displacement of the base where the channel reads the deflection in space; `response` is
    #: relative to it, shape (n,)
    base: FloatArray | None = None
    #: Variance of the noise of a measured force or deflection: declared, or of its steps
    drive_noise: float = 0.0
    #: noise, zero_noise: variance of the noise of the channel; its zero is not of the records
    noise: float = 0.0
    zero_noise: float = 0.0
    #: Deflection and speed at the first sample; None: those of `motion`
    start: tuple[float, float] | None = None

    @cached_property
    def n_blocks(self) -> int:
        """Number of blocks."""
        return int(self.block.max()) + 1

    @property
    def time(self) -> FloatArray:
        """Time from the first sample [s]."""
        return self.step * np.arange(self.response.size, dtype=np.float64)

    @property
    def measured_start(self) -> tuple[float, float]:
        """Deflection and speed of `motion` at the first sample."""
        return float(self.motion[0][0]), float(self.motion[1][0])

    @property
    def first_state(self) -> tuple[float, float]:
        """Deflection and speed at the first sample."""
        return self.measured_start if self.start is None else self.start

    @property
    def measured(self) -> FloatArray:
        """The response."""
        return self.response

    @property
    def is_measured(self) -> NDArray[np.bool_]:
        """Samples that are in a block."""
        return self.block >= 0

    @property
    def flat_hz(self) -> float:
        """Frequency [Hz] up to which the motion is known as it is."""
        return flat_end(self.cutoff_hz)

    @property
    def is_released(self) -> bool:
        """Whether nothing drives the element: a free decay."""
        return not self.drive.any() and self.base is None and self.gap is None

    def where_flat(self, forces: FloatArray) -> FloatArray:
        """Forces, shape (..., n), in the band where the motion is known as it is.

        Beyond it its noise is no longer below it, and the inertia's would fill the gap. A release
        is largest where it begins, and a second filter would ring there.
        """
        if self.is_released:
            return forces
        return band_limited(forces, self.step, self.flat_hz)

    def by_period(self, signal: NDArray[Any]) -> NDArray[Any] | None:
        """Signal by period, shape (n_periods, period); None where the drive has fewer than two."""
        if not self.period:
            return None
        first = int(np.argmax(self.counts))
        n_periods = (signal.size - first) // self.period
        if n_periods < 2:
            return None
        return signal[first : first + n_periods * self.period].reshape(n_periods, self.period)

    def within(self, trusted_hz: float) -> "ElementRecord":
        """Copy whose deflection under a force is trusted up to another frequency."""
        cutoff = band_end(trusted_hz, self.step)
        return replace(self, cutoff_hz=cutoff, motion=_motion(self.response, self.step, cutoff))

    def with_response(self, response: FloatArray) -> "ElementRecord":
        """Copy that measured another response (force drive: the motion follows)."""
        of = released_motion if self.is_released else _motion
        motion = of(response, self.step, self.cutoff_hz)
        return replace(self, response=response, motion=motion, gap=None)


def element_records(campaign: Campaign) -> tuple[ElementRecord, ...]:
    """Every run of an element campaign, prepared; refused where a signal is missing or constant."""
    channel = campaign.channels[0]
    runs = [run_in_use(run) for run in campaign.runs]
    for run in runs:
        for input_name, values in run.inputs.items():
            _refuse_empty(run, values, input_name)
        _refuse_empty(run, run.signals[channel.name], channel.name)
    n_blocks = max(2, min(12, round(BLOCKS / len(campaign.runs))))
    settle = int(campaign.rig.get("settle_samples", 0))
    return tuple(
        _record(
            run,
            campaign,
            n_blocks=n_blocks,
            settle=max(0, settle - int(np.searchsorted(measured.time, run.time[0]))),
        )
        for run, measured in zip(runs, campaign.runs, strict=True)
    )


def run_in_use(run: Run) -> Run:
    """Run from the first to the last sample that counts; between windows, signals are missing."""
    if not run.use:
        return run
    counted = np.flatnonzero(run.in_use)
    span = slice(int(counted[0]), int(counted[-1]) + 1)
    masked = run.within_use()
    return replace(
        run,
        time=run.time[span],
        inputs={name: values[span] for name, values in run.inputs.items()},
        signals={name: values[span] for name, values in masked.signals.items()},
        predictions={name: values[span] for name, values in masked.predictions.items()},
    )


def _refuse_empty(run: Run, values: FloatArray, name: str) -> None:
    present = values[np.isfinite(values)]
    if present.size < 2:
        raise ValueError(
            f"run {run.name}: column '{name}' holds {present.size} measured samples; "
            "expected a signal"
        )
    if present.std() == 0.0:
        raise ValueError(
            f"run {run.name}: column '{name}' is {present[0]} throughout; "
            "expected a signal that changes"
        )


def _record(run: Run, campaign: Campaign, *, n_blocks: int, settle: int) -> ElementRecord:
    rig = campaign.rig
    response = run.signals[campaign.channels[0].name]
    period = int(rig.get("period_samples", 0)) if rig.get("periodic") else 0
    even = even_time(run.time)
    measured = np.isfinite(response) if even is run.time else np.ones(even.size, dtype=bool)
    known = replace(run, time=even).in_use
    counts = measured & known & (np.arange(even.size) >= settle)
    if counts.sum() < 2 * _FEWEST_IN_BLOCK:
        raise ValueError(
            f"run {run.name}: {counts.sum()} measured samples after the first {settle} "
            f"('settle_samples'); expected at least {2 * _FEWEST_IN_BLOCK}"
        )
    record = prepared_record(
        (run.name, run.condition),
        float(even[-1] - even[0]) / (even.size - 1),
        *drive_and_response(run, campaign, even),
        by_force=rig["drive"] in BY_FORCE,
        counts=counts,
        known=known,
        period=period if settle + 2 * period <= even.size else 0,
        in_steady_state=bool(period) and settle == 0,
        n_blocks=n_blocks,
    )
    if rig["drive"] in PER_MASS:
        return record
    # The input is a measured force or deflection; a base or a release has no noise.
    name = next(iter(campaign.contract.inputs))
    declared = campaign.input_of(name).noise_std or 0.0
    return replace(record, drive_noise=max(declared**2, noise_of_steps(run.inputs[name])))


def noise_of_steps(values: FloatArray) -> float:
    """Variance of the rounding of a quantised signal, ``step² / 12``; zero of any other.

    References
    ----------
    .. [1] W. R. Bennett, "Spectra of quantized signals", Bell Syst. Tech. J. 27 (1948) 446.
    """
    return quantisation_step(values) ** 2 / _UNIFORM


def prepared_record(
    names: tuple[str, str],
    step: float,
    drive: FloatArray,
    response: FloatArray,
    base: FloatArray | None = None,
    *,
    by_force: bool,
    counts: NDArray[np.bool_],
    known: NDArray[np.bool_] | None = None,
    period: int = 0,
    in_steady_state: bool = False,
    n_blocks: int = 4,
) -> ElementRecord:
    """Record of evenly sampled signals.

    Fields as in :class:`ElementRecord`, `names` are run and condition; `known` are the samples in
    the windows that count, all of them by default.
    """
    deflection, force = (response, drive) if by_force else (drive, response)
    known = np.ones(counts.size, dtype=bool) if known is None else known
    changes = np.flatnonzero(np.diff(np.concatenate([[False], known, [False]]).astype(int)))
    spans = [slice(int(a), int(b)) for a, b in changes.reshape(-1, 2)]
    longest = max(spans, key=lambda span: span.stop - span.start)
    is_released = not force.any()
    pieces = [deflection[longest]]
    if is_released:
        # A decay is clear of its noise in the largest of its stretches.
        n = max(1, min(_RELEASED_STRETCHES, pieces[0].size // _FEWEST_IN_STRETCH))
        pieces = np.array_split(pieces[0], n)
    trusted = trusted_frequency(max(pieces, key=np.std), step, is_slow=is_released)
    cutoff = band_end(trusted, step)
    if not (by_force and period):
        # Derivatives are known away from the ends of what is known.
        edge = (_RELEASED_PERIODS if is_released else _EDGE_PERIODS) / (trusted * step)
        inner = np.zeros(counts.size, dtype=bool)
        for span in spans:
            most = int(_LARGEST_EDGE * (span.stop - span.start))
            left_out = min(int(np.ceil(edge)), most)
            inner[span.start + left_out : span.stop - left_out] = True
        counts = counts & inner
    return ElementRecord(
        name=names[0],
        condition=names[1],
        step=step,
        drive=drive,
        response=response,
        counts=counts,
        block=_blocks(counts, period, n_blocks),
        motion=(released_motion if is_released else _motion)(deflection, step, cutoff),
        cutoff_hz=cutoff,
        period=period,
        in_steady_state=in_steady_state,
        base=base,
    )


def _motion(deflection: FloatArray, step: float, cutoff: float) -> Motion:
    q, v, a = (band_limited(deflection, step, cutoff, derivative=order) for order in (0, 1, 2))
    return q, v, a


def _blocks(counts: NDArray[np.bool_], period: int, wanted: int) -> NDArray[np.int64]:
    """Cut from the first to the last sample that counts into blocks of like length."""
    counted = np.flatnonzero(counts)
    first, n = int(counted[0]), int(counted[-1] - counted[0]) + 1
    n_blocks = max(1, min(wanted, n // _FEWEST_IN_BLOCK))
    length = -(-n // n_blocks)
    if period and n // period >= n_blocks:
        length = max(1, (n // period) // n_blocks) * period
        n_blocks = max(1, n // length)
    position = np.minimum((counted - first) // length, n_blocks - 1)
    # A block that is missing throughout is no block.
    block = np.full(counts.size, -1)
    block[counted] = np.unique(position, return_inverse=True)[1]
    return block


def refuse_mixed_units(campaign: Campaign) -> None:
    """Refuse an analogue with one unit in SI: its parameters would have none that make sense."""
    if campaign.rig["drive"] == FREE_DECAY:
        return
    channel = campaign.channels[0]
    (input_name, expected), *_ = campaign.contract.inputs.items()
    declared = campaign.input_units[input_name]
    foreign = channel.unit != campaign.contract.quantities[channel.quantity]
    if campaign.rig["drive"] == BASE:
        base = channel.unit if input_name == "base_displacement" else f"{channel.unit}/s^2"
        if declared != base:
            raise ValueError(
                f"[[channels]]: unit of '{channel.name}' is {channel.unit} and that of the input "
                f"'{input_name}' is {declared}; expected {base} for the input"
            )
    elif foreign != (declared != expected):
        raise ValueError(
            f"[[channels]]: unit of '{channel.name}' is {channel.unit} and that of the input "
            f"'{input_name}' is {declared}; "
            "expected both in SI units, or both declared as an analogue"
        )
