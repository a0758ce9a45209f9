"""Sizes, pairs and additions of a campaign from the products of its signatures.

With P the products of the signatures beside the baseline over the noise's variance, amplitudes u of
cause a leave a signal of energy ``u' P_aa u``, and the refitted cause b leaves of it

    E_ab(u) = u' (P_aa - P_ab P_bb^+ P_ba) u,

the squared Mahalanobis distance between both causes. Its root over that of the number of samples is
an RMS in floors of noise, the measure of the diagnosis's rules.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from carrierflex.diagnosis.comparison.problem import FloatArray, IntArray
from carrierflex.diagnosis.inference.planning.results import (
    ALIKE,
    NEVER,
    PARTED,
    Addition,
    CampaignPlan,
    CausePair,
    Costs,
    HiddenSize,
    RankedAddition,
    VisibleSize,
)
from carrierflex.diagnosis.inference.thresholds import Thresholds
from carrierflex.identification.estimation.resampling import NORMAL_95
from carrierflex.identification.estimation.scaled_least_squares import normal_inverse
from carrierflex.simulation.fit_parameter import FitParameter

#: Columns whose square is below this share of the largest do not act.
_ABSENT = 1e-24


@dataclass(frozen=True)
class Signature:
    """Columns of one effect at one value of its shape, or on one channel."""

    effect: str  # Effect id
    variant: tuple[float, ...]  # Shape or channel; empty without
    columns: tuple[int, ...]  # Numbers of the columns in the table


@dataclass(frozen=True, eq=False)
class PlannedTable:
    """Products of target, baseline's regressors and signatures, over the noise's variance.

    A part is one channel of one run; signals of parts that were not measured are zero. Columns are
    those of unit parameters times their scale: the amplitudes count in sizes worth noticing.
    """

    #: Products ``X' X / sigma²``: the target first, then `n_base` regressors, then signatures,
    #: shape (n_parts, n, n)
    gram: FloatArray
    n_base: int  # Regressors of the baseline
    #: Precision of what is known of each baseline parameter, in the units of its column; zero where
    #: nothing is, infinite where its value is known, shape (n_base,)
    known: FloatArray
    signatures: tuple[Signature, ...]  # Columns by effect and variant
    parameters: Mapping[str, FitParameter]  # First amplitude of every effect
    runs: IntArray  # Run of every part
    channels: IntArray  # Channel of every part
    n_samples: FloatArray  # Samples of every part, shape (n_parts,)
    run_names: tuple[str, ...]  # Runs by number
    channel_names: tuple[str, ...]  # Channels by number
    noise_std: float  # Root of the mean variance of the noise, in the unit of the channels
    #: Columns at the end of what an unrecorded radial load would add, run by run, scaled to a
    #: standard deviation of one; 0 where loads are on record
    n_unrecorded: int = 0
    #: What strain gauges of the shaft's bending tell of each of these columns
    bending_precision: float = 0.0
    #: Largest size of each column's amplitude, infinite where it has none, shape (n,); None: no
    #: column has one
    bound: FloatArray | None = None

    @property
    def effects(self) -> tuple[str, ...]:
        """Effects, in the order of the table."""
        return tuple(dict.fromkeys(signature.effect for signature in self.signatures))

    def of(self, effect: str) -> tuple[Signature, ...]:
        """Signatures of one effect."""
        return tuple(signature for signature in self.signatures if signature.effect == effect)

    def weights(self, addition: Addition) -> FloatArray:
        """How often every part is measured with an addition, over how often in the table."""
        of_run = np.array([addition.minutes.get(name, 0.0) for name in self.run_names])
        of_channel = np.array([float(name in addition.channels) for name in self.channel_names])
        return np.asarray(of_run[self.runs] * of_channel[self.channels])

    def measured(self, weights: FloatArray, load_precision: float = np.inf) -> "_MeasuredGram":
        """Products over the parts that are measured, the regressors of the baseline taken out.

        And the unrecorded radial load, where its precision is finite.
        """
        some = np.flatnonzero(weights)
        products = np.einsum("p,pij->ij", weights[some], self.gram[some])
        n_samples = float(weights @ self.n_samples)
        bound = np.full(len(products), np.inf) if self.bound is None else self.bound
        # An amplitude at its bound costs what two causes must differ by to be distinguished.
        cost = n_samples * (Thresholds().exchange_ratio / bound) ** 2
        base = 1 + np.flatnonzero(np.isfinite(self.known))
        products[base, base] += self.known[base - 1] + cost[base]
        if np.isfinite(load_precision):
            loads = np.arange(len(products) - self.n_unrecorded, len(products))
            products[loads, loads] += load_precision
            base = np.concatenate([base, loads])
        acts = [k for k in base.tolist() if products[k, k] > _ABSENT * np.max(products[base, base])]
        square, projected = np.diag(products).copy(), products
        if acts:
            # What they leave of all others (Schur complement).
            inverse = normal_inverse(products[np.ix_(acts, acts)])
            projected = products - products[:, acts] @ inverse @ products[acts, :]
        return _MeasuredGram(projected, square, n_samples, cost)


@dataclass(frozen=True, eq=False)
class _MeasuredGram:
    """What a campaign tells of the signatures."""

    #: Products of what the baseline leaves of the columns, over the noise's variance, shape (n, n)
    projected: FloatArray
    square: FloatArray  # Squares of the whole columns, shape (n,)
    n_samples: float  # Samples of all channels
    cost: FloatArray  # Energy of an amplitude of one by its bound, shape (n,)

    def energies(self, signature: Signature) -> tuple[float, float]:
        """Energy of a signature's mean direction beside the baseline, and of all of it."""
        columns = list(signature.columns)
        return float(self.projected[columns, columns].sum()), float(self.square[columns].sum())

    def shows(self, signature: Signature) -> bool:
        """Whether the baseline leaves enough of a signature to be seen."""
        remaining, square = self.energies(signature)
        return remaining > Thresholds().surviving_share ** 2 * square

    def fitted(self, columns: list[int]) -> tuple[FloatArray, FloatArray]:
        """Normal matrix of a signature that is fitted within its bounds, and its columns' scale."""
        square = self.square[columns] + self.cost[columns]
        length = np.sqrt(np.maximum(square, np.finfo(float).tiny))
        gram = self.projected[np.ix_(columns, columns)] + np.diag(self.cost[columns])
        return gram / np.outer(length, length), length


#: A rival must leave this many times what the diagnosis asks for: the curves, gains and angles of
#: the machine differ from the model's.
_MARGIN = 1.1
#: Where all that is feasible together leaves less than this share of the gap, nothing parts a pair.
_NEVER = 0.02
#: Directions of a fit below this share of the clearest are left at zero.
_DEPENDENT = 1e-9
#: Directions of a signature that the baseline leaves less of than this share of the clearest are
#: not seen, and say nothing of what another cause makes of them.
_UNSEEN = 1e-6
#: Parts of the record of which one at a time is held out: as many as the conditions of a short
#: campaign.
_FOLDS = 4


@dataclass(frozen=True, eq=False)
class _Case:
    """One variant of a cause: its amplitudes at the wanted gap as planned, shape (m, k)."""

    signature: Signature
    directions: FloatArray


def campaign_plan(
    table: PlannedTable,
    additions: Sequence[Addition],
    *,
    planned: Addition,
    gap: float,
    names: tuple[str, str, str],
    costs: Costs,
    is_measured: bool,
    note: Callable[[str], None] = lambda text: None,
) -> CampaignPlan:
    """Plan of a campaign with what could be added to it.

    `gap` in floors is that at which causes are to be distinguished; `is_measured`: whether the
    target holds records, whose gap then says which amplitudes a cause has.
    """
    wanted = Thresholds().exchange_ratio
    weights = table.weights(planned)
    measured = table.measured(weights)
    fitted = _measured_cases(table, measured) if is_measured else None
    if fitted is not None:
        gap = float(np.sqrt(measured.projected[0, 0] / measured.n_samples))
    cases = _planned_cases(table, measured, gap) if fitted is None else fitted
    everything = table.measured(np.ones(table.n_samples.size))
    pairs = []
    for cause in cases:
        note(f"what others make of {cause}")
        for rival in cases:
            if rival != cause:
                pairs.append(_pair(table, measured, everything, cases, cause, rival, gap))
    alike = [pair for pair in pairs if pair.state == ALIKE]
    ranked = []
    for addition in additions if alike else ():
        note(f"addition: {addition.text}")
        ranked.append(_ranked(table, cases, alike, addition))
    ranked.sort(key=_order)
    return CampaignPlan(
        *names,
        gap=gap,
        noise_std=table.noise_std,
        is_measured=fitted is not None,
        left_wanted=wanted,
        sizes=tuple(_visible_size(table, measured, effect) for effect in table.effects),
        hidden=_hidden_sizes(table, weights),
        pairs=tuple(pairs),
        additions=tuple(ranked),
        costs=costs,
    )


def _order(ranked: RankedAddition) -> tuple[float, ...]:
    """Sufficient ones by cost; of the others those that come nearest to parting all pairs first."""
    # Of like ones the first in the order of the additions, not the larger by a hair.
    mean_remaining = -float(f"{ranked.mean_left:.3g}")
    if ranked.is_sufficient:
        return (0.0, ranked.addition.cost, mean_remaining)
    return (1.0, -float(len(ranked.parted)), mean_remaining, ranked.addition.cost)


def _visible_size(table: PlannedTable, measured: _MeasuredGram, effect: str) -> VisibleSize:
    """Smallest size of an effect, of the median of its variants and of the mean direction."""
    parameter = table.parameters[effect]
    rows = []
    for signature in table.of(effect):
        remaining, square = measured.energies(signature)
        if square > 0.0:
            n, remaining = len(signature.columns), max(remaining, 0.0)
            rows.append((remaining / n, np.sqrt(remaining / square), n))
    energies, shares, numbers = np.array(rows).reshape(-1, 3).T
    least = Thresholds().surviving_share
    surviving = float(np.median(shares)) if rows else 0.0
    sigmas = _visible_multiple(int(max(numbers, default=1)))
    root = np.sqrt(measured.n_samples)
    is_visible = surviving >= least
    visible_gap = sigmas / root if is_visible else np.inf
    # Below this RMS of the gap, in floors, records are at the noise floor.
    least_gap = float(np.sqrt(Thresholds().floor_ratio - 1.0))
    gap_named = max(visible_gap, least_gap)
    per_gap = parameter.scale * root / np.sqrt(np.median(energies)) if is_visible else 1.0
    return VisibleSize(
        effect=effect,
        parameter=parameter.name,
        unit=parameter.unit,
        noticeable=parameter.scale,
        seen_from=float(visible_gap * per_gap),
        named_from=float(gap_named * per_gap),
        gap_seen=float(visible_gap),
        gap_named=float(gap_named),
        sigmas=sigmas,
        surviving=surviving,
    )


def _hidden_sizes(table: PlannedTable, weights: FloatArray) -> tuple[HiddenSize, ...]:
    """Smallest sizes beside a radial load that is not on record, alone and with strain gauges."""
    if not table.n_unrecorded:
        return ()
    grams = [
        table.measured(weights, precision)
        for precision in (np.inf, 1.0, 1.0 + table.bending_precision)
    ]
    sizes = []
    for effect in table.effects:
        shown = [signature for signature in table.of(effect) if grams[0].shows(signature)]
        if not shown:
            continue
        parameter = table.parameters[effect]
        sigmas = _visible_multiple(max(len(signature.columns) for signature in shown))
        visible_sizes = []
        for gram in grams:
            energies = []
            for at in shown:
                remaining, square = gram.energies(at)
                # Below rounding nothing is left.
                energies.append(max(remaining, _DEPENDENT * square) / len(at.columns))
            visible_sizes.append(sigmas * parameter.scale / np.sqrt(np.median(energies)))
        sizes.append(HiddenSize(effect, parameter.name, parameter.unit, *map(float, visible_sizes)))
    return tuple(sizes)


def _planned_cases(
    table: PlannedTable, measured: _MeasuredGram, gap: float
) -> dict[str, list[_Case]]:
    """Directions of every visible variant at which it leaves the wanted gap."""
    size = gap * np.sqrt(measured.n_samples)
    cases: dict[str, list[_Case]] = {}
    for signature in table.signatures:
        directions = _visible_directions(measured, signature)
        if len(directions) and measured.shows(signature):
            cases.setdefault(signature.effect, []).append(_Case(signature, size * directions))
    return cases


def _measured_cases(table: PlannedTable, measured: _MeasuredGram) -> dict[str, list[_Case]] | None:
    """Fitted amplitudes of every effect that the records do not rule out."""
    square = float(measured.projected[0, 0])
    fits: dict[str, list[tuple[float, _Case]]] = {}
    for signature in table.signatures:
        if not measured.shows(signature):
            continue
        columns = list(signature.columns)
        gram, length = measured.fitted(columns)
        right = measured.projected[columns, 0] / length
        amplitudes = np.linalg.pinv(gram, rcond=_DEPENDENT, hermitian=True) @ right
        remaining = square - float(amplitudes @ right)
        case = _Case(signature, (amplitudes / length)[None])
        fits.setdefault(signature.effect, []).append((remaining, case))
    best = min((remaining for pairs in fits.values() for remaining, _ in pairs), default=square)
    explains = Thresholds().explained
    if best > (1.0 - explains) * square:
        return None
    most = best + measured.n_samples * Thresholds().exchange_ratio ** 2
    most = min(most, (1.0 - explains) * square + explains * best)
    # Every shape that the records allow: one torque says nothing of the torque at which a
    # clearance closes.
    consistent = {
        effect: [case for remaining, case in of_effect if remaining <= most]
        for effect, of_effect in fits.items()
    }
    return {effect: cases for effect, cases in consistent.items() if cases}


def _remaining_energy(
    table: PlannedTable, measured: _MeasuredGram, cases: Sequence[_Case], rival: str
) -> float:
    """Energy that a rival leaves of a cause, the median over the cause's variants."""
    return float(np.median([_least_energy(measured, case, table.of(rival)) for case in cases]))


def _pair(
    table: PlannedTable,
    measured: _MeasuredGram,
    everything: _MeasuredGram,
    cases: Mapping[str, Sequence[_Case]],
    cause: str,
    rival: str,
    gap: float,
) -> CausePair:
    def remaining_in(gram: _MeasuredGram) -> float:
        return np.sqrt(_remaining_energy(table, gram, cases[cause], rival) / gram.n_samples)

    remaining = remaining_in(measured)
    planned = []
    for case in cases[cause]:
        columns, direction = list(case.signature.columns), case.directions[0]
        planned.append(direction @ measured.projected[np.ix_(columns, columns)] @ direction)
    # RMS that the cause leaves as planned, in floors.
    size = float(np.sqrt(np.median(planned) / measured.n_samples))
    sine = min(1.0, remaining / size) if size > 0.0 else 0.0
    wanted = Thresholds().exchange_ratio
    state = PARTED
    if remaining < wanted:
        state = ALIKE if remaining_in(everything) > _NEVER * gap else NEVER
    return CausePair(
        cause,
        rival,
        float(np.rad2deg(np.arcsin(sine))),
        float(remaining),
        float(wanted / sine) if sine > 1e-3 else np.inf,
        state,
    )


def _ranked(
    table: PlannedTable,
    cases: Mapping[str, Sequence[_Case]],
    alike: Sequence[CausePair],
    addition: Addition,
) -> RankedAddition:
    enlarged = table.measured(table.weights(addition))
    wanted = _MARGIN * Thresholds().exchange_ratio
    energies = {
        (pair.cause, pair.rival): _remaining_energy(table, enlarged, cases[pair.cause], pair.rival)
        for pair in alike
    }
    remaining = np.sqrt(np.array(list(energies.values())) / enlarged.n_samples)
    parted = tuple(pair for pair, one in zip(energies, remaining, strict=True) if one >= wanted)
    energy = min(energies.values())
    return RankedAddition(
        addition,
        least_left=float(remaining.min()),
        mean_left=float(np.exp(np.mean(np.log(np.maximum(remaining, np.finfo(float).tiny))))),
        distance=float(np.sqrt(energy)),
        information=0.5 * energy,
        per_cost=0.5 * energy / addition.cost,
        parted=parted,
        is_sufficient=len(parted) == len(remaining),
    )


def _visible_multiple(n_parameters: int) -> float:
    """Root n of the energy from which a cause of q amplitudes shrinks the held-out gap."""
    lost = n_parameters * _FOLDS / (_FOLDS - 1.0)
    # E² - (2 lost + 4 z²) E + lost² - 2 q z² = 0; the larger root has a positive gain.
    # An effect must shrink the gap in 97.5 % of the draws of a diagnosis.
    half = lost + 2.0 * NORMAL_95**2
    constant = lost**2 - 2.0 * n_parameters * NORMAL_95**2
    return float(np.sqrt(half + np.sqrt(half**2 - constant)))


def _visible_directions(measured: _MeasuredGram, signature: Signature) -> FloatArray:
    """Amplitudes that leave one noise variance each, at right angles to each other."""
    columns = list(signature.columns)
    values, vectors = np.linalg.eigh(measured.projected[np.ix_(columns, columns)])
    floor = _UNSEEN * max(float(measured.square[columns].max()), np.finfo(float).tiny)
    keep = values > max(_UNSEEN * values.max(), floor)
    return np.asarray((vectors[:, keep] / np.sqrt(values[keep])).T)


def _least_energy(measured: _MeasuredGram, case: _Case, rivals: tuple[Signature, ...]) -> float:
    """Energy that a refitted rival leaves of a cause, of its variants the one that fits best."""
    of_cause, projected = list(case.signature.columns), measured.projected
    energies = [np.inf]
    for rival in rivals:
        columns = list(rival.columns)
        gram, length = measured.fitted(columns)
        mixed = projected[np.ix_(of_cause, columns)] / length
        inverse = np.linalg.pinv(gram, rcond=_UNSEEN, hermitian=True)
        remaining = projected[np.ix_(of_cause, of_cause)] - mixed @ inverse @ mixed.T
        along = case.directions @ remaining @ case.directions.T
        energies.append(float(np.linalg.eigvalsh(along)[0]))
    return max(0.0, min(energies))
