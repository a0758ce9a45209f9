"""Parameters of the gearbox mounting and the sensors' signals they predict for a record."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from carrierflex.diagnosis.comparison.effect_cards import EffectCard, EffectParameter
from carrierflex.diagnosis.comparison.problem import BASELINE, Effects, FloatArray, Parameter
from carrierflex.diagnosis.mounting.cards import NEGATIVE_CONTROLS, SIMULATED
from carrierflex.diagnosis.mounting.records import MountingRecord
from carrierflex.simulation.mounting.equations import mounting_blocks
from carrierflex.simulation.mounting.inputs import MountingInputs
from carrierflex.simulation.mounting.parameters import INDEX, PARAMETERS, parameter_array
from carrierflex.simulation.mounting.rig import SENSORS, MountingRig
from carrierflex.simulation.mounting.simulate import simulate

#: Prior standard deviation of an effect's parameter, in its scale.
_PRIOR = 10.0
#: Loads are averaged over this long before their rate is taken [s]: noise has a rate, the motion it
#: makes has not.
_RATE_WINDOW = 0.5
#: Stiffness of the baseline over the rig's nominal one.
_STIFFNESS_RANGE = (0.02, 30.0)
_SEED = 3

#: Channel of each effect of one sensor.
Choice = Mapping[str, int]


@dataclass(frozen=True, eq=False)
class MountingScale:
    """Own deflection, rate and stiffness of a bushing under the measured loads.

    Parameters
    ----------
    stiffness, deflection, time : float
        Nominal stiffness [N/m], RMS deflection [m], deflection over its rate [s].
    """

    stiffness: float
    deflection: float
    time: float

    def of(self, powers: tuple[int, int, int]) -> float:
        """Scale of a parameter with these powers of force, length and time."""
        force = self.stiffness * self.deflection
        return float(force ** powers[0] * self.deflection ** powers[1] * self.time ** powers[2])


@dataclass(frozen=True, eq=False)
class MountingModel:
    """Linear bushings and every effect of the contract.

    Parameters
    ----------
    rig : MountingRig
        Nominal rig.
    cards : mapping of str to EffectCard
        Library with the placebos.
    contained : tuple of str
        Effects of the baseline.
    channels, sensors : tuple of str
        Names of the channels and the sensors they are.
    scale : MountingScale
        Sizes of everything.
    held : tuple of float
        Values at which K1 and C1 are held; empty where they are fitted.
    """

    rig: MountingRig
    cards: Mapping[str, EffectCard]
    contained: Effects
    channels: tuple[str, ...]
    sensors: tuple[str, ...]
    scale: MountingScale
    held: tuple[float, ...] = ()

    def parameters(self, effects: Effects) -> tuple[Parameter, ...]:
        """Unknowns: K1, C1, then those of every effect."""
        K, C = self.rig.bushing_radial_stiffness, self.scale.of((1, -1, 1))
        own = [
            Parameter(BASELINE, "K1", "N/m", _STIFFNESS_RANGE[0] * K, _STIFFNESS_RANGE[1] * K, K),
            Parameter(BASELINE, "C1", "N s/m", 0.0, PARAMETERS[INDEX["C1"]].upper, C),
        ]
        if self.held:
            own = [
                replace(one, lower=value, upper=value)
                for one, value in zip(own, self.held, strict=True)
            ]
        for effect in (*self.contained, *effects):
            own += [
                self._parameter(effect, parameter) for parameter in self.cards[effect].parameters
            ]
        return tuple(own)

    def _parameter(self, effect: str, parameter: EffectParameter) -> Parameter:
        size = self.scale.of(parameter.powers) if parameter.powers else 1.0
        lower, upper = self._bounds(effect, parameter, size)
        scale = parameter.scale * size
        prior = np.inf if parameter.shape or effect in self.contained else _PRIOR * scale
        return Parameter(
            effect,
            parameter.name,
            parameter.unit,
            lower,
            upper,
            scale,
            prior,
            shape=parameter.shape,
        )

    def _bounds(self, effect: str, parameter: EffectParameter, size: float) -> tuple[float, float]:
        """Bounds of the card within those that the simulator accepts."""
        lower, upper = parameter.lower * size, parameter.upper * size
        name = SIMULATED.get((effect, parameter.name))
        if name is None:
            return lower, upper
        known, neutral = PARAMETERS[INDEX[name]], parameter_array(self.rig)[INDEX[name]]
        return max(lower, known.lower - neutral), min(upper, known.upper - neutral)

    def predicted(
        self,
        record: MountingRecord,
        effects: Effects,
        theta: FloatArray,
        choice: Choice,
        *,
        refined: int = 1,
    ) -> FloatArray:
        """Signals that a parameter set predicts for a record, shape (n, n_channels).

        Parameters
        ----------
        record : MountingRecord
            Record whose loads are applied.
        effects, theta
            Effects beside the baseline and all unknowns.
        choice : mapping of str to int
            Channel of each effect of one sensor.
        refined : int
            Factor on the samples of the loads.

        Returns
        -------
        ndarray
            Displacements [m]; infinite where the motion leaves the model.
        """
        values = parameter_array(self.rig)
        values[[INDEX["K1"], INDEX["C1"]]] = 0.0
        gains, zeros, delay = np.ones(len(self.channels)), np.zeros(len(self.channels)), 0.0
        negative_control = np.zeros((record.inputs.time.size, len(SENSORS)))
        for parameter, value in zip(self.parameters(effects), theta, strict=True):
            effect = parameter.effect
            if (effect, parameter.name) in SIMULATED:
                values[INDEX[SIMULATED[effect, parameter.name]]] += value
            elif effect == "sensor_gain":
                gains[choice[effect]] += value
            elif effect == "sensor_zero":
                zeros[choice[effect]] += value
            elif effect == "sensor_delay":
                delay += value
            elif value:
                negative_control += value * self.negative_control(record, effect)
        motion = self._signals(record, values, refined)
        if motion is None:
            return np.full(record.measured.shape, np.inf)
        signals = _delayed(motion + negative_control, record.inputs.time, delay)
        return signals[:, [SENSORS.index(sensor) for sensor in self.sensors]] * gains + zeros

    def _signals(
        self, record: MountingRecord, values: FloatArray, refined: int
    ) -> FloatArray | None:
        """All six sensors relative to their zero; None where the motion leaves the model."""
        inputs = record.inputs if refined == 1 else record.inputs.refined(refined)
        rig = replace(self.rig, zeroing_samples=(record.zeroing_samples - 1) * refined + 1)
        try:
            signals = simulate(rig, values, inputs).signals[::refined]
        except ArithmeticError:
            return None
        return signals if np.isfinite(signals).all() else None

    def negative_control(self, record: MountingRecord, name: str) -> FloatArray:
        """Nominal response to a surrogate of one load with random phases, shape (n, 6)."""
        number = [card.id for card in NEGATIVE_CONTROLS].index(name)
        loads = {load: np.zeros(record.inputs.time.size) for load in ("torque", "ntl_y", "ntl_z")}
        wanted = ("torque", "ntl_z")[number]
        source = wanted if np.ptp(getattr(record.inputs, wanted)) > 0.0 else "torque"
        rng = np.random.default_rng([_SEED, number, *record.name.encode()])
        loads[source] = _surrogate(getattr(record.inputs, source), rng)
        inputs = MountingInputs.from_columns(
            record.inputs.time, {**record.inputs.columns(), **loads}
        )
        rig = replace(self.rig, zeroing_samples=record.zeroing_samples)
        return simulate(rig, parameter_array(self.rig), inputs).signals


def mounting_scale(rig: MountingRig, records: Sequence[MountingRecord]) -> MountingScale:
    """Deflection and rate of the starboard bushing under the measured loads, at rest at every instant.

    Parameters
    ----------
    rig : MountingRig
        Nominal rig.
    records : sequence of MountingRecord
        Loads.

    Returns
    -------
    MountingScale
        RMS over all records.
    """
    rows = [
        block.rows[0] @ np.linalg.solve(block.K, block.G)
        for block in mounting_blocks(rig, parameter_array(rig))
    ]
    square, rate, n = 0.0, 0.0, 0
    for record in records:
        window = max(1, round(_RATE_WINDOW / record.step))
        loads = record.inputs.loads - record.inputs.loads[: record.zeroing_samples].mean(axis=0)
        count = len(loads) // window
        slow = (loads @ np.array(rows).T)[: count * window].reshape(count, window, 2).mean(axis=1)
        square, n = square + float((slow**2).sum()), n + count
        rate += float((np.diff(slow, axis=0) ** 2).sum()) / (window * record.step) ** 2
    return MountingScale(
        rig.bushing_radial_stiffness, float(np.sqrt(square / n)), float(np.sqrt(square / rate))
    )


def _delayed(signals: FloatArray, time: FloatArray, delay: float) -> FloatArray:
    if delay == 0.0:
        return signals
    moved = np.clip(time - delay, time[0], time[-1])
    return np.asarray(CubicSpline(time, signals)(moved), dtype=np.float64)


def _surrogate(values: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Signal of the same spectrum with random phases."""
    spectrum = np.fft.rfft(values - values.mean())
    turned = np.abs(spectrum) * np.exp(2j * np.pi * rng.random(spectrum.size))
    return np.asarray(np.fft.irfft(turned, values.size), dtype=np.float64)
