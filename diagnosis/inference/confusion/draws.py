"""The user's own campaign simulated at each candidate's fit, diagnosed and counted.

With ``r_c`` what candidate c leaves of the measured signals y, and ``e`` what the best candidate
leaves, a draw reads

    y* = y - r_c + g e,

the prediction of c at every sample, with the noise ``g e``: runs, loads, channels, sampling and
missing samples are those of the campaign, and so is all that no candidate describes (lines beside
the shaft's orders). Signs g of +1 or -1 are drawn by block of the run, for all channels alike: so
the noise keeps its size where it stands in the run, its memory within a block, and its correlation
between channels, and neither a spectrum nor a distribution is assumed. Declared noise would be
white, which measured noise is not, and would leave out what the best candidate misses. A block
holds :data:`_BLOCK` correlation times of e.

References
----------
.. [1] C. F. J. Wu, "Jackknife, bootstrap and other resampling methods in regression analysis",
   Ann. Stat. 14 (1986) 1261-1295: the wild bootstrap.
.. [2] X. Shao, "The dependent wild bootstrap", J. Am. Stat. Assoc. 105 (2010) 218-235.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor, as_completed
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.comparison.problem import Effects
from carrierflex.diagnosis.inference.confusion.results import Answer, Confusion, ConfusionRow
from carrierflex.diagnosis.inference.evidence.candidates import CandidateEvidence, Evidence
from carrierflex.identification.campaign.campaign import Campaign

FloatArray = NDArray[np.float64]

#: Simulated campaigns: where the cause is another, the search of some takes half as long again
#: as that of the measured campaign, and the whole is to stay below 20 times one diagnosis.
MOST_DIAGNOSES = 12
#: Candidates that are simulated: four draws each at least, of which Fisher's test can tell four
#: hits from none.
MOST_CANDIDATES = 3
#: Correlation times of the residual in a block: a tenth of the memory is lost at its ends.
_BLOCK = 10
#: A sum of autocorrelations ends at this many times itself (Sokal's window).
_WINDOW = 5.0
#: Blocks of a run at least: fewer signs draw the same noise again.
_FEWEST_BLOCKS = 8
_SEED = 13


def simulated_candidates(evidence: Evidence) -> tuple[CandidateEvidence, ...]:
    """Candidates that are simulated: baseline, named set, then the others of largest evidence.

    Parameters
    ----------
    evidence : Evidence
        Candidates.
    """
    first = [own for own in evidence.candidates if own.effects in ((), evidence.accepted)]
    others = [own for own in evidence.candidates if own not in first]
    others.sort(key=lambda own: -own.log_evidence)
    return tuple((*first, *others)[:MOST_CANDIDATES])


def confusion(
    campaign: Campaign,
    evidence: Evidence,
    answer: Answer,
    *,
    residuals: Callable[[Effects, FloatArray], Sequence[FloatArray]],
    answered: Callable[[Campaign], Answer],
    seed: int = 0,
    note: Callable[[str, float], None] = lambda text, share: None,
    executor: Executor | None = None,
) -> Confusion:
    """Simulate the campaign at each candidate's fit, diagnose it and count the answers.

    Parameters
    ----------
    campaign : Campaign
        Measured records, each once.
    evidence : Evidence
        Candidates.
    answer : Answer
        Answer to the measured campaign, its wiring taken as it is.
    residuals : callable
        ``(effects, theta) ->`` measured less predicted signals, shape (n, n_channels) a run, NaN
        where there is none.
    answered : callable
        Answer to a simulated campaign; can be called in another process.
    seed : int
        Seed of the noise.
    note : callable
        Told each draw with the share that is done, for progress.
    executor : Executor, optional
        Where campaigns are diagnosed; None in this process.

    Returns
    -------
    Confusion
        Answers by candidate.
    """
    candidates = simulated_candidates(evidence)
    n_draws = MOST_DIAGNOSES // len(candidates)
    best = evidence.of(evidence.best) or candidates[0]
    noise = residuals(best.effects, best.fit.theta)
    blocks = [block_length(own) for own in noise]
    left = [residuals(candidate.effects, candidate.fit.theta) for candidate in candidates]
    answers: dict[tuple[int, int], Answer] = {}
    draws = [(k, draw) for k in range(len(candidates)) for draw in range(n_draws)]

    def drawn(k: int, draw: int) -> Campaign:
        """Campaign of one draw."""
        rng = np.random.default_rng(_seeds(seed, k, draw))
        return with_signals(campaign, _drawn_signals(campaign, left[k], noise, blocks, rng))

    def keep(place: tuple[int, int], own: Answer) -> None:
        """Count an answer, and tell how far the draws are."""
        answers[place] = own
        note(f"simulated campaign {len(answers)} of {len(draws)}", len(answers) / len(draws))

    if executor is None:
        for place in draws:
            keep(place, answered(drawn(*place)))
    else:
        futures = {executor.submit(answered, drawn(*place)): place for place in draws}
        for future in as_completed(futures):
            keep(futures[future], future.result())
    rows = tuple(
        ConfusionRow(
            candidate.effects,
            tuple(answers[k, draw] for draw in range(n_draws)),
            tuple(_seeds(seed, k, draw) for draw in range(n_draws)),
        )
        for k, candidate in enumerate(candidates)
    )
    return Confusion(answer, evidence.accepted, rows, evidence.best)


def with_signals(campaign: Campaign, signals: Sequence[FloatArray]) -> Campaign:
    """Campaign whose channels read other signals, one array of shape (n, n_channels) a run."""
    names = [channel.name for channel in campaign.channels]
    runs = tuple(
        replace(run, signals=dict(zip(names, own.T, strict=True)))
        for run, own in zip(campaign.runs, signals, strict=True)
    )
    return replace(campaign, runs=runs)


def _seeds(seed: int, candidate: int, draw: int) -> tuple[int, ...]:
    return (_SEED, seed, candidate, draw)


def _drawn_signals(
    campaign: Campaign,
    left: Sequence[FloatArray],
    noise: Sequence[FloatArray],
    blocks: Sequence[int],
    rng: np.random.Generator,
) -> list[FloatArray]:
    """Signals of every run with one draw of the noise."""
    names = [channel.name for channel in campaign.channels]
    signals = []
    for run, of_candidate, of_best, block in zip(campaign.runs, left, noise, blocks, strict=True):
        measured = np.column_stack([run.signals[name] for name in names])
        n_blocks = -(-run.time.size // block)
        # Where the blocks begin is drawn too.
        first = int(rng.integers(block))
        sign = np.repeat(rng.choice([-1.0, 1.0], n_blocks + 1), block)[first:][: run.time.size]
        signals.append(measured - of_candidate + sign[:, None] * of_best)
    return signals


def block_length(residual: FloatArray) -> int:
    """Samples of a block: ten correlation times, ``tau = 1 + 2 sum_k rho_k``, of the residual.

    Parameters
    ----------
    residual : ndarray, shape (n, n_channels)
        NaN where nothing was measured.

    Returns
    -------
    int
        At least one, an eighth of the run at most.

    References
    ----------
    .. [1] A. Sokal, "Monte Carlo methods in statistical mechanics: foundations and new algorithms"
       (1997), section 3: the window of the sum.
    """
    n = len(residual)
    values = np.where(np.isfinite(residual), residual, 0.0)
    spectrum = np.abs(np.fft.rfft(values, 2 * n, axis=0)) ** 2
    correlation = np.fft.irfft(spectrum.sum(axis=1))[:n]
    longest = max(1, n // _FEWEST_BLOCKS)
    if not correlation[0] > 0.0:
        return longest
    times = 2.0 * np.cumsum(correlation / correlation[0]) - 1.0
    is_inside = np.arange(n) >= _WINDOW * times
    tau = float(times[int(np.argmax(is_inside))]) if is_inside.any() else float(n)
    return int(np.clip(np.ceil(_BLOCK * max(tau, 1.0)), 1, longest))
