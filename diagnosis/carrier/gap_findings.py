"""One model's gap on a carrier.

Its map, and beyond it the gap in time, what does not repeat, growth, and scalars.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f as fisher_f

from carrierflex.diagnosis.carrier.gap_map import carrier_gap_cells
from carrierflex.diagnosis.carrier.gap_parts import Conditions, growth_table
from carrierflex.diagnosis.carrier.gap_words import RADIAL_LOAD, SPEED, TORQUE, carrier_where_text
from carrierflex.diagnosis.carrier.patterns import (
    RADIAL,
    ComplexArray,
    FloatArray,
    PatternSplit,
    pattern_split,
)
from carrierflex.diagnosis.carrier.sums import CarrierSums
from carrierflex.diagnosis.comparison.problem import GapCell
from carrierflex.diagnosis.gap.findings import (
    Drift,
    GapFindings,
    GapMoment,
    NonSynchronousCell,
    Scalar,
)
from carrierflex.diagnosis.gap.in_time import drift_words, significant_drifts, sliding_rms, trends
from carrierflex.diagnosis.gap.non_synchronous import (
    non_synchronous_words,
    scatter_p_values,
    scatter_p_values_estimated,
    significant_non_synchronous,
)
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.order_analysis import MAX_ORDER
from carrierflex.identification.campaign.revolutions import whole_revolutions
from carrierflex.simulation.carrier.run_cases import AXIAL

#: Unknowns of the orders of one revolution.
_FITTED = 2 * MAX_ORDER + 1
_POINTS = 128


@dataclass(frozen=True, eq=False)
class CarrierGap:
    """Residual of one model by revolution.

    Parameters
    ----------
    campaign : Campaign
        Channels and runs.
    records : CarrierSums
        Orders of the measured signals, scatter off them, loads.
    noise : ndarray, shape (C,)
        Variance of the noise of every channel [m²].
    residual : ndarray of complex, shape (R, C, MAX_ORDER + 1)
        Order amplitudes of the residual.
    """

    campaign: Campaign
    records: CarrierSums
    noise: FloatArray
    residual: ComplexArray

    @cached_property
    def cells(self) -> tuple[GapCell, ...]:
        """Gap map, largest share first."""
        names = [run.name for run in self.campaign.runs]
        noise = self.noise.mean() / self._samples
        return carrier_gap_cells(
            self.campaign.channels, self.residual, names, self.records.run_of_revolution, noise
        )

    @cached_property
    def conditions(self) -> Conditions:
        """Mean torque, radial load and speed of every run, sizes."""
        loads = {}
        for r, run in enumerate(self.campaign.runs):
            torque, y, z = self.records.loads[self.records.run_of_revolution == r].mean(axis=0)
            angle = run.inputs["carrier_angle"]
            speed = (angle[-1] - angle[0]) / (run.time[-1] - run.time[0])
            loads[run.name] = (abs(float(torque)), float(np.hypot(y, z)), abs(float(speed)))
        names = (TORQUE, RADIAL_LOAD, SPEED)
        return {name: {run: own[k] for run, own in loads.items()} for k, name in enumerate(names)}

    @property
    def where_text(self) -> str:
        """One sentence about the map."""
        return carrier_where_text(self.cells, self.conditions)

    def findings(self) -> GapFindings:
        """Gap in time, incoherent part, growth with the loads."""
        moments: list[GapMoment] = []
        trend_rows: list[Drift] = []
        scattered: list[NonSynchronousCell] = []
        split = pattern_split(self.campaign.channels, self.residual)
        measured = pattern_split(self.campaign.channels, self.records.orders[..., 0])
        for r, run in enumerate(self.campaign.runs):
            own = self._complete(r)
            if not own.size:
                continue
            samples = whole_revolutions(run).samples
            first = int(np.argmax(self.records.run_of_revolution == r))
            time = np.array([run.time[samples[k - first]].mean() for k in own])
            moments += self._moments(run.name, time, own)
            trend_rows += _drifts(run.name, time, split, own)
            scattered += [*self._scatter(r, split, measured, own), *self._off_orders(r)]
        repeated = significant_non_synchronous(self._repeats(split, measured))
        drifts, rows = significant_drifts(trend_rows), significant_non_synchronous(scattered)
        coherent = sum(cell.coherent for cell in self.cells)
        words = [
            non_synchronous_words(rows, coherent, "m", "revolution to revolution"),
            non_synchronous_words(repeated, coherent, "m", "repeat to repeat"),
            drift_words(drifts, "m"),
        ]
        return GapFindings(
            in_time=tuple(moments),
            drifts=drifts,
            non_synchronous=(*rows, *repeated),
            growth=growth_table(self.cells, self.conditions),
            text="; ".join(text for text in words if text),
        )

    def scalars(self) -> tuple[Scalar, ...]:
        """Static tilt, tilt at 1X, radial 1X and peak to peak by revolution, measured and predicted."""
        channels = self.campaign.channels
        target = self.records.orders[..., 0]
        complete = np.isfinite(target).all(axis=(1, 2)) & np.isfinite(self.residual).all(
            axis=(1, 2)
        )
        if not complete.any():
            return ()
        signals = [target[complete], (target - self.residual)[complete]]
        splits = [pattern_split(channels, own) for own in signals]
        names = splits[0].names
        wanted = [
            ("static tilt at the rim", "m=+1", 0, 2.0),
            ("1X axial", "m=+1", 1, 1.0),
            ("1X radial", RADIAL, 1, 1.0),
        ]
        result = []
        for name, pattern, order, factor in wanted:
            if pattern in names:
                place = names.index(pattern)
                values = [
                    factor * np.abs(own.amplitudes[:, place, MAX_ORDER + order]) for own in splits
                ]
                result.append(Scalar(name, "m", values[0], values[1]))
        axial = [c for c, channel in enumerate(channels) if channel.quantity == AXIAL]
        if axial:
            spans = [_peak_to_peak(own[:, axial]) for own in signals]
            result.append(Scalar("axial peak to peak", "m", spans[0], spans[1]))
        return tuple(result)

    @cached_property
    def _samples(self) -> FloatArray:
        """Samples of a revolution, by run."""
        samples = self.records.within[..., 1].mean(axis=1) + _FITTED
        runs = range(len(self.campaign.runs))
        return np.array(
            [max(float(samples[self.records.run_of_revolution == r].mean()), 1.0) for r in runs]
        )

    def _complete(self, run: int) -> NDArray[np.int64]:
        own = (self.records.run_of_revolution == run) & np.isfinite(self.residual).all(axis=(1, 2))
        return np.flatnonzero(own)

    def _moments(self, run: str, time: FloatArray, own: NDArray[np.int64]) -> tuple[GapMoment, ...]:
        weight = np.where(np.arange(MAX_ORDER + 1) == 0, 1.0, 0.5)
        square = (np.abs(self.residual[own]) ** 2 * weight).sum(axis=2)
        off = self.records.within[own, :, 0] / np.maximum(
            self.records.within[own, :, 1] + _FITTED, 1.0
        )
        return sliding_rms(run, time, (square + off).mean(axis=1))

    def _scatter(
        self, run: int, split: PatternSplit, measured: PatternSplit, own: NDArray[np.int64]
    ) -> list[NonSynchronousCell]:
        """Cells of one run against the noise that is declared, or seen off the orders."""
        if own.size < 2:
            return []
        gap, seen = split.amplitudes[own], measured.amplitudes[own]
        scatter, of_measured, of_model = (
            split.weights * part.var(axis=0, ddof=1) for part in (gap, seen, seen - gap)
        )
        declared = all(channel.noise_std is not None for channel in self.campaign.channels)
        level = self.noise if declared else self._off_variance(run)[0]
        by_pattern = np.array([level[list(members)].mean() for members in split.members])
        noise = split.noise * by_pattern[:, None] / self._samples[run]
        degrees = np.where(np.abs(gap.imag).max(axis=0) == 0.0, 1.0, 2.0) * (own.size - 1)
        if declared:
            p_value = scatter_p_values(scatter, noise, degrees)
        else:
            p_value = scatter_p_values_estimated(
                scatter, noise, degrees, float(self._off_variance(run)[1].sum())
            )
        name = self.campaign.runs[run].name
        return [
            NonSynchronousCell(
                name, split.names[m], float(n - MAX_ORDER), float(of_measured[m, n]), float(of_model[m, n]),
                float(scatter[m, n]), float(noise[m, n]), float(p_value[m, n]),
            )
            for m, n in _single_cells(split)
        ]  # fmt: skip

    def _repeats(self, split: PatternSplit, measured: PatternSplit) -> list[NonSynchronousCell]:
        """Cells of runs of one condition: scatter of their means against that of their revolutions.

        ``F = var(mean of the run) / mean(s² / R)``; `noise` is the denominator.
        """
        groups: dict[str, list[int]] = {}
        for r, run in enumerate(self.campaign.runs):
            if self._complete(r).size > 1:
                groups.setdefault(run.condition, []).append(r)
        cells = []
        for runs in (own for own in groups.values() if len(own) > 1):
            turns = [self._complete(r) for r in runs]
            gap, seen, model = (
                split.weights * np.var([part[own].mean(axis=0) for own in turns], axis=0, ddof=1)
                for part in (
                    split.amplitudes,
                    measured.amplitudes,
                    measured.amplitudes - split.amplitudes,
                )
            )
            within = [split.amplitudes[own].var(axis=0, ddof=1) / own.size for own in turns]
            noise = split.weights * np.mean(within, axis=0)
            real = np.abs(split.amplitudes[np.concatenate(turns)].imag).max(axis=0) == 0.0
            degrees = np.where(real, 1.0, 2.0)
            left = degrees * sum(own.size - 1 for own in turns)
            p_value = fisher_f.sf(
                gap / np.maximum(noise, np.finfo(float).tiny), degrees * (len(runs) - 1), left
            )
            name = " and ".join(self.campaign.runs[r].name for r in runs)
            cells += [
                NonSynchronousCell(
                    name, split.names[m], float(n - MAX_ORDER), float(seen[m, n]), float(model[m, n]), float(gap[m, n]),
                    float(noise[m, n]), float(p_value[m, n]),
                )
                for m, n in _single_cells(split)
            ]  # fmt: skip
        return cells

    def _off_variance(self, run: int) -> tuple[FloatArray, FloatArray]:
        """Variance off the orders by channel, and its degrees of freedom."""
        square, degrees = self.records.within[self.records.run_of_revolution == run].sum(axis=0).T
        return square / np.maximum(degrees, 1.0), degrees

    def _off_orders(self, run: int) -> list[NonSynchronousCell]:
        """Mean square off the orders by channel; the model's own part there is neglected."""
        variance, degrees = self._off_variance(run)
        cells = []
        for c, channel in enumerate(self.campaign.channels):
            declared = channel.noise_std is not None and degrees[c] > 0.0
            own, noise = np.array([variance[c], self.noise[c]]) / len(self.campaign.channels)
            p_value = float(scatter_p_values(own, noise, degrees[c])) if declared else float("nan")
            name = self.campaign.runs[run].name
            cells.append(
                NonSynchronousCell(
                    name, channel.name, None, float(own), 0.0, float(own), float(noise), p_value
                )
            )
        return cells


def _single_cells(split: PatternSplit) -> list[tuple[int, int]]:
    """Cells that hold something, the two halves of a static tilt once."""
    used = [(int(m), int(n)) for m, n in np.argwhere(split.weights > 0.0)]
    return [(m, n) for m, n in used if not (split.names[m] == "m=-1" and n == MAX_ORDER)]


def _drifts(run: str, time: FloatArray, split: PatternSplit, own: NDArray[np.int64]) -> list[Drift]:
    amplitudes = split.amplitudes[own]
    change, trend, p_value = trends(time, amplitudes)
    whole = np.mean(np.abs(amplitudes) ** 2, axis=0)
    return [
        Drift(
            run, split.names[m], float(n - MAX_ORDER), float(change[m, n]), float(trend[m, n] / whole[m, n]),
            float(p_value[m, n]),
        )
        for m, n in _single_cells(split)
        if whole[m, n] > 0.0
    ]  # fmt: skip


def _peak_to_peak(orders: ComplexArray) -> FloatArray:
    """Mean over channels of largest less smallest value of each revolution, shape (R,)."""
    angle = np.linspace(0.0, 2.0 * np.pi, _POINTS, endpoint=False)
    waves = np.exp(1j * np.outer(np.arange(MAX_ORDER + 1), angle))
    return np.asarray(np.ptp((orders @ waves).real, axis=2).mean(axis=1), dtype=np.float64)
