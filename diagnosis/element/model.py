"""Parameters of one element and the response they predict for a record."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numba import njit

from carrierflex.diagnosis.comparison.effect_cards import EffectCard, EffectParameter
from carrierflex.diagnosis.comparison.problem import BASELINE, Effects, FloatArray, Parameter
from carrierflex.diagnosis.element.cards import SLOT_NAMES
from carrierflex.diagnosis.element.records import ElementRecord
from carrierflex.identification.campaign.signals import band_limited, half_step_values, shifted
from carrierflex.simulation.element.kernels import (
    LAW_SIGNATURE,
    SLOT,
    SLOTS,
    driven_motion,
    no_law,
    restoring_force,
)

#: Largest phase of the natural frequency in one step [rad]; the relative error in frequency is its
#: fourth power over 120.
_STEP_PHASE = 0.25
_MOST_SUBSTEPS = 64
#: Prior standard deviation of an effect's parameter, in its scale.
_PRIOR = 10.0
#: Speed below which the sign of a measured motion is uncertain, as a share of its RMS.
REST_SPEED = 1e-3
#: Periods run before a record that starts in the steady state.
_RUN_IN_PERIODS = 2
#: Users' laws that one set may hold.
MOST_LAWS = 2


@dataclass(frozen=True, eq=False)
class ElementScale:
    """Own force, deflection, speed and stiffness, damping, mass of an element, from its measured motion.

    Parameters
    ----------
    force, deflection, speed : float
        RMS of the restoring force, the deflection and its rate.
    m, K1, C1, f0 : float
        Baseline by least squares in force space.
    """

    force: float
    deflection: float
    speed: float
    m: float
    K1: float
    C1: float
    f0: float

    def of(self, powers: tuple[int, int, int]) -> float:
        """Scale of a parameter with these powers of force, length and time."""
        return float(
            self.force ** powers[0]
            * self.deflection ** powers[1]
            * (self.deflection / self.speed) ** powers[2]
        )


@dataclass(frozen=True, eq=False)
class ElementModel:
    """One element under one kind of drive.

    Parameters
    ----------
    by_force : bool
        Force drive (displacement is predicted) or displacement drive (force is predicted).
    mass : float, optional
        Given mass; fitted where None.
    scale : ElementScale
        Sizes of everything.
    cards : mapping of str to EffectCard
        Library with the placebos.
    contained : tuple of str
        Effects of the baseline.
    units : tuple of str
        Units of force and deflection.
    substeps : int
        Steps of integration a sample.
    laws : mapping of str to object
        Users' compiled laws by effect.
    held : tuple of float
        Values at which the baseline's own parameters are held; empty where they are fitted.
    """

    by_force: bool
    mass: float | None
    scale: ElementScale
    cards: Mapping[str, EffectCard]
    contained: Effects
    units: tuple[str, str]
    substeps: int
    laws: Mapping[str, object]
    held: tuple[float, ...] = ()

    def parameters(self, effects: Effects) -> tuple[Parameter, ...]:
        """Unknowns: mass (where it is not given), K1, C1, f0, then those of every effect."""
        base = [("K1", (1, -1, 0), 0.0), ("C1", (1, -1, 1), 0.0), ("f0", (1, 0, 0), -np.inf)]
        if self.mass is None:
            base.insert(
                0, ("m", (1, -1, 2), 1e-9 * self.scale.of((1, -1, 2)) if self.by_force else 0.0)
            )
        own = [
            Parameter(
                BASELINE, name, _unit(powers, self.units), lower, np.inf, self.scale.of(powers)
            )
            for name, powers, lower in base
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
        powers = parameter.powers
        size = self.scale.of(powers) if powers else 1.0
        scale = parameter.scale * size
        return Parameter(
            effect,
            parameter.name,
            _unit(powers, self.units) if powers else parameter.unit,
            parameter.lower * size,
            parameter.upper * size,
            scale,
            np.inf if parameter.shape or effect in self.contained else _PRIOR * scale,
            shape=parameter.shape,
        )

    def predicted(
        self, record: ElementRecord, effects: Effects, theta: FloatArray, *, refined: int = 1
    ) -> FloatArray:
        """Response that a parameter set predicts for a record, shape (n,).

        Parameters
        ----------
        record : ElementRecord
            Record whose drive is applied.
        effects, theta
            Effects beside the baseline and all unknowns.
        refined : int
            Factor on the steps of integration.

        Returns
        -------
        ndarray
            Deflection (force drive) or force (displacement drive); infinite where the motion runs
            away.
        """
        flat, laws, own = self._flat(effects, theta)
        if self.by_force:
            response, slope = self._motion(record, flat, laws, own, refined)
        else:
            negative_control = (
                flat[SLOT["placebo_1"]] * record.negative_controls[0]
                + flat[SLOT["placebo_2"]] * record.negative_controls[1]
            )
            q, v, a = record.motion
            limits = np.array([record.step, REST_SPEED * self.scale.speed])
            response = restoring_force(q, v, a, flat, limits, *laws, *own) + negative_control
            slope = np.gradient(response)
        delay = flat[SLOT["delay"]] / record.step
        return (
            shifted(response, slope, delay) if delay and np.isfinite(response).all() else response
        )

    def _motion(
        self,
        record: ElementRecord,
        flat: FloatArray,
        laws: Sequence[object],
        own: Sequence[FloatArray],
        refined: int,
    ) -> tuple[FloatArray, FloatArray]:
        """Deflection and its change per sample under the record's force."""
        substeps = self.substeps * refined
        fine = _fine_drive(record, substeps, 0)
        for k in (1, 2):
            if flat[SLOT[f"placebo_{k}"]]:
                fine = fine + flat[SLOT[f"placebo_{k}"]] * _fine_drive(record, substeps, k)
        start = np.array([record.motion[0][0], record.motion[1][0]])
        limits = np.array([record.step / substeps, np.abs(record.motion[0]).max()])
        q, v = driven_motion(fine, start, substeps, flat, limits, *laws, *own)
        first = q.size - record.drive.size
        return q[first:], record.step * v[first:]

    def _flat(
        self, effects: Effects, theta: FloatArray
    ) -> tuple[FloatArray, tuple[object, object], tuple[FloatArray, FloatArray]]:
        """Flat parameter array, users' laws and their parameters."""
        flat = np.zeros(len(SLOTS))
        flat[[SLOT["v_s"], SLOT["tau"]]] = 1.0
        flat[SLOT["m"]] = self.mass or 0.0
        own: dict[str, list[float]] = {}
        for parameter, value in zip(self.parameters(effects), theta, strict=True):
            if parameter.effect in self.laws:
                own.setdefault(parameter.effect, []).append(float(value))
                continue
            slots = SLOT_NAMES.get((parameter.effect, parameter.name), (parameter.name,))
            for slot in slots:
                # v_s and tau start at one to keep divisions defined; every other place adds up.
                flat[SLOT[slot]] = value if slot in ("v_s", "tau") else flat[SLOT[slot]] + value
        if len(own) > MOST_LAWS:
            raise ValueError(
                f"effects {', '.join(own)}: {len(own)} users' laws in one set; expected at most {MOST_LAWS}"
            )
        laws = [*(self.laws[name] for name in own), no_law, no_law]
        arrays = [*(np.array(values) for values in own.values()), np.empty(0), np.empty(0)]
        return flat, (laws[0], laws[1]), (arrays[0], arrays[1])

    def signature(
        self, record: ElementRecord, effect: str, values: Mapping[str, float]
    ) -> FloatArray:
        """Force of one effect alone along the measured motion, in the trusted band, shape (n,)."""
        q, v, a = record.motion
        limits = np.array([record.step, REST_SPEED * self.scale.speed])
        flat = np.zeros(len(SLOTS))
        flat[[SLOT["v_s"], SLOT["tau"]]] = 1.0
        if effect in self.laws:
            law, own = (
                self.laws[effect],
                np.array([values[p.name] for p in self.cards[effect].parameters]),
            )
        else:
            law, own = no_law, np.empty(0)
            for name, value in values.items():
                for slot in SLOT_NAMES.get((effect, name), (name,)):
                    flat[SLOT[slot]] = value
        force = restoring_force(q, v, a, flat, limits, law, no_law, own, np.empty(0))
        return band_limited(force, record.step, record.cutoff_hz)


@lru_cache(maxsize=16)
def _fine_drive(record: ElementRecord, substeps: int, negative_control: int) -> FloatArray:
    """Drive (0) or one of its surrogates between the samples, with the periods run before a steady state."""
    drive = record.negative_controls[negative_control - 1] if negative_control else record.drive
    if record.in_steady_state:
        drive = np.concatenate([np.tile(drive[: record.period], _RUN_IN_PERIODS), drive])
    return half_step_values(drive, substeps, periodic=record.in_steady_state)


def compiled_laws(cards: Mapping[str, EffectCard]) -> dict[str, object]:
    """Users' laws by effect, compiled.

    Raises
    ------
    ValueError
        Where a card has neither a built-in law nor one of its own, or its own cannot be compiled.
    """
    laws: dict[str, object] = {}
    for name, card in cards.items():
        built_in = all((name, parameter.name) in SLOT_NAMES for parameter in card.parameters)
        if built_in:
            continue
        if card.law is None:
            raise ValueError(
                f"effect card '{name}': no law; expected a function (deflection, speed, parameters) -> force"
            )
        try:
            laws[name] = njit(LAW_SIGNATURE)(card.law)
        except Exception as error:
            first_line = str(error).strip().splitlines()[0]
            raise ValueError(
                f"effect card '{name}': its law does not compile: {first_line}"
            ) from error
    return laws


def substeps_for(scale: ElementScale, step: float) -> int:
    """Steps of integration a sample that keep the phase of the natural frequency small."""
    natural = np.sqrt(max(scale.K1, 0.0) / scale.m) if scale.m > 0.0 else 0.0
    return int(np.clip(np.ceil(natural * step / _STEP_PHASE), 1, _MOST_SUBSTEPS))


def _unit(powers: tuple[int, int, int], units: tuple[str, str]) -> str:
    """Unit text of a parameter: ``N s/m^3``."""
    symbols = (*units, "s")
    above = [_power(s, p) for s, p in zip(symbols, powers, strict=True) if p > 0]
    below = [_power(s, -p) for s, p in zip(symbols, powers, strict=True) if p < 0]
    top = " ".join(above) or "1"
    return (
        top
        if not below
        else f"{top}/{' '.join(below)}"
        if len(below) == 1
        else f"{top}/({' '.join(below)})"
    )


def _power(symbol: str, power: int) -> str:
    return symbol if power == 1 else f"{symbol}^{power}"
