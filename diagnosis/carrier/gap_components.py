"""Parts of a carrier's gap.

One pattern and order over all runs, what it is fixed to and how it grows with the loads.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.comparison.problem import GapCell
from carrierflex.diagnosis.gap.findings import ORDER, SMALL_ORDER, Finding, PartGrowth
from carrierflex.diagnosis.gap.gap_map import GapMap, map_of
from carrierflex.diagnosis.gap.power_laws import WITHOUT, exponents
from carrierflex.identification.carrier.sensor_patterns import PATTERN_NAMES, RADIAL, FloatArray

IntArray = NDArray[np.int64]

_HOUSING = "housing"
_CARRIER = "carrier"
_UNDECIDED = "undecided"
#: A wave is fixed to the carrier where it holds this share of its order; a weaker one may be the
#: leak of a sensor's gain.
_OWN_ORDER = 0.9
#: Growth is fitted for this many parts.
_MOST_PARTS = 12
#: Parts of the gap that are named at most, and the smallest share worth naming.
_MOST_NAMED = 3
_SMALLEST_NAMED = 0.05
#: Small orders named at most.
_MOST_SMALL = 4
#: An exponent with torque is taken out where its interval is narrower than this on either side.
_KNOWN_WITHIN = 1.0
#: A part changes with the radial load where its sizes, the growth with torque taken out, differ by
#: this share of the largest.
_CHANGES = 0.5
TORQUE = "torque"
RADIAL_LOAD = "radial load"
SPEED = "speed"

#: Size of every condition in every run.
Conditions = Mapping[str, Mapping[str, float]]


@dataclass(frozen=True, eq=False)
class _GapComponent:
    """Cells of one pattern and order in all runs."""

    pattern: str  # sensor pattern
    order: int  # order
    share: float  # share of the gap
    amplitudes: dict[str, float]
    errors: dict[str, float]
    runs: tuple[str, ...]  # these runs
    p_value: float  # largest of those runs


def _gap_components(cells: Sequence[GapCell]) -> tuple[_GapComponent, ...]:
    """Parts of the gap over all runs, largest first.

    The two halves of a static tilt are one part.
    """
    own = map_of(cells)
    if not own:
        return ()
    orders = own.orders.astype(np.int64)
    patterns = _patterns_of_parts(own, orders)
    keys, first, part_of = np.unique(
        np.column_stack([patterns, orders]), axis=0, return_index=True, return_inverse=True
    )
    run_of = own.places[:, 0]
    shape = (len(keys), len(own.runs))
    place = np.ravel_multi_index((part_of.ravel(), run_of), shape)

    def by_part_and_run(values: FloatArray) -> FloatArray:
        """Sums of the cells of each part in each run."""
        flat = np.bincount(place, values, minlength=shape[0] * shape[1])
        return np.asarray(flat.reshape(shape), dtype=np.float64)

    sizes = np.sqrt(by_part_and_run(np.maximum(own.coherent, 0.0)))
    # Of the two components of the noise one lies along the amplitude.
    errors = np.sqrt(0.5 * by_part_and_run(own.noise))
    shares = np.bincount(part_of.ravel(), own.shares)
    beyond: dict[int, list[int]] = {}
    for cell in np.flatnonzero(own.are_significant).tolist():
        beyond.setdefault(int(part_of.ravel()[cell]), []).append(cell)
    parts = []
    for k in np.argsort(first).tolist():
        shown = beyond.get(k, [])
        runs = dict.fromkeys(run_of[shown].tolist())
        parts.append(
            _GapComponent(
                pattern=own.patterns[keys[k, 0]],
                order=int(keys[k, 1]),
                share=float(shares[k]),
                amplitudes={own.runs[run]: float(sizes[k, run]) for run in runs},
                errors={own.runs[run]: float(errors[k, run]) for run in runs},
                runs=tuple(own.runs[run] for run in runs),
                p_value=float(own.p_values[shown].max(initial=0.0)) if shown else 1.0,
            )
        )
    return tuple(sorted(parts, key=lambda part: -part.share))


def _patterns_of_parts(own: GapMap, orders: IntArray) -> IntArray:
    """Pattern of every cell's part: the second half of a static tilt is the first's."""
    patterns = own.places[:, 1].copy()
    if {"m=+1", "m=-1"} <= set(own.patterns):
        is_second_half = (patterns == own.patterns.index("m=-1")) & (orders == 0)
        patterns[is_second_half] = own.patterns.index("m=+1")
    return patterns


def _frame_of(part: _GapComponent, parts: Sequence[_GapComponent], n_planets: int) -> str:
    """What a part is fixed to, by its pattern and order.

    Static parts stay with the housing. A shape that turns with the carrier shows order n only in
    pattern ``m = n mod 4``, and in a radial pair as forward motion for n = 1, 5, ..., backward for
    n = 3, 7, ...; a part of another pattern pulsates in the housing. Four sensors read a wave of
    four lobes alike: where the planets' own orders are such (four and eight planets, the second of
    six), it looks as a housing that pulsates where they pass.

    Parameters
    ----------
    part : _GapComponent
        Part.
    parts : sequence of _GapComponent
        All parts, to compare with those of the same order.
    n_planets : int
        Planets.

    Returns
    -------
    str
        ``housing``, ``carrier`` or ``undecided``.
    """
    if part.order == 0:
        return _HOUSING
    if part.pattern == RADIAL:
        return _radial_frame(part, parts)
    numbers = {name: m for m, name in PATTERN_NAMES.items()}
    if part.pattern not in numbers:
        return _UNDECIDED
    rivals = [other for other in parts if other.order == part.order and other.pattern in numbers]
    total = sum(max(other.share, 0.0) for other in rivals)
    share = part.share / max(total, np.finfo(float).tiny)
    if part.order in (n_planets, 2 * n_planets) and part.order % 4 == 0 == numbers[part.pattern]:
        return _UNDECIDED
    if (part.order - numbers[part.pattern]) % 4 == 0:
        return _CARRIER if share >= _OWN_ORDER else _UNDECIDED
    return _HOUSING if share > 1.0 - _OWN_ORDER else _UNDECIDED


def _radial_frame(part: _GapComponent, parts: Sequence[_GapComponent]) -> str:
    if part.order % 2 == 0:
        return _UNDECIDED
    shares = {other.order: max(other.share, 0.0) for other in parts if other.pattern == RADIAL}
    n = abs(part.order)
    turning = n if n % 4 == 1 else -n
    total = shares.get(n, 0.0) + shares.get(-n, 0.0)
    share = shares.get(turning, 0.0) / max(total, np.finfo(float).tiny)
    if share >= _OWN_ORDER:
        return _CARRIER if part.order == turning else _UNDECIDED
    return _HOUSING if 0.25 <= share <= 0.75 else _UNDECIDED


def _growth(
    part: _GapComponent, parts: Sequence[_GapComponent], conditions: Conditions, n_planets: int
) -> PartGrowth:
    """Exponents of a part with every condition, over the runs that show it."""
    runs = part.runs
    size = np.array([part.amplitudes[run] for run in runs])
    error = np.array([part.errors[run] for run in runs])
    values: dict[str, FloatArray] = {
        name: np.array([by_run[run] for run in runs], dtype=np.float64)
        for name, by_run in conditions.items()
    }
    return PartGrowth(
        part.pattern,
        float(part.order),
        _frame_of(part, parts, n_planets),
        exponents(size, error, values),
    )


def growth_table(
    cells: Sequence[GapCell], conditions: Conditions, n_planets: int
) -> tuple[PartGrowth, ...]:
    """Frame and growth of the largest significant parts."""
    parts = _gap_components(cells)
    return tuple(
        _growth(part, parts, conditions, n_planets)
        for part in _significant_parts(parts)[:_MOST_PARTS]
    )


def carrier_where(
    cells: Sequence[GapCell], conditions: Conditions, n_planets: int
) -> tuple[Finding, ...]:
    """Where the gap lies: its largest parts, then the orders that are small yet significant.

    Parameters
    ----------
    cells : sequence of GapCell
        The map.
    conditions : mapping of str to mapping of str to float
        ``torque`` [N m], ``radial load`` [N] and ``speed`` [rad/s] of every run, sizes.
    n_planets : int
        Planets.

    Returns
    -------
    tuple of Finding
        Empty where no part of five per cent is significant.
    """
    parts = _gap_components(cells)
    significant_parts = _significant_parts(parts)
    large = [part for part in significant_parts if part.share >= _SMALLEST_NAMED][:_MOST_NAMED]
    if not large:
        return ()
    n_runs = len(conditions[TORQUE])
    rest = [part for part in significant_parts if part not in large]
    return (
        *(_large_part(part, parts, conditions, n_planets) for part in large),
        *_small_orders(rest, n_runs),
    )


def _significant_parts(parts: Sequence[_GapComponent]) -> list[_GapComponent]:
    return [part for part in parts if part.runs and part.share > 0.0]


def _large_part(
    part: _GapComponent, parts: Sequence[_GapComponent], conditions: Conditions, n_planets: int
) -> Finding:
    growth = _growth(part, parts, conditions, n_planets)
    return Finding(
        kind=ORDER,
        patterns=(part.pattern,),
        share=part.share,
        runs=part.runs,
        is_in_every_run=len(part.runs) == len(conditions[TORQUE]),
        order=part.order,
        frame=growth.frame,
        p_value=part.p_value,
        exponents=growth.exponents,
        changes_with=RADIAL_LOAD if _changes_with_load(part, growth, conditions) else "",
    )


def _changes_with_load(part: _GapComponent, growth: PartGrowth, conditions: Conditions) -> bool:
    """Whether a part differs between runs with and without a radial load.

    Its growth with torque is taken out where it is known.
    """
    loads = conditions[RADIAL_LOAD]
    exponent = growth.exponents[TORQUE]
    is_known = exponent.ci95[1] - exponent.value <= _KNOWN_WITHIN
    power = exponent.value if is_known else 0.0
    sizes = {
        run: part.amplitudes[run] / max(conditions[TORQUE][run], 1.0) ** power for run in part.runs
    }
    least = WITHOUT * max(loads.values())
    n_loaded = sum(loads[run] > least for run in part.runs)
    if n_loaded in (0, len(part.runs)):
        return False
    largest = max(sizes.values())
    return largest - min(sizes.values()) > _CHANGES * largest


def _small_orders(parts: Sequence[_GapComponent], n_runs: int) -> list[Finding]:
    """Orders that are significant in most runs though small, largest first.

    The patterns of one order together.
    """
    orders: dict[int, list[_GapComponent]] = {}
    for part in parts:
        if 2 * len(part.runs) > n_runs:
            orders.setdefault(abs(part.order), []).append(part)
    findings = []
    for order, group in orders.items():
        surest = min(group, key=lambda part: (-len(part.runs), part.p_value))
        findings.append(
            Finding(
                kind=SMALL_ORDER,
                patterns=tuple(dict.fromkeys(part.pattern for part in group)),
                share=sum(part.share for part in group),
                runs=surest.runs,
                is_in_every_run=len(surest.runs) == n_runs,
                order=order,
                p_value=surest.p_value,
            )
        )
    return sorted(findings, key=lambda finding: -finding.share)[:_MOST_SMALL]
