"""Readings spoilt sample by sample: off their time, noisier than declared, or of a noisy load.

- Samples that are read off their time by tau leave ``r = tau dy/dt``, white, whose square grows
  with the square of the slope: ``E r² = sigma² + sigma_tau² (dy/dt)²``.
- Noise of the load that the machine does not feel is passed on by the prediction: its spectrum S,
  seen above the drive's band, leaves ``|H|² S`` of the signal, with H from prediction and load.
"""

from collections.abc import Iterable, Iterator
from dataclasses import astuple, dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from carrierflex.diagnosis.wiring.linear_records import (
    FloatArray,
    LinearRecord,
    LoadAnswer,
    load_answers,
)
from carrierflex.diagnosis.wiring.refits import Fault, GapSquare, WiringRival
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.signals import mean_step
from carrierflex.identification.campaign_check.campaign_warning import (
    CampaignWarning,
    key_of,
    sample_of,
)
from carrierflex.identification.campaign_check.sample_statistics import neighbour_noise

ComplexArray = NDArray[np.complex128]

#: Correlation from sample to sample up to which a residual is white.
_WHITE = 0.3
#: Range of a mean square over the expected one.
_AS_EXPECTED = (0.8, 1.25)
#: Time over the step up to which samples are off.
_MOST_STEPS = 1.0
#: Share of the lines, the highest, in which noise of a load is measured.
_ABOVE_BAND = 0.25
#: Noise of a load over its RMS from which it is one, and from which it spoils any fit.
_LEAST_NOISE, _MUCH_NOISE = 0.01, 0.05
#: Share of a line's square that is noise from which the line is one of noise.
_IS_NOISE = 0.25
#: Share of what is predicted on such lines that the signal does not follow, noise and no load, and
#: that over its standard deviation.
_UNFOLLOWED, _SURE = 0.1, 2.0
#: Lines that are smoothed: noise seen through a resonance is that of few.
_SMOOTHED_LINES = 9


def jittered_samples(
    records: Iterable[LinearRecord], campaign: Campaign, gap: GapSquare
) -> Iterator[WiringRival]:
    """Samples read off their time, where the square of the gap follows that of the slope.

    None where the gap is not white, or is not nearly all of this form.
    """
    pairs: list[list[FloatArray]] = [[] for _ in campaign.channels]
    total = lagged = 0.0
    for record in records:
        known = np.isfinite(record.residual) & np.isfinite(record.slope)
        residual = np.where(known, record.residual, 0.0)
        total += float(np.sum(residual**2))
        lagged += float(np.sum(residual[1:] * residual[:-1]))
        for k, of_channel in enumerate(pairs):
            of_channel.append(np.array([residual[:, k], record.slope[:, k]])[:, known[:, k]])
    if not total > 0.0 or abs(lagged) > _WHITE * total:
        return
    squares = [np.concatenate(of_channel, axis=1) ** 2 for of_channel in pairs]
    r_square, s_square = np.concatenate(squares, axis=1)
    # Each channel has a noise of its own.
    spread = np.concatenate([slope - slope.mean() for _, slope in squares])
    variance = float(spread @ r_square) / max(float(spread @ spread), np.finfo(float).tiny)
    explained = variance * float(s_square.mean())
    step = mean_step(campaign.runs[0].time)
    low, high = _AS_EXPECTED
    if (
        0.0 < variance <= (_MOST_STEPS * step) ** 2
        and low <= explained / (gap.before - gap.floor) <= high
    ):
        names = ", ".join(one.name for one in campaign.channels)
        off = np.sqrt(3.0 * variance) / step
        text = f"samples of {names} read up to {off:.2g} steps off their time"
        square = max(gap.before - explained, gap.floor)
        yield WiringRival(Fault.JITTER, names, text, square, sample_of(campaign.runs[0].file, 0))


@dataclass(frozen=True)
class _PassedOn:
    """Noise of a load that the prediction passes on, summed over runs and channels."""

    share: float  # Square of the noise over that of the load
    n_runs: int  # Runs in which the load acts
    square: float  # Square of what is predicted of the noise, and remains
    unfollowed: float  # On lines of noise, what of the prediction the signal lacks
    variance: float  # Of `unfollowed`
    predicted: float  # Square of the prediction on these lines

    def __add__(self, other: "_PassedOn") -> "_PassedOn":
        return _PassedOn(*(sum(pair) for pair in zip(astuple(self), astuple(other), strict=True)))

    @property
    def noise(self) -> float:
        """Noise over the RMS of the load."""
        return float(np.sqrt(self.share / self.n_runs))

    @property
    def is_unfollowed(self) -> bool:
        """Whether the machine does not follow it: it is noise."""
        least = max(_UNFOLLOWED * self.predicted, _SURE * float(np.sqrt(self.variance)))
        return self.unfollowed > least


def noisy_load(
    records: Iterable[LinearRecord], campaign: Campaign, gap: GapSquare
) -> Iterator[WiringRival]:
    """Noise of a load, where the prediction passes on as much of it as the gap is large.

    None where the machine follows what the load has above its band: that is no noise.
    """
    runs = tuple(records)
    n_samples = sum(record.residual.size for record in runs)
    for name, passed_on in _passed_on_by_load(runs, campaign).items():
        square = passed_on.square / n_samples
        is_as_large = gap.before - square <= gap.half
        if passed_on.noise >= _LEAST_NOISE and is_as_large and passed_on.is_unfollowed:
            text = f"noise of {passed_on.noise:.0%} in the readings of {name}"
            remaining = max(gap.before - square, gap.floor)
            line = sample_of(campaign.runs[0].file, 0)
            yield WiringRival(Fault.LOAD_NOISE, name, text, remaining, line)


def unfollowed_loads(
    records: Iterable[LinearRecord], campaign: Campaign
) -> Iterator[CampaignWarning]:
    """So much noise of a load that a fit to it leaves more than the noise itself."""
    for name, passed_on in _passed_on_by_load(records, campaign).items():
        if passed_on.noise >= _MUCH_NOISE and passed_on.is_unfollowed:
            yield CampaignWarning(
                "load_noise",
                name,
                f"readings of {name} have noise of {passed_on.noise:.0%} (RMS): above the band of "
                "the drive the signals do not follow them",
                "filter the reading, or measure it with less noise: a model that follows the noise "
                "is fitted to it",
                passed_on.noise,
                sample_of(campaign.runs[0].file, 0),
                Fault.LOAD_NOISE,
            )


def _passed_on_by_load(records: Iterable[LinearRecord], campaign: Campaign) -> dict[str, _PassedOn]:
    """What the prediction passes on of the noise of every load."""
    runs = {run.name: run for run in campaign.runs}
    of_load: dict[str, _PassedOn] = {}
    for record in records:
        residual = np.where(np.isfinite(record.residual), record.residual, 0.0)
        for answer in load_answers(record, runs[record.run]):
            of_run = _passed_on(answer, residual)
            before = of_load.get(answer.load)
            of_load[answer.load] = of_run if before is None else before + of_run
    return of_load


def _passed_on(answer: LoadAnswer, residual: FloatArray) -> _PassedOn:
    """What one run says; `residual` has zeros where nothing is known."""
    power = np.abs(_spectrum(answer.values)) ** 2
    # The median of the square of a noisy line is ln 2 times its mean.
    highest = power[int((1.0 - _ABOVE_BAND) * power.size) :]
    noise = float(np.median(highest)) / np.log(2.0)
    share = noise / max(float(np.mean(answer.values**2)), np.finfo(float).tiny)
    # Unbounded: bounded by one, the share would lose a third of what lines of noise alone pass on.
    of_line = noise / np.maximum(power, np.finfo(float).tiny)
    is_noise = of_line > _IS_NOISE
    total = _PassedOn(share, 1, 0.0, 0.0, 0.0, 0.0)
    for response, of_channel in zip(answer.response.T, residual.T, strict=True):
        P, R = _spectrum(response), _spectrum(of_channel)
        # A fit that the noise leads astray has its resonance elsewhere, or higher.
        passed_on = uniform_filter1d(of_line * np.abs(P) ** 2, _SMOOTHED_LINES)
        remaining = uniform_filter1d(np.abs(R) ** 2, _SMOOTHED_LINES)
        square = 2.0 * float(np.minimum(passed_on, remaining).sum())
        P, R = P[is_noise], R[is_noise]
        # Every line counts alike: of the squares themselves few lines of a resonance are all.
        weight = 1.0 / np.maximum(np.abs(P) ** 2 + np.abs(R) ** 2, np.finfo(float).tiny)
        total += _PassedOn(
            0.0,
            0,
            square=square,
            unfollowed=-float(weight @ (R * P.conj()).real),
            variance=0.5 * float(np.sum(np.abs(weight * R * P) ** 2)),
            predicted=float(weight @ np.abs(P) ** 2),
        )
    return total


def noisier_readings(
    records: Iterable[LinearRecord], campaign: Campaign, gap: GapSquare
) -> Iterator[WiringRival]:
    """Noise larger than declared, where white noise makes the gap.

    None where the noise of a channel is not declared, or the gap is smoother than white noise.
    """
    declared = np.array([one.noise_std or np.nan for one in campaign.channels])
    scatter = [[neighbour_noise(residual) for residual in one.residual.T] for one in records]
    if not scatter or not np.isfinite(declared).all():
        return
    noise = np.nanmedian(scatter, axis=0)
    low, high = _AS_EXPECTED
    of_noise = float(np.mean(noise**2)) - gap.floor
    larger = np.flatnonzero((noise / declared) ** 2 > high)
    if larger.size and low <= of_noise / (gap.before - gap.floor) <= high:
        names = [campaign.channels[k].name for k in larger]
        sizes = (noise / declared)[larger].tolist()
        factors = ", ".join(f"{name} {size:.2g}" for name, size in zip(names, sizes, strict=True))
        text = f"noise larger than declared ({factors} times)"
        square = max(gap.before - of_noise, gap.floor)
        line = key_of(f"[[channels]] {names[0]}", "noise_std")
        yield WiringRival(Fault.DECLARED_NOISE, ", ".join(names), text, square, line)


def _spectrum(values: FloatArray) -> ComplexArray:
    """Lines of a signal through a Hann window; twice the sum of their squares is its own."""
    window = np.hanning(values.size)
    return np.asarray(np.fft.rfft((values - values.mean()) * window)) / np.linalg.norm(window)
