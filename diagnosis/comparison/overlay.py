"""Measured and simulated signals side by side: what a comparison problem gives for the eye."""

from dataclasses import dataclass

import numpy as np

from carrierflex.diagnosis.comparison.problem import FloatArray


@dataclass(frozen=True, eq=False)
class Overlay:
    """One channel in one run as measured and as a model has it.

    Parameters
    ----------
    run, channel : str
        Where it was measured.
    x : ndarray, shape (n,)
        Time [s], or angle of the carrier [deg] over one turn.
    x_name, x_unit : str
        Of `x`.
    measured, simulated : ndarray, shape (n,)
        Signals, in the problem's unit; NaN where nothing was measured.
    """

    run: str
    channel: str
    x: FloatArray
    x_name: str
    x_unit: str
    measured: FloatArray
    simulated: FloatArray

    @property
    def rms(self) -> float:
        """RMS of the difference."""
        return float(np.sqrt(np.nanmean(np.square(self.measured - self.simulated))))


def signal_overlay(
    run: str, channel: str, step: float, measured: FloatArray, residual: FloatArray
) -> Overlay:
    """Overlay of an evenly sampled signal and its residual, shape (n,) each."""
    time = step * np.arange(measured.size, dtype=np.float64)
    return Overlay(run, channel, time, "time", "s", measured, measured - residual)


@dataclass(frozen=True, eq=False)
class SignalComparison:
    """Signals of all channels before and after the effects were added.

    Parameters
    ----------
    before : tuple of Overlay
        With the baseline.
    after : tuple of Overlay
        With the best supported effects, in the same order; empty where none is.
    """

    before: tuple[Overlay, ...]
    after: tuple[Overlay, ...]

    @property
    def largest(self) -> int:
        """Number of the overlay with the largest gap before."""
        return int(np.argmax([overlay.rms for overlay in self.before]))

    def by_channel(self) -> dict[str, tuple[float, float]]:
        """RMS of the gap before and after over all runs, by channel; NaN after where none is."""
        sizes: dict[str, tuple[float, float]] = {}
        for name in dict.fromkeys(overlay.channel for overlay in self.before):
            before, after = (
                [overlay.rms**2 for overlay in overlays if overlay.channel == name]
                for overlays in (self.before, self.after)
            )
            sizes[name] = (
                float(np.sqrt(np.mean(before))),
                float(np.sqrt(np.mean(after))) if after else float("nan"),
            )
        return sizes
