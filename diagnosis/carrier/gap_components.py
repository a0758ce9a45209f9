"""Components of a carrier's gap: one pattern and order over all runs, its frame and its growth."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from carrierflex.diagnosis.comparison.problem import GapCell, IntArray
from carrierflex.diagnosis.gap.findings import (
    KNOWN_WITHIN,
    ORDER,
    SMALL_ORDER,
    WITHOUT,
    Finding,
    PartGrowth,
    exponents,
    undetermined,
)
from carrierflex.diagnosis.gap.gap_map import GapMap, map_of
from carrierflex.identification.carrier.sensor_patterns import PATTERN_NAMES, RADIAL, FloatArray
from carrierflex.simulation.carrier.measured_laws.rim_patterns import has_wave

#: Lobes of a wave that shows in a pattern, by its name.
_LOBES = {name: m for m, name in PATTERN_NAMES.items()}
_HOUSING = "housing"
_CARRIER = "carrier"
_UNDECIDED = "undecided"
#: A wave is fixed to the carrier where it holds this share of its order; a weaker one may be the
#: leak of a sensor's gain.
_SHARE_OF_ORDER = 0.9
SMALLEST_NAMED = 0.05
#: A component changes with the radial load where its sizes, the growth with torque taken out,
#: differ by this share of the largest.
_CHANGES = 0.5
TORQUE = "torque"
RADIAL_LOAD = "radial load"
SPEED = "speed"


@dataclass(frozen=True, eq=False)
class _Component:
    """Cells of one pattern and order in all runs."""

    pattern: str
    order: int
    share: float  # share of the gap
    amplitudes: dict[str, float]  # by run in which it is significant, as are the errors
    errors: dict[str, float]
    p_value: float  # largest of those runs

    @property
    def runs(self) -> tuple[str, ...]:
        """Runs in which it is significant."""
        return tuple(self.amplitudes)


def components_of(cells: Sequence[GapCell]) -> tuple[_Component, ...]:
    """Components of the gap over all runs, largest first."""
    gap = map_of(cells)
    if not gap:
        return ()
    orders = gap.orders.astype(np.int64)
    keys, first, component_of = np.unique(
        np.column_stack([_patterns(gap, orders), orders]),
        axis=0,
        return_index=True,
        return_inverse=True,
    )
    component_of, run_of = component_of.ravel(), gap.indices[:, 0]

    def by_component_and_run(values: FloatArray) -> FloatArray:
        """Sums of the cells of each component in each run."""
        sums = np.zeros((len(keys), len(gap.runs)))
        np.add.at(sums, (component_of, run_of), values)
        return sums

    sizes = np.sqrt(by_component_and_run(np.maximum(gap.coherent, 0.0)))
    # Of the two components of the noise one lies along the amplitude.
    errors = np.sqrt(0.5 * by_component_and_run(gap.noise))
    shares = np.bincount(component_of, gap.shares)
    beyond: dict[int, list[int]] = {}
    for number in np.flatnonzero(gap.are_significant).tolist():
        beyond.setdefault(int(component_of[number]), []).append(number)
    components = []
    for k in np.argsort(first).tolist():
        shown = beyond.get(k, [])
        runs = dict.fromkeys(run_of[shown].tolist())
        components.append(
            _Component(
                pattern=gap.patterns[keys[k, 0]],
                order=int(keys[k, 1]),
                share=float(shares[k]),
                amplitudes={gap.runs[run]: float(sizes[k, run]) for run in runs},
                errors={gap.runs[run]: float(errors[k, run]) for run in runs},
                p_value=float(gap.p_values[shown].max(initial=0.0)) if shown else 1.0,
            )
        )
    return tuple(sorted(components, key=lambda component: -component.share))


def _patterns(gap: GapMap, orders: IntArray) -> IntArray:
    """Pattern of every cell's component: the second half of a static tilt is the first's."""
    patterns = gap.indices[:, 1].copy()
    if {"m=+1", "m=-1"} <= set(gap.patterns):
        is_second_half = (patterns == gap.patterns.index("m=-1")) & (orders == 0)
        patterns[is_second_half] = gap.patterns.index("m=+1")
    return patterns


def _frame_of(component: _Component, components: Sequence[_Component], n_planets: int) -> str:
    """Frame of a component by its pattern and order: ``housing``, ``carrier`` or ``undecided``.

    Static components stay with the housing. A shape that turns with the carrier shows order n only
    in pattern ``m = n mod 4``, and in a radial pair as forward motion for n = 1, 5, ..., backward
    for n = 3, 7, ...; a component of another pattern pulsates in the housing. Four sensors read a
    wave of four lobes alike: where the planets' orders are such (four and eight planets, the second
    of six), it looks as a housing that pulsates where they pass.
    """
    order = component.order
    if order == 0:
        return _HOUSING
    if component.pattern == RADIAL:
        return _radial_frame(component, components)
    if component.pattern not in _LOBES:
        return _UNDECIDED
    number = _LOBES[component.pattern]
    rivals = [other for other in components if other.order == order and other.pattern in _LOBES]
    total = sum(max(other.share, 0.0) for other in rivals)
    share = component.share / max(total, np.finfo(float).tiny)
    if order in (n_planets, 2 * n_planets) and order % 4 == 0 == number:
        return _UNDECIDED
    if (order - number) % 4 == 0:
        return _CARRIER if share >= _SHARE_OF_ORDER else _UNDECIDED
    return _HOUSING if share > 1.0 - _SHARE_OF_ORDER else _UNDECIDED


def _radial_frame(component: _Component, components: Sequence[_Component]) -> str:
    if component.order % 2 == 0:
        return _UNDECIDED
    shares = {other.order: max(other.share, 0.0) for other in components if other.pattern == RADIAL}
    n = abs(component.order)
    turning = n if n % 4 == 1 else -n
    total = shares.get(n, 0.0) + shares.get(-n, 0.0)
    share = shares.get(turning, 0.0) / max(total, np.finfo(float).tiny)
    if share >= _SHARE_OF_ORDER:
        return _CARRIER if component.order == turning else _UNDECIDED
    return _HOUSING if 0.25 <= share <= 0.75 else _UNDECIDED


@dataclass(frozen=True, eq=False)
class GapComponents:
    """Components of a gap, what each is fixed to and how it grows with the loads."""

    components: Sequence[_Component]  # Largest first
    #: ``torque`` [N m], ``radial load`` [N] and ``speed`` [rad/s] of every run, sizes
    conditions: Mapping[str, Mapping[str, float]]
    n_planets: int  # Planets
    fitted: Sequence[str] = ()  # Frames and patterns of which the baseline takes the mean

    def growth(self) -> tuple[PartGrowth, ...]:
        """Frame and growth of the largest significant components."""
        return tuple(map(self._growth, self._significant[:12]))

    def where(self) -> tuple[Finding, ...]:
        """Where the gap lies: largest components, then orders that are small yet significant.

        Empty where no component of five per cent is significant.
        """
        large = [one for one in self._significant if one.share >= SMALLEST_NAMED][:3]
        if not large:
            return ()
        rest = [one for one in self._significant if one not in large]
        return (*map(self._finding, large), *_small_orders(rest, len(self.conditions[TORQUE])))

    @property
    def _significant(self) -> list[_Component]:
        return [one for one in self.components if one.runs and one.share > 0.0]

    def _growth(self, component: _Component) -> PartGrowth:
        """Exponents of a component with every condition, over the runs that show it."""
        values: dict[str, FloatArray] = {
            name: np.array([by_run[run] for run in component.runs], dtype=np.float64)
            for name, by_run in self.conditions.items()
        }
        sizes, errors = (list(of.values()) for of in (component.amplitudes, component.errors))
        growth = exponents(np.array(sizes), np.array(errors), values)
        if self._is_fitted(component):
            # What is beside a mean grows either way from where the loads are mean.
            reason = "the baseline takes its mean"
            growth = {name: undetermined(one.n_points, reason) for name, one in growth.items()}
        return PartGrowth(
            component.pattern,
            float(component.order),
            _frame_of(component, self.components, self.n_planets),
            growth,
        )

    def _is_fitted(self, component: _Component) -> bool:
        """Whether the baseline takes the mean of what four axial sensors read as a component."""
        number = _LOBES.get(component.pattern)
        order = component.order
        return number is not None and any(
            has_wave(pattern, order, lobes, self.n_planets)
            for pattern in self.fitted
            for lobes in range(-1, order + 3)
            if (lobes - number) % 4 == 0
        )

    def _finding(self, component: _Component) -> Finding:
        growth = self._growth(component)
        return Finding(
            kind=ORDER,
            patterns=(component.pattern,),
            share=component.share,
            runs=component.runs,
            is_in_every_run=len(component.runs) == len(self.conditions[TORQUE]),
            order=component.order,
            frame=growth.frame,
            p_value=component.p_value,
            exponents=growth.exponents,
            changes_with=RADIAL_LOAD if self._changes_with_load(component, growth) else "",
        )

    def _changes_with_load(self, component: _Component, growth: PartGrowth) -> bool:
        """Whether a component differs between runs with and without a radial load."""
        if self._is_fitted(component):
            return False
        loads, exponent = self.conditions[RADIAL_LOAD], growth.exponents[TORQUE]
        is_known = exponent.is_within(KNOWN_WITHIN)
        torques = [self.conditions[TORQUE][run] for run in component.runs]
        if not is_known and max(torques) - min(torques) > _CHANGES * max(torques):
            return False
        power = exponent.value if is_known else 0.0
        amplitudes = component.amplitudes.values()
        sizes = [
            size / max(torque, 1.0) ** power
            for size, torque in zip(amplitudes, torques, strict=True)
        ]
        is_loaded = {loads[run] > WITHOUT * max(loads.values()) for run in component.runs}
        return len(is_loaded) == 2 and max(sizes) - min(sizes) > _CHANGES * max(sizes)


def _small_orders(components: Sequence[_Component], n_runs: int) -> list[Finding]:
    """Orders that are significant in most runs though small, largest first."""
    orders: dict[int, list[_Component]] = {}
    for component in components:
        if 2 * len(component.runs) > n_runs:
            orders.setdefault(abs(component.order), []).append(component)
    findings = []
    for order, group in orders.items():
        surest = min(group, key=lambda component: (-len(component.runs), component.p_value))
        findings.append(
            Finding(
                kind=SMALL_ORDER,
                patterns=tuple(dict.fromkeys(component.pattern for component in group)),
                share=sum(component.share for component in group),
                runs=surest.runs,
                is_in_every_run=len(surest.runs) == n_runs,
                order=order,
                p_value=surest.p_value,
            )
        )
    return sorted(findings, key=lambda finding: -finding.share)[:4]
