"""Revolutions of a carrier as vectors: order amplitudes of what a diagnosed baseline leaves.

A row of a vector is an order's cosine or sine, a column a channel; scaled so that the square of the
vector's length is the mean square over the channels and the turn.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np

from carrierflex.diagnosis.carrier.library import carrier_library, carrier_rig
from carrierflex.diagnosis.comparison.problem import BoolArray, FloatArray
from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.identification.campaign.campaign_header import CampaignHeader
from carrierflex.identification.campaign.declarations import PREDICTION_SUFFIX, TOLERANCES, Channel
from carrierflex.identification.campaign.order_analysis import highest_order, too_sparse
from carrierflex.identification.carrier.models import rim_sensor
from carrierflex.simulation.carrier.effect import Effect
from carrierflex.simulation.carrier.effects.library import RADIAL_MOTION
from carrierflex.simulation.carrier.rim import (
    CarrierInputs,
    CarrierRig,
    RimSensor,
    inputs_of_columns,
)

Columns = Mapping[str, FloatArray]


@dataclass(frozen=True, eq=False)
class Revolution:
    """One whole turn, reduced; p rows of orders, C channels."""

    start: float  # First time [s]
    end: float  # Last time [s]
    residual: FloatArray  # Vector of measured less predicted [m], zero if silent, shape (p, C)
    predicted: FloatArray  # Vector of predicted [m], shape (p, C)
    scatter: FloatArray  # Mean square of the samples about the orders [m²], shape (C,)
    is_silent: BoolArray  # Channels that are constant or missing, shape (C,)
    loads: FloatArray  # Mean torque [N m], radial load along y and z [N]; speed [rad/s], shape (4,)


@dataclass(frozen=True, eq=False)
class Term:
    """One effect of the baseline with its identified values."""

    effect: Effect  # Effect
    coefficients: tuple[float, ...]  # Values of its signals
    shapes: tuple[float, ...] = ()  # Values of its shapes

    def signal(self, sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig) -> FloatArray:
        """Its signal at a sensor [m], shape (n,)."""
        rows = self.effect.signals(sensor, inputs, rig, *self.shapes)
        return np.asarray(np.einsum("k,kn->n", np.array(self.coefficients), rows))


@dataclass(frozen=True, eq=False)
class RimBaseline:
    """A diagnosed baseline: what it predicts at the sensors."""

    channels: tuple[Channel, ...]  # Sensors at the rim
    rig: CarrierRig  # Rig and curves
    effects: Mapping[str, Effect]  # The library
    #: Effects of the baseline, and named ones, with their values. Offsets of single runs are none
    #: of them: a learning period has its own
    terms: tuple[Term, ...]
    has_predictions: bool = False  # Whether another simulator's prediction is among the columns
    gains: Mapping[str, float] = field(default_factory=dict)  # Named errors of gains by channel
    moves: Mapping[str, float] = field(default_factory=dict)  # The same of angles [rad]
    delay: float = 0.0  # Delay of all channels [s]
    #: Parameters that the diagnosis could not determine; they are zero
    unknown: tuple[str, ...] = ()

    @property
    def n_orders(self) -> int:
        """Highest order that is kept."""
        return highest_order(self.rig.n_planets)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and channels of a vector."""
        return 1 + 2 * self.n_orders, len(self.channels)

    def sensor(self, channel: Channel) -> RimSensor:
        """Where a channel reads."""
        sensor = rim_sensor(channel)
        return replace(sensor, angle=sensor.angle + self.moves.get(channel.name, 0.0))

    def prediction(self, columns: Columns) -> FloatArray:
        """Signals of the baseline under the inputs of a revolution [m], shape (C, n)."""
        inputs = inputs_of_columns(columns)
        if self.delay:
            late = _speed(inputs.time, inputs.carrier_angle) * self.delay
            inputs = replace(inputs, carrier_angle=inputs.carrier_angle - late)
        rows = []
        for channel in self.channels:
            total = np.zeros_like(inputs.carrier_angle)
            if self.has_predictions:
                total += columns[channel.name + PREDICTION_SUFFIX]
            for term in self.terms:
                total += term.signal(self.sensor(channel), inputs, self.rig)
            rows.append((1.0 + self.gains.get(channel.name, 0.0)) * total)
        return np.array(rows)

    def vectors(self, angle: FloatArray, signals: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Vectors of m signals over one turn, shape (p, m), and their scatter, shape (m,).

        Least squares on ``1, cos n theta, sin n theta`` of the samples that are present.
        """
        phase = np.outer(angle, np.arange(1, self.n_orders + 1))
        A = np.hstack([np.ones((angle.size, 1)), np.cos(phase), np.sin(phase)])
        present = np.isfinite(signals)
        if present.all():
            a = np.linalg.solve(A.T @ A, A.T @ signals.T)
        else:
            a = np.stack(
                [
                    np.linalg.solve(A[rows].T @ A[rows], A[rows].T @ signal[rows])
                    for rows, signal in zip(present, signals, strict=True)
                ],
                axis=1,
            )
        scatter = np.nanmean((signals - (A @ a).T) ** 2, axis=1)
        return a * _row_scale(*self.shape), scatter

    def revolution(self, columns: Columns) -> Revolution | None:
        """Reduce the samples of one turn, with predictions where they are another simulator's.

        None where samples leave too large a gap in the turn for the highest order.
        """
        time, angle = columns["time"], columns["carrier_angle"]
        if angle.size < 2 * self.shape[0] or too_sparse(angle, self.n_orders):
            return None
        steps = np.diff(time)
        if steps.min() <= 0.0 or steps.max() > 0.2 * (time[-1] - time[0]):
            return None
        signals = np.array([columns[channel.name] for channel in self.channels])
        silent = np.array([_is_silent(signal, angle, self.n_orders) for signal in signals])
        prediction = self.prediction(columns)
        signals = np.where(silent[:, None], prediction, signals)
        both, scatter = self.vectors(angle, np.concatenate([signals - prediction, prediction]))
        C = len(signals)
        loads = [
            float(columns[name].mean()) if name in columns else 0.0
            for name in ("torque", "ntl_y", "ntl_z")
        ]
        return Revolution(
            start=float(time[0]),
            end=float(time[-1]),
            residual=both[:, :C],
            predicted=both[:, C:],
            scatter=scatter[:C],
            is_silent=silent,
            loads=np.array([*loads, abs(_speed(time, angle))]),
        )


def _speed(time: FloatArray, angle: FloatArray) -> float:
    """Mean speed over a turn [rad/s], whether its angle is wrapped or not."""
    steps = np.diff(angle)
    steps -= 2.0 * np.pi * np.round(steps / (2.0 * np.pi))
    return float(steps.sum() / (time[-1] - time[0]))


def _row_scale(p: int, C: int) -> FloatArray:
    """Factor of every row that makes a vector's squared length a mean square, shape (p, 1)."""
    scale = np.full((p, 1), np.sqrt(0.5 / C))
    scale[0] = np.sqrt(1.0 / C)
    return scale


def vector_of_amplitudes(amplitudes: FloatArray) -> FloatArray:
    """Vectors of amplitudes of the constant, cosines and sines, shape (..., p, C)."""
    return amplitudes * _row_scale(*amplitudes.shape[-2:])


def _is_silent(signal: FloatArray, angle: FloatArray, n_orders: int) -> bool:
    """Whether a channel stands still for a quarter of the turn, or lacks half of it."""
    present = np.isfinite(signal)
    if present.mean() < 0.5 or too_sparse(angle[present], n_orders):
        return True
    changes = np.flatnonzero(np.diff(signal[present]) != 0.0)
    edges = np.concatenate([[-1], changes, [present.sum() - 1]])
    return bool(np.diff(edges).max() > 0.25 * signal.size)


@dataclass
class RevolutionSplitter:
    """Cuts a stream of samples where the carrier angle passes a multiple of a turn.

    What it gives does not depend on the pieces that the samples come in. The angle may be wrapped
    or not.
    """

    _waiting: list[dict[str, FloatArray]] = field(default_factory=list)
    _n_waiting: int = 0
    _file: str = ""

    def turns(self, columns: Columns, file: str = "") -> Iterator[tuple[Columns, str]]:
        """Samples of every turn that ends within the next piece, and the file of the last of them.

        The first turn of a stream, and one across a gap, are shorter than a turn.
        """
        angle = columns.get("carrier_angle", np.zeros(0))
        if not angle.size:
            return
        before = self._waiting[-1]["carrier_angle"][-1:] if self._waiting else angle[:1]
        extended = np.concatenate([before, angle])
        # An encoder's jump back by a turn is no turn back.
        jumps = np.round(np.diff(extended) / (2.0 * np.pi))
        begins = np.flatnonzero(np.diff(np.floor(extended / (2.0 * np.pi))) != jumps)
        for k, (start, end) in enumerate(pairwise([0, *begins.tolist(), angle.size])):
            if k and self._waiting:
                pieces, self._waiting, self._n_waiting = self._waiting, [], 0
                turn = {name: np.concatenate([one[name] for one in pieces]) for name in pieces[0]}
                yield turn, self._file
            if end > start:
                self._wait({name: values[start:end].copy() for name, values in columns.items()})
                self._file = file

    def _wait(self, piece: dict[str, FloatArray]) -> None:
        self._n_waiting += piece["carrier_angle"].size
        self._waiting.append(piece)
        if self._n_waiting > 1_000_000:
            # A turbine that stands still fills no memory: the last sample says where the next turn
            # begins.
            self._waiting = [{name: values[-1:].copy() for name, values in piece.items()}]


def rim_baseline(
    header: CampaignHeader,
    curves: Mapping[str, DeflectionCurve],
    diagnosis: Mapping[str, Any],
) -> RimBaseline:
    """Baseline with the values that a diagnosis (content of diagnosis.json) identified.

    ValueError where the kind, the baseline or a named effect is one that is not evaluated sample by
    sample.
    """
    if diagnosis.get("kind") != "carrier":
        raise ValueError(
            f"the diagnosis is of kind '{diagnosis.get('kind')}'; expected 'carrier': watch "
            "compares revolutions of a planet carrier"
        )
    if header.baseline.source == "stage" or TOLERANCES in header.rig:
        raise ValueError(
            "the baseline is a stage, or a drawing with [rig.tolerances], which is not evaluated "
            "sample by sample; expected source = 'model' or 'columns' without tolerances"
        )
    rig = carrier_rig(header.rig, curves)
    effects = carrier_library(rig, tuple(RADIAL_MOTION.values()))
    is_columns = header.baseline.source == "columns"
    parameters: Mapping[str, Mapping[str, Mapping[str, Any]]] = diagnosis["parameters"]
    named = diagnosis["effects"] if diagnosis["verdict"].startswith("named") else ()
    terms: list[Term] = []
    unknown: list[str] = []
    of_channels: dict[str, dict[str, float]] = {"sensor_gain": {}, "sensor_angle": {}}
    delay = 0.0
    for name in (*(() if is_columns else header.baseline.effects), *named):
        values = {key: float(of["value"]) for key, of in parameters.get(name, {}).items()}
        if name not in effects:
            raise ValueError(
                f"the diagnosis names '{name}', which is no effect of the library; expected a "
                "diagnosis without --law"
            )
        effect = effects[name]
        if effect.pattern is not None:
            if not effect.per_run:
                term, without = _term(effect, values)
                terms.append(term)
                unknown += without
        elif name == "sensor_delay":
            delay = values.get("tau", 0.0)
        elif name in of_channels:
            of_channels[name] |= {key.partition("_")[2]: value for key, value in values.items()}
    return RimBaseline(
        channels=tuple(header.channels),
        rig=rig,
        effects=effects,
        terms=tuple(terms),
        has_predictions=is_columns,
        gains=of_channels["sensor_gain"],
        moves=of_channels["sensor_angle"],
        delay=delay,
        unknown=tuple(unknown),
    )


def _term(effect: Effect, published: Mapping[str, float]) -> tuple[Term, list[str]]:
    """Effect with its published values, and the parameters without one, which are zero."""
    # Size and angle of a vector are its components.
    values, unknown = [], []
    for parameter in effect.parameters:
        pair = parameter.pair
        value = published.get(parameter.name, np.nan)
        if pair is not None:
            wave = np.cos if parameter.name == pair.components[0] else np.sin
            size, angle = (published.get(name, np.nan) for name in (pair.size, pair.angle))
            value = size * float(wave(angle))
        if not np.isfinite(value):
            unknown.append(f"{effect.id}.{parameter.name}")
        values.append(float(np.nan_to_num(value)))
    n = len(values) - effect.n_shapes
    return Term(effect, tuple(values[:n]), tuple(values[n:])), unknown
