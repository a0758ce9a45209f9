"""Sizes, pairs and additions of a campaign from the products of its signatures."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.inference.planning.information import (
    least_left_energy,
    left_energy,
    named_gap,
    seen_directions,
    visible_multiple,
)
from carrierflex.diagnosis.inference.planning.results import (
    ALIKE,
    NEVER,
    PARTED,
    Addition,
    CampaignPlan,
    CausePair,
    Costs,
    RankedAddition,
    VisibleSize,
)
from carrierflex.diagnosis.inference.planning.table import MeasuredGram, PlannedTable, Signature
from carrierflex.diagnosis.inference.thresholds import Thresholds

FloatArray = NDArray[np.float64]

#: A rival must leave this many times what the diagnosis asks for: the machine's own curves,
#: gains and places differ from the model's.
_MARGIN = 1.1
#: Where all that is feasible together leaves less than this share of the gap, nothing parts a pair.
_NEVER = 0.02
#: Share of the gap that a cause must explain to be looked at, where records say what is there.
_EXPLAINS = 0.5
#: Directions of a fit below this share of the clearest are left at zero.
_DEPENDENT = 1e-9


@dataclass(frozen=True, eq=False)
class _Case:
    """One variant of a cause: its amplitudes at the wanted gap as planned, shape (m, k).

    Of several directions the one that a rival imitates best counts.
    """

    signature: Signature
    directions: FloatArray
    is_one: bool


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
    """Plan of a campaign.

    Parameters
    ----------
    table : PlannedTable
        Products of the signatures over all that is planned or could be added.
    additions : sequence of Addition
        What could be added.
    planned : Addition
        The campaign as planned.
    gap : float
        Gap in floors at which causes are to be told apart; that of the records where there are any.
    names : tuple of str
        Name and kind of the campaign, unit of the channels.
    costs : Costs
        Costs that the additions were given.
    is_measured : bool
        Whether the target holds records, whose gap then says which amplitudes a cause has.
    note : callable
        Told each step, for progress.

    Returns
    -------
    CampaignPlan
        Sizes, pairs, additions.
    """
    wanted = Thresholds().exchange_ratio
    measured = table.measured(table.weights(planned.minutes, planned.channels))
    fitted = _measured_cases(table, measured) if is_measured else None
    if fitted is not None:
        gap = float(np.sqrt(measured.projected[0, 0] / measured.n_samples))
    cases = _planned_cases(table, measured, gap) if fitted is None else fitted
    everything = table.measured(
        table.weights(
            {name: 1.0 for name in table.run_names},
            table.channel_names,
        )
    )
    pairs = []
    for cause in cases:
        note(f"what others make of {cause}")
        for rival in cases:
            if rival != cause:
                pairs.append(_pair(table, (measured, everything), cases, (cause, rival), gap))
    alike = [pair for pair in pairs if pair.state == ALIKE]
    ranked = []
    for addition in additions if alike else ():
        note(f"addition: {addition.text}")
        enlarged = table.measured(table.weights(addition.minutes, addition.channels))
        ranked.append(_ranked(table, enlarged, cases, alike, addition))
    ranked.sort(key=_order)
    return CampaignPlan(
        *names,
        gap=gap,
        noise_std=table.noise_std,
        is_measured=fitted is not None,
        left_wanted=wanted,
        sizes=tuple(_visible_size(table, measured, effect) for effect in table.effects),
        pairs=tuple(pairs),
        additions=tuple(ranked),
        costs=costs,
    )


def _order(ranked: RankedAddition) -> tuple[float, ...]:
    """Sufficient ones by cost; of the others those that come nearest to parting all pairs first."""
    # Of like ones the first in the order of the additions, not the larger by a hair.
    mean_left = -float(f"{ranked.mean_left:.3g}")
    if ranked.is_sufficient:
        return (0.0, ranked.addition.cost, mean_left)
    return (1.0, -float(len(ranked.parted)), mean_left, ranked.addition.cost)


def _visible_size(table: PlannedTable, measured: MeasuredGram, effect: str) -> VisibleSize:
    """Smallest size of an effect, of the median of its variants and of the mean direction.

    A size s of all scales leaves the energy ``s² tr(P) / k``, k columns.
    """
    parameter = table.parameters[effect]
    energies = []
    shares = []
    numbers = []
    for signature in table.of(effect):
        own = list(signature.columns)
        whole = float(measured.square[own].sum())
        if whole == 0.0:
            continue
        seen = max(float(measured.projected[own, own].sum()), 0.0)
        energies.append(seen / len(own))
        shares.append(np.sqrt(seen / whole))
        numbers.append(len(own))
    least = Thresholds().surviving_share
    surviving = float(np.median(shares)) if shares else 0.0
    sigmas = visible_multiple(max(numbers, default=1))
    if surviving < least:
        return VisibleSize(
            effect, parameter.name, parameter.unit, parameter.scale, np.inf, np.inf, np.inf,
            np.inf, sigmas, surviving,
        )  # fmt: skip
    energy = float(np.median(energies))
    root = np.sqrt(measured.n_samples)
    gap_seen = sigmas / root
    gap_named = max(gap_seen, named_gap(Thresholds()))
    per_gap = parameter.scale * root / np.sqrt(energy)
    return VisibleSize(
        effect,
        parameter.name,
        parameter.unit,
        parameter.scale,
        float(gap_seen * per_gap),
        float(gap_named * per_gap),
        float(gap_seen),
        float(gap_named),
        sigmas,
        surviving,
    )


def _planned_cases(
    table: PlannedTable, measured: MeasuredGram, gap: float
) -> dict[str, list[_Case]]:
    """Directions of every visible variant at which it leaves the wanted gap."""
    size = gap * np.sqrt(measured.n_samples)
    cases: dict[str, list[_Case]] = {}
    for signature in table.signatures:
        directions = seen_directions(measured, signature)
        if len(directions) and _survives(measured, signature):
            case = _Case(signature, size * directions, False)
            cases.setdefault(signature.effect, []).append(case)
    return cases


def _survives(measured: MeasuredGram, signature: Signature) -> bool:
    own = list(signature.columns)
    whole, seen = measured.square[own].sum(), measured.projected[own, own].sum()
    return bool(seen > Thresholds().surviving_share ** 2 * whole)


def _measured_cases(table: PlannedTable, measured: MeasuredGram) -> dict[str, list[_Case]] | None:
    """Fitted amplitudes of every effect that the records do not rule out.

    Those that leave no more than the best and what two effects may differ by and still be taken for
    one another; none where no effect explains half of the gap.
    """
    whole = float(measured.projected[0, 0])
    fits: dict[str, list[tuple[float, _Case]]] = {}
    for signature in table.signatures:
        own = list(signature.columns)
        if not _survives(measured, signature):
            continue
        length = np.sqrt(np.maximum(measured.square[own], np.finfo(float).tiny))
        gram = measured.projected[np.ix_(own, own)] / np.outer(length, length)
        right = measured.projected[own, 0] / length
        amplitudes = np.linalg.pinv(gram, rcond=_DEPENDENT, hermitian=True) @ right
        left = whole - float(amplitudes @ right)
        case = _Case(signature, (amplitudes / length)[None], True)
        fits.setdefault(signature.effect, []).append((left, case))
    best = min((left for own in fits.values() for left, _ in own), default=whole)
    if best > (1.0 - _EXPLAINS) * whole:
        return None
    most = best + measured.n_samples * Thresholds().exchange_ratio ** 2
    most = min(most, (1.0 - _EXPLAINS) * whole + _EXPLAINS * best)
    # Every shape that the records allow: one torque says nothing of the torque at which a
    # clearance closes.
    consistent = {
        effect: [case for left, case in own if left <= most] for effect, own in fits.items()
    }
    return {effect: own for effect, own in consistent.items() if own}


def _left(table: PlannedTable, measured: MeasuredGram, cases: Sequence[_Case], rival: str) -> float:
    """Energy that a rival leaves of a cause, the median over the cause's variants."""
    rivals = table.of(rival)
    energies = []
    for case in cases:
        if case.is_one:
            energies.append(left_energy(measured, case.signature, case.directions[0], rivals))
        else:
            energies.append(least_left_energy(measured, case.signature, case.directions, rivals))
    return float(np.median(energies))


def _pair(
    table: PlannedTable,
    grams: tuple[MeasuredGram, MeasuredGram],
    cases: Mapping[str, Sequence[_Case]],
    pair: tuple[str, str],
    gap: float,
) -> CausePair:
    measured, everything = grams
    cause, rival = pair
    left = np.sqrt(_left(table, measured, cases[cause], rival) / measured.n_samples)
    own = _gap(measured, cases[cause])
    sine = min(1.0, left / own) if own > 0.0 else 0.0
    wanted = Thresholds().exchange_ratio
    state = PARTED
    if left < wanted:
        most = np.sqrt(_left(table, everything, cases[cause], rival) / everything.n_samples)
        state = ALIKE if most > _NEVER * gap else NEVER
    return CausePair(
        cause,
        rival,
        float(np.rad2deg(np.arcsin(sine))),
        float(left),
        float(wanted / sine) if sine > 1e-3 else np.inf,
        state,
    )


def _gap(measured: MeasuredGram, cases: Sequence[_Case]) -> float:
    """RMS that a cause leaves as planned, in floors."""
    energies = []
    for case in cases:
        own = list(case.signature.columns)
        gram = measured.projected[np.ix_(own, own)]
        energies.append(float(case.directions[0] @ gram @ case.directions[0]))
    return float(np.sqrt(np.median(energies) / measured.n_samples))


def _ranked(
    table: PlannedTable,
    enlarged: MeasuredGram,
    cases: Mapping[str, Sequence[_Case]],
    alike: Sequence[CausePair],
    addition: Addition,
) -> RankedAddition:
    wanted = _MARGIN * Thresholds().exchange_ratio
    energies = {
        (pair.cause, pair.rival): _left(table, enlarged, cases[pair.cause], pair.rival)
        for pair in alike
    }
    left = {pair: float(np.sqrt(own / enlarged.n_samples)) for pair, own in energies.items()}
    parted = tuple(pair for pair, own in left.items() if own >= wanted)
    energy = min(energies.values())
    tiny = np.finfo(float).tiny
    mean_left = float(np.exp(np.mean(np.log(np.maximum(list(left.values()), tiny)))))
    return RankedAddition(
        addition,
        min(left.values()),
        mean_left,
        float(np.sqrt(energy)),
        0.5 * energy,
        0.5 * energy / addition.cost,
        parted,
        len(parted) == len(left),
    )
