"""Signals off the shaft's orders: what a run holds once its orders are taken out."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import Channel
from carrierflex.identification.campaign.order_analysis import highest_order
from carrierflex.identification.campaign.records import Run

FloatArray = NDArray[np.float64]

#: Turns for each quantity that the orders follow: more of them would take the lines beside too.
_TURNS_A_QUANTITY = 5.0
#: Highest order that is taken out, as steady waves, over the highest that follows the loads, and
#: the share of the samples of a turn below which it stays.
_HIGHEST_ORDER = 3
_BELOW_NYQUIST = 0.45
#: Degree of the slow drift of the offset that is taken out.
_DRIFT = 6
#: Samples for each column of the orders at least; a shorter run is not searched.
_SAMPLES_A_COLUMN = 3
#: Samples of a run at most: those of a longer one are averaged in groups.
_MOST_SAMPLES = 60_000
#: Numbers of all runs that are kept while lines are looked for (200 MB), and columns of the orders
#: of a usual run.
_MOST_NUMBERS = 25_000_000
_USUAL_BASIS = 100
#: Change of a load over its size that lets the orders follow it.
_CHANGES = 1e-4
#: Directions of the shared columns below this share of the largest are rounding.
_ALIKE = 1e-6


@dataclass(frozen=True, eq=False)
class RunOffOrders:
    """One run without its orders, at the samples that every channel has."""

    name: str  # Its name
    time: FloatArray  # Time [s], shape (n,)
    turns: FloatArray  # Turns of the carrier since the first sample of the run, growing, shape (n,)
    #: Gap of every channel without its orders, in the unit of the channel, shape (C, n)
    values: FloatArray
    orders: FloatArray  # Orthonormal basis of what was taken out, shape (n, k)

    @property
    def speed(self) -> float:
        """Mean speed [turns/s]."""
        return float((self.turns[-1] - self.turns[0]) / (self.time[-1] - self.time[0]))

    def without_orders(self, waves: FloatArray) -> FloatArray:
        """Waves, shape (n, k), without what the orders could make of them."""
        return np.asarray(waves - self.orders @ (self.orders.T @ waves), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class CampaignOffOrders:
    """Runs without their orders: those that are searched, the others made when required."""

    campaign: Campaign  # All runs
    #: Runs that lines are looked for in, long enough, in their order
    searched: tuple[RunOffOrders, ...]
    shared: "_SharedOrders | None"  # What the orders make of the loads in every run alike
    searches_all: bool  # Whether these are all runs

    def every(self) -> Iterator[RunOffOrders]:
        """All runs that are long enough, one after the other."""
        if self.searches_all:
            yield from self.searched
            return
        for made in _runs_off_orders(self.campaign, range(len(self.campaign.runs))):
            yield self.shared.without(*made) if self.shared else made[0]


@dataclass(frozen=True, eq=False)
class _SharedOrders:
    """Sizes of what the orders make of the loads, the same in every run; k columns."""

    n_loads: int  # loads that the orders follow
    counts: NDArray[np.bool_]  # columns that count
    energy: FloatArray  # (k,) their lengths over the searched runs
    sizes: FloatArray  # (k, C) sizes in every channel

    def without(self, run: RunOffOrders, loaded: Sequence[FloatArray]) -> RunOffOrders:
        """Run without them; `loaded` are its orders times each load, shape (n, k)."""
        columns = run.without_orders(np.hstack(loaded[: self.n_loads]))[:, self.counts]
        return replace(run, values=run.values - (columns / self.energy @ self.sizes).T)


def campaign_off_orders(campaign: Campaign) -> CampaignOffOrders:
    """Take the orders out of every run.

    Orders 0 to 12 of the measured angle, of three planets, each of them following torque, time,
    speed and radial load as far as the run is long enough, and a slow drift are fitted to the run
    and subtracted: what a shape of the carrier or the housing, or an error of a sensor, could make
    is gone whatever its size. How the orders follow torque and radial load in runs too short to
    tell it is fitted to all runs together. Of a campaign too large for the memory some runs are
    searched, drawn over all.
    """
    numbers = _searched(campaign)
    made = list(_runs_off_orders(campaign, numbers))
    shared = _shared_orders(made)
    searched = tuple(shared.without(*one) if shared else one[0] for one in made)
    return CampaignOffOrders(campaign, searched, shared, len(numbers) == len(campaign.runs))


def _searched(campaign: Campaign) -> Sequence[int]:
    """Numbers of the runs that are searched: all, or as many of them as may be kept."""
    n_runs = len(campaign.runs)
    samples = sum(min(run.time.size, _MOST_SAMPLES) for run in campaign.runs)
    share = _MOST_NUMBERS / (samples * (len(campaign.channels) + _USUAL_BASIS))
    if share >= 1.0:
        return range(n_runs)
    # Every tenth run may be of one condition.
    drawn = np.random.default_rng(0).permutation(n_runs)[: max(int(share * n_runs), 1)]
    return np.sort(drawn).tolist()


def _shared_orders(
    made: Sequence[tuple[RunOffOrders, Sequence[FloatArray]]],
) -> _SharedOrders | None:
    """What the orders make of the loads with the same sizes in every run; None where nothing."""
    # A torque that ripples makes lines beside every order that follows it. A run too short to tell
    # how its orders follow the loads leaves them beside the orders; all runs together tell it, as
    # the size per newton metre is one.
    runs = [run for run, _ in made]
    n_turns = sum(float(run.turns[-1] - run.turns[0]) for run in runs)
    n_loads = int(n_turns / _TURNS_A_QUANTITY) - 1
    if n_loads < 1:
        return None
    followed = [np.hstack(loads[:n_loads]) for _, loads in made]
    table = np.vstack([run.without_orders(x) for run, x in zip(runs, followed, strict=True)])
    energy = np.sqrt((table**2).sum(axis=0))
    # What every run follows by itself is rounding here.
    counts = energy > _CHANGES * np.sqrt((np.vstack(followed) ** 2).sum(axis=0))
    if not counts.any():
        return None
    values = np.hstack([run.values for run in runs]).T
    sizes = np.linalg.lstsq(table[:, counts] / energy[counts], values, rcond=_ALIKE)[0]
    return _SharedOrders(n_loads, counts, energy[counts], np.asarray(sizes, dtype=np.float64))


def _runs_off_orders(
    campaign: Campaign, numbers: Iterable[int]
) -> Iterator[tuple[RunOffOrders, list[FloatArray]]]:
    """Runs that are long enough, each with its orders times each load that all runs share."""
    # 12 of three planets follow the loads.
    followed_orders = highest_order(int(campaign.rig["n_planets"]))
    for number in numbers:
        made = _run_off_orders(
            campaign.runs[number].within_use(), campaign.channels, followed_orders
        )
        if made is not None:
            yield made


def _run_off_orders(
    run: Run, channels: tuple[Channel, ...], followed_orders: int
) -> tuple[RunOffOrders, list[FloatArray]] | None:
    """One run, and its orders times each load that all runs share; None where it is too short."""
    gap = np.array([_gap(run, channel.name) for channel in channels])
    present = np.isfinite(gap).all(axis=0)
    angle = run.inputs["carrier_angle"]
    turns = np.abs(angle - angle[0]) / (2.0 * np.pi)
    group = -(-int(present.sum()) // _MOST_SAMPLES) or 1
    time, turns, phase_angle, *quantities = (
        _averaged(row[present], group) for row in (run.time, turns, angle, *_followed(run, angle))
    )
    n_waves = 2 * followed_orders + 1
    n_samples = time.size
    n_turns = float(turns[-1] - turns[0]) if n_samples else 0.0
    fewest = min(n_turns / _TURNS_A_QUANTITY, n_samples / (_SAMPLES_A_COLUMN * n_waves))
    if fewest < 1.0:
        return None
    waves = _waves(2.0 * np.pi * turns, followed_orders)
    followed = [np.ones(n_samples), *(row for row in map(_centred, quantities) if row.any())]
    # A drift of the offset is slower than any line that is looked for.
    along = 2.0 * (time - time[0]) / (time[-1] - time[0]) - 1.0
    drift = np.polynomial.legendre.legvander(along, _DRIFT)[:, 1:]
    highest = min(_HIGHEST_ORDER * followed_orders, int(_BELOW_NYQUIST * n_samples / n_turns))
    above = 2.0 * np.pi * np.outer(turns, np.arange(followed_orders + 1, highest + 1))
    steady = [drift, np.cos(above), np.sin(above)]
    design = np.hstack([*steady, *(waves * row[:, None] for row in followed[: int(fewest)])])
    basis = np.linalg.qr(design)[0]
    values = np.array([_averaged(row[present], group) for row in gap])
    off_orders = RunOffOrders(run.name, time, turns, values - (values @ basis) @ basis.T, basis)
    shared = _waves(phase_angle, followed_orders)
    return off_orders, [shared * load[:, None] for load in _loads(run, present, group)]


def _waves(angle: FloatArray, highest: int) -> FloatArray:
    """Orders 0 to the highest of an angle [rad], shape (n, 2 highest + 1)."""
    phase = np.outer(angle, np.arange(1, highest + 1))
    return np.hstack([np.ones((angle.size, 1)), np.cos(phase), np.sin(phase)])


def _loads(run: Run, present: NDArray[np.bool_], group: int) -> list[FloatArray]:
    """Torque and radial load about their means in a run, in their units, torque first."""
    rows = [run.inputs[name] for name in ("torque", "ntl_y", "ntl_z") if name in run.inputs]
    averaged = [_averaged(row[present], group) for row in rows]
    return [_centred(row) * float(np.std(row)) for row in averaged]


def _averaged(values: FloatArray, group: int) -> FloatArray:
    """Means of groups of neighbours."""
    groups = values[: values.size // group * group]
    return np.asarray(groups.reshape(-1, group).mean(axis=1), dtype=np.float64)


def _gap(run: Run, channel: str) -> FloatArray:
    signal = run.signals[channel]
    if channel not in run.predictions:
        return signal
    return np.asarray(signal - run.predictions[channel], dtype=np.float64)


def _followed(run: Run, angle: FloatArray) -> list[FloatArray]:
    """What the orders may follow beside a constant, the most usual first."""
    speed = np.gradient(angle, run.time)
    loads = [run.inputs[name] for name in ("ntl_y", "ntl_z") if name in run.inputs]
    return [run.inputs["torque"], run.time, speed, *loads]


def _centred(values: FloatArray) -> FloatArray:
    """Values about their mean, of size one; zero where they do not change."""
    change = values - values.mean()
    size = float(np.sqrt(np.mean(change**2)))
    if not size > _CHANGES * float(np.abs(values).max()):
        return np.zeros_like(change)
    return np.asarray(change / size, dtype=np.float64)
