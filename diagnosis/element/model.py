"""Parameters of one element and the response they predict for a record."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from weakref import WeakKeyDictionary

import numpy as np

from carrierflex.diagnosis.comparison.problem import BASELINE, Effects, FloatArray, Parameter
from carrierflex.diagnosis.element.records import ElementRecord
from carrierflex.diagnosis.kind.problem_in_time import ModelInTime, MotionScale
from carrierflex.identification.campaign.signals import band_limited, half_step_values
from carrierflex.simulation.effect_parameters import EffectParameter, unit_of_powers
from carrierflex.simulation.element.effects import ELEMENT_EFFECTS
from carrierflex.simulation.element.integration_steps import integration_substeps
from carrierflex.simulation.element.kernels import (
    RUNAWAY,
    driven_motion,
    element_values,
    goes_together,
    motions_together,
    no_law,
    restoring_force,
)
from carrierflex.simulation.element.law_forces import ElementLaw, table_cells
from carrierflex.simulation.element.memory_laws import MemoryParts, flat_parts, joined_parts
from carrierflex.simulation.force_laws import ForceLaw, sum_of_laws
from carrierflex.simulation.measurement import Measurement
from carrierflex.simulation.sensing import delayed

#: Speed below which the sign of a measured motion is uncertain, as a share of its RMS.
_REST_SPEED = 1e-3
#: Motions that are integrated together: a multiple of what processors take in one instruction;
#: and samples, so that their drives stay in the processor's cache.
_TOGETHER, _AT_ONCE = 8, 2048
#: Names of a run's deflection and speed at its first sample.
STATE_NAMES = ("q_0", "v_0")
#: Periods run before a record that starts in the steady state.
_RUN_IN_PERIODS = 2
#: Parameter sets whose values are kept.
_MOST_VALUES = 64


@dataclass(frozen=True, eq=False)
class ElementScale(MotionScale):
    """RMS of the restoring force and the deflection; the linear baseline in force space."""

    speed: float  # RMS of the rate of the deflection
    #: m, K1, C1, f0: baseline by least squares in force space
    m: float
    K1: float
    C1: float
    f0: float

    def substeps(self, step: float) -> int:
        """Steps of integration between two samples `step` [s] apart."""
        return integration_substeps(self.m, self.K1, self.C1, step)


@dataclass(frozen=True, eq=False, kw_only=True)
class ElementModel(ModelInTime):
    """One element under one kind of drive."""

    effects = ELEMENT_EFFECTS
    #: Force drive (displacement is predicted) or displacement drive (force is predicted)
    by_force: bool
    mass: float | None  # Given mass; fitted where None
    scale: ElementScale  # Sizes of everything
    units: tuple[str, str]  # Units of force and deflection
    substeps: int  # Steps of integration a sample
    #: Measured deflection and speed at the first sample of every run that is released (free decay),
    #: whose states are fitted; empty where the measured ones are taken
    states: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    #: Whether forces are per mass: free decay or moving base without a given mass
    per_mass: bool = False
    #: Measured laws by effect; their one parameter is their size
    measured: Mapping[str, ElementLaw] = field(default_factory=dict)

    def of_baseline(self) -> list[Parameter]:
        """Mass where it is not given, K1, C1, f0; after a release every run's first state."""
        scale = self.scale
        least_mass = 1e-9 * scale.of((1, -1, 2)) if self.by_force else 0.0

        def unknown(
            name: str, powers: tuple[int, int, int], lower: float, size: float
        ) -> Parameter:
            return Parameter(
                name,
                self.unit_of(powers),
                lower,
                np.inf,
                size,
                effect=BASELINE,
                gain_std=self.gains.of(powers),
            )

        base = [] if self.mass is not None else [("m", (1, -1, 2), least_mass)]
        base += [("K1", (1, -1, 0), 0.0), ("C1", (1, -1, 1), 0.0), ("f0", (1, 0, 0), -np.inf)]
        unknowns = [
            self.known.prior(unknown(name, powers, lower, scale.of(powers)), name)
            for name, powers, lower in base
        ]
        q_0, v_0 = STATE_NAMES
        states = [
            unknown(q_0, (0, 1, 0), -np.inf, scale.deflection),
            unknown(v_0, (0, 1, -1), -np.inf, scale.speed),
        ]
        return unknowns + [replace(state, run=run) for run in self.states for state in states]

    def _unit(self, parameter: EffectParameter) -> str:
        return self.unit_of(parameter.powers) if parameter.powers else parameter.unit

    @property
    def response_unit(self) -> str:
        """Unit of the channel."""
        return self.units[1 if self.by_force else 0]

    def unit_of(self, powers: tuple[int, int, int]) -> str:
        """Unit text of a parameter with these powers of force, length and time."""
        if self.per_mass:
            # A force per mass is a length over a time squared.
            powers = (0, powers[0] + powers[1], powers[2] - 2 * powers[0])
        return unit_of_powers(powers, self.units)

    def predicted(
        self, record: ElementRecord, effects: Effects, theta: FloatArray, *, refined: int = 1
    ) -> FloatArray:
        """Response that a parameter set predicts for a record, shape (n,).

        Deflection (force drive) or force (displacement drive); infinite where the motion diverges.
        `refined` multiplies the steps of integration.
        """
        together = self.predicted_together(effects, [(record, [theta])], refined)
        if together is not None:
            return together[0][0]
        values = self._values(effects, theta)
        first, second = values.laws
        if not self.by_force:
            return _read_late(record, self._force(record, values.flat, first, second), values.delay)
        substeps = self.substeps * refined
        q, _ = driven_motion(
            self._fine_drive(record, substeps),
            self._start(record, values),
            substeps,
            values.flat,
            np.array([record.step / substeps, np.abs(record.motion[0]).max()]),
            first.force,
            second.force,
            first.parameters,
            second.parameters,
        )
        return _read_late(record, q[q.size - record.drive.size :], values.delay)

    def predicted_together(
        self,
        effects: Effects,
        runs: Sequence[tuple[ElementRecord, Sequence[FloatArray]]],
        refined: int,
    ) -> list[list[FloatArray]] | None:
        """Deflections that parameter sets predict for each of some records, shape (n,) each.

        None where one of them has parts with a memory, dry friction that rises towards rest or a
        law that is no even table over the deflection, or where the force is predicted.
        """
        if not self.by_force or self._values(effects, runs[0][1][0]).table is None:
            return None
        lanes = [(record, self._values(effects, theta)) for record, sets in runs for theta in sets]
        if any(values.table is None for _, values in lanes):
            return None
        lengths = [_n_driven(record) for record, _ in lanes]
        responses = {}
        for length in dict.fromkeys(lengths):
            alike = [k for k, other in enumerate(lengths) if other == length]
            deflections = self._motions([lanes[k] for k in alike], self.substeps * refined)
            for k, q in zip(alike, deflections, strict=True):
                record, values = lanes[k]
                responses[k] = _read_late(record, q[q.size - record.drive.size :], values.delay)
        numbers = iter(range(len(lanes)))
        return [[responses[next(numbers)] for _ in sets] for _, sets in runs]

    def _motions(
        self, motions: Sequence[tuple[ElementRecord, "_Values"]], substeps: int
    ) -> FloatArray:
        """Deflections from the first driven sample on, drives of one length, (n_motions, n)."""
        records = list(dict.fromkeys(record for record, _ in motions))
        drives = [self._fine_drive(record, substeps) for record in records]
        n = (drives[0].size - 1) // (2 * substeps)
        most = {record: RUNAWAY * float(np.abs(record.motion[0]).max()) for record in records}
        # Fewer than three are as fast one by one.
        n_lanes = len(motions) if len(motions) < 3 else -(-len(motions) // _TOGETHER) * _TOGETHER
        lanes = [*motions, *[motions[0]] * (n_lanes - len(motions))]
        numbers = np.array([records.index(record) for record, _ in lanes])
        state = np.array([[*self._start(record, values), 0.0, 0.0] for record, values in lanes])
        limits = np.array([[record.step / substeps, most[record]] for record, _ in lanes])
        tables = [values.table for _, values in lanes if values.table is not None]
        p = np.array(
            [[*lane.flat, *table[1]] for (_, lane), table in zip(lanes, tables, strict=True)]
        )
        state, limits, p = (np.ascontiguousarray(rows.T) for rows in (state, limits, p))
        law = motions[0][1].laws[0].force
        p_law = np.array([values.laws[0].parameters for _, values in lanes])
        deflections = np.empty((len(motions), n))
        for first in range(0, n, _AT_ONCE):
            last = min(first + _AT_ONCE, n)
            span = slice(2 * substeps * first, 2 * substeps * last + 1)
            force = np.column_stack([drive[span] for drive in drives])
            q, _ = motions_together(
                force, numbers, state, substeps, p, limits, tables[0][0], law, p_law
            )
            deflections[:, first:last] = q[:, : len(motions)].T
        return deflections

    def _fine_drive(self, record: ElementRecord, substeps: int) -> FloatArray:
        """Drive between the samples, with the periods run in; that of the model's steps is kept."""
        fine = _FINE_DRIVES.setdefault(record, {})
        if substeps in fine:
            return fine[substeps]
        drive = record.drive
        if record.in_steady_state:
            drive = np.concatenate([np.tile(drive[: record.period], _RUN_IN_PERIODS), drive])
        values = half_step_values(drive, substeps, periodic=record.in_steady_state)
        if substeps == self.substeps:
            fine[substeps] = values
        return values

    @staticmethod
    def _start(record: ElementRecord, values: "_Values") -> FloatArray:
        """Deflection and speed at the first sample: fitted, or as measured; shape (2,)."""
        return np.array(values.states.get(record.name, record.first_state))

    def _force(
        self, record: ElementRecord, flat: FloatArray, first: ForceLaw, second: ForceLaw
    ) -> FloatArray:
        """Force that the measured motion needs, shape (n,)."""
        q, v, a = record.motion
        limits = np.array([record.step, _REST_SPEED * self.scale.speed])
        return restoring_force(
            q, v, a, flat, limits, first.force, second.force, first.parameters, second.parameters
        )

    def _values(self, effects: Effects, theta: FloatArray) -> "_Values":
        """Values of a parameter set, sorted by what takes them; those asked for last are kept."""
        last, key = _LAST_VALUES.setdefault(self, {}), (effects, theta.tobytes())
        if known := last.get(key):
            return known
        if len(last) >= _MOST_VALUES:
            last.clear()
        states: dict[str, list[float]] = {}
        values = [(BASELINE, "m", self.mass or 0.0)]
        for parameter, value in zip(self.parameters(effects), theta.tolist(), strict=True):
            if parameter.run is not None:
                states.setdefault(parameter.run, []).append(value)
            else:
                values.append((parameter.effect, parameter.name, value))
        last[key] = known = self._sorted(values, states)
        return known

    def signature(
        self, record: ElementRecord, effect: str, values: Mapping[str, float]
    ) -> FloatArray:
        """Force of one effect alone along the measured motion, in the usable band, shape (n,)."""
        names = [p.name for p in self.cards[effect].parameters] if effect in self.laws else values
        of_effect = self._sorted([(effect, name, values[name]) for name in names], {})
        force = self._force(record, of_effect.flat, *of_effect.laws)
        return band_limited(force, record.step, record.cutoff_hz)

    def _sorted(
        self, values: Iterable[tuple[str, str, float]], states: Mapping[str, Sequence[float]]
    ) -> "_Values":
        """Values by effect and name, sorted by what takes them."""
        simulated: dict[str, float] = {}
        of_laws: dict[str, list[float]] = {}
        laws: list[ForceLaw] = []
        delay = 0.0
        sizes: list[tuple[MemoryParts, float]] = []
        for effect, parameter, value in values:
            taken = {}
            if effect in self.measured:
                sizes.append((self.measured[effect].memory, value))
                law = self.measured[effect].of_size(value)
                laws += [law] if law is not None else []
                plus, minus = self.measured[effect].friction
                taken = {"F_plus": value * plus, "F_minus": value * minus}
            elif effect in self.laws:
                of_laws.setdefault(effect, []).append(value)
            elif self.measurement(effect) is Measurement.DELAY:
                delay += value
            else:
                known = self.effects.get(effect)
                taken = dict.fromkeys(known.values_of(parameter) if known else [parameter], value)
            for name, added in taken.items():
                simulated[name] = simulated.get(name, 0.0) + added
        laws += [ForceLaw(self.laws[name], np.array(p)) for name, p in of_laws.items()]
        flat = np.concatenate([element_values(simulated), flat_parts(joined_parts(sizes))])
        # The motion takes two laws: the first, and the sum of all others.
        two_laws = (sum_of_laws(laws[:1]) or _NO_LAW, sum_of_laws(laws[1:]) or _NO_LAW)
        return _Values(flat, delay, two_laws, states)


@dataclass(frozen=True, eq=False)
class _Values:
    """Values of a parameter set."""

    flat: FloatArray
    delay: float
    laws: tuple[ForceLaw, ForceLaw]
    states: Mapping[str, Sequence[float]]

    @cached_property
    def table(self) -> tuple[FloatArray, tuple[float, float]] | None:
        """Cells of the only law beside the compiled ones, and its factors as in `motions_together`.

        None where the motion takes more than such a table.
        """
        law, second = self.laws
        if not goes_together(self.flat, second.parameters.size):
            return None
        if not law.parameters.size:
            return np.empty((3, 0)), (0.0, 0.0)
        table = table_cells(law)
        if table is None:
            return None
        cells, times_speed = table
        size = float(law.parameters[0])
        return cells, (0.0, size) if times_speed else (size, 0.0)


def _n_driven(record: ElementRecord) -> int:
    """Samples with those of the periods run in."""
    return record.drive.size + _RUN_IN_PERIODS * record.period * record.in_steady_state


_NO_LAW = ForceLaw(no_law, np.empty(0))


def _read_late(record: ElementRecord, response: FloatArray, delay: float) -> FloatArray:
    """Response as the channel reads it, a delay [s] late; as it is where the motion diverges."""
    if delay == 0.0 or not np.isfinite(response).all():
        return response
    time = record.step * np.arange(response.size, dtype=np.float64)
    if record.base is None:
        return delayed(time, response, delay)
    return delayed(time, response + record.base, delay) - record.base


def values_by_effect(
    parameters: Sequence[Parameter], theta: FloatArray
) -> dict[str, dict[str, float]]:
    """Values of unknowns by name, by effect."""
    values: dict[str, dict[str, float]] = {}
    for parameter, value in zip(parameters, theta, strict=True):
        values.setdefault(parameter.effect, {})[parameter.name] = float(value)
    return values


#: Drives between the samples, by the steps of a sample, as long as their record is in use.
_FINE_DRIVES: WeakKeyDictionary[ElementRecord, dict[int, FloatArray]] = WeakKeyDictionary()
#: Values of the parameter sets that a model was asked for last, which all records share.
_LAST_VALUES: WeakKeyDictionary[ElementModel, dict[object, _Values]] = WeakKeyDictionary()
