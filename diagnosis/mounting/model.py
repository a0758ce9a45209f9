"""Parameters of the gearbox mounting and the signals that they predict for a record."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from carrierflex.diagnosis.comparison.effect_cards import card_of_force
from carrierflex.diagnosis.comparison.problem import BASELINE, Effects, FloatArray, Parameter
from carrierflex.diagnosis.kind.problem_in_time import ModelInTime, MotionScale
from carrierflex.diagnosis.mounting.records import MountingRecord
from carrierflex.simulation.effect_parameters import EffectParameter
from carrierflex.simulation.force_laws import ForceLaw, sum_of_laws
from carrierflex.simulation.laws import Law
from carrierflex.simulation.measurement import Measurement
from carrierflex.simulation.mounting.effects import MOUNTING_EFFECTS
from carrierflex.simulation.mounting.equations import mounting_blocks
from carrierflex.simulation.mounting.measured_laws.bushing_laws import packed_laws
from carrierflex.simulation.mounting.parameter_arrays import parameter_array
from carrierflex.simulation.mounting.parameters import INDEX, PARAMETERS
from carrierflex.simulation.mounting.rig import SENSORS, MountingRig
from carrierflex.simulation.mounting.simulate import simulate
from carrierflex.simulation.sensing import delayed, reading

#: Loads are averaged over this long before their rate is taken [s]: noise has a rate, the motion it
#: makes has not.
_RATE_WINDOW = 0.5
#: Stiffness of the baseline over the rig's nominal one.
_STIFFNESS_RANGE = (0.02, 30.0)
#: Shapes of a user's law that are tried, over the scale of the card.
USER_SHARES = (0.25, 0.5, 1.0, 2.0, 4.0)
#: Channel of each effect of one sensor.
Choice = Mapping[str, int]
KIND = "mounting"
MOUNTING_CARDS = tuple(card_of_force(effect, KIND) for effect in MOUNTING_EFFECTS.values())
#: Effects of one sensor; the fit chooses which.
ONE_CHANNEL = tuple(
    effect.id
    for effect in MOUNTING_EFFECTS.values()
    if effect.measurement and effect.measurement.is_of_one_channel
)


@dataclass(frozen=True, eq=False, kw_only=True)
class MountingModel(ModelInTime):
    """Linear bushings and every effect of the contract."""

    effects = MOUNTING_EFFECTS
    rig: MountingRig  # Nominal rig
    sensors: tuple[str, ...]  # Sensors of the channels
    measured: Mapping[str, Law] = field(default_factory=dict)  # Laws of files by effect

    def of_baseline(self) -> list[Parameter]:
        """Unknowns: K1, C1."""
        K, C = self.rig.bushing_radial_stiffness, self.scale.of((1, -1, 1))
        lower, upper = K * np.array(_STIFFNESS_RANGE)
        # Half of what the simulator takes: differences step beyond a bound.
        most = 0.5 * PARAMETERS[INDEX["C1"]].upper
        unknowns = [
            Parameter("K1", "N/m", float(lower), float(upper), K, effect=BASELINE),
            Parameter("C1", "N s/m", 0.0, most, C, effect=BASELINE),
        ]
        return [self.known.prior(parameter, parameter.name) for parameter in unknowns]

    def _bounds(self, effect: str, parameter: EffectParameter, size: float) -> tuple[float, float]:
        """Bounds of the card within those that the simulator accepts."""
        lower, upper = parameter.lower * size, parameter.upper * size
        neutral = parameter_array(self.rig)
        for index in _simulated_indices(effect, parameter.name):
            accepted = PARAMETERS[index]
            lower = max(lower, accepted.lower - neutral[index])
            upper = min(upper, accepted.upper - neutral[index])
        return lower, upper

    def predicted(
        self,
        record: MountingRecord,
        effects: Effects,
        theta: FloatArray,
        choice: Choice,
        *,
        refined: int = 1,
    ) -> FloatArray:
        """Signals [m] that a parameter set predicts under a record's loads, (n, n_channels).

        Infinite where the motion leaves the model. `theta` are all unknowns, `effects` those beside
        the baseline; `refined` is a factor on the samples of the loads.
        """
        values = parameter_array(self.rig)
        values[[INDEX["K1"], INDEX["C1"]]] = 0.0
        gains = np.ones(len(self.channels))
        zeros = np.zeros(len(self.channels))
        delay = 0.0
        of_laws: dict[str, list[float]] = {}
        of_files: list[tuple[Law, float]] = []
        for parameter, value in zip(self.parameters(effects), theta, strict=True):
            effect = parameter.effect
            measurement = self.measurement(effect)
            if effect in self.laws:
                of_laws.setdefault(effect, []).append(float(value))
            elif effect in self.measured:
                of_files.append((self.measured[effect], float(value)))
            elif measurement is Measurement.GAIN:
                gains[choice[effect]] += value
            elif measurement is Measurement.ZERO:
                zeros[choice[effect]] += value
            elif measurement is Measurement.DELAY:
                delay += value
            else:
                values[_simulated_indices(effect, parameter.name)] += value
        users = tuple(ForceLaw(self.laws[effect], np.array(of_laws[effect])) for effect in of_laws)
        tables = packed_laws(of_files) if of_files else None
        inputs = record.inputs if refined == 1 else record.inputs.refined(refined)
        rig = replace(self.rig, zeroing_samples=(record.zeroing_samples - 1) * refined + 1)
        try:
            simulated = simulate(rig, values, inputs, user_law=sum_of_laws(users), tables=tables)
            motion = simulated.signals[::refined]
        except ArithmeticError:
            return np.full(record.measured.shape, np.inf)
        if not np.isfinite(motion).all():
            return np.full(record.measured.shape, np.inf)
        signals = delayed(record.inputs.time, motion, delay)
        numbers = [SENSORS.index(sensor) for sensor in self.sensors]
        return reading(signals[:, numbers], gains, zeros)


def _simulated_indices(effect: str, parameter: str) -> list[int]:
    """Indices in the simulator's flat array that a parameter is added to."""
    if effect == BASELINE:
        return [INDEX[parameter]]
    known = MOUNTING_EFFECTS.get(effect)
    if known is None or known.measurement is not None or known.law is not None:
        return []
    return [INDEX[name] for name in known.values_of(parameter)]


def mounting_scale(rig: MountingRig, records: Sequence[MountingRecord]) -> MotionScale:
    """Static deflection of the starboard bushing under the measured loads, and its rate."""
    rows = [
        block.rows[0] @ np.linalg.solve(block.K, block.G)
        for block in mounting_blocks(rig, parameter_array(rig))
    ]
    square = 0.0
    rate = 0.0
    n = 0
    for record in records:
        window = max(1, round(_RATE_WINDOW / record.step))
        loads = record.inputs.loads - record.inputs.loads[: record.zeroing_samples].mean(axis=0)
        count = len(loads) // window
        slow = (loads @ np.array(rows).T)[: count * window].reshape(count, window, 2).mean(axis=1)
        square, n = square + float((slow**2).sum()), n + count
        rate += float((np.diff(slow, axis=0) ** 2).sum()) / (window * record.step) ** 2
    deflection = float(np.sqrt(square / n))
    force = rig.bushing_radial_stiffness * deflection
    return MotionScale(force, deflection, float(np.sqrt(square / rate)))
