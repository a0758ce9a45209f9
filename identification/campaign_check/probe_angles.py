"""Where the probes of a carrier stand, read from the phase of order 1.

A carrier that is tilted in its own frame moves the rim by ``A cos(theta - alpha)`` in front of a
probe at the angle alpha: the amplitude ``Y`` of ``Re(Y exp(j theta))`` has the phase ``-alpha``,
up to a phase that all probes share. Relative to the first probe

    ``alpha_k = alpha_0 - arg(sum_r Y_k conj(Y_0))``
    ``gain_k = |sum_r Y_k conj(Y_0)| / sum_r |Y_0|²``

over the runs r. It needs no baseline and no simulation: cables that are exchanged, an angle that is
counted the other way and a reversed polarity are read directly.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import permutations
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import Channel
from carrierflex.identification.campaign.order_analysis import highest_order
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign.revolutions import whole_revolutions
from carrierflex.identification.campaign_check.campaign_warning import CampaignWarning, key_of
from carrierflex.identification.estimation.resampling import NORMAL_95

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

#: Amplitude of order 1 over its standard deviation from which an angle is read.
_LEAST_SIGNIFICANCE = 5.0
#: Distance from the declared angle [rad] from which it is at odds: bearings with clearance turn
#: the phases of probes by up to some ten degrees against one another.
_AT_ODDS = float(np.deg2rad(30.0))
#: Distance [rad] within which another order, direction or polarity explains what is read.
_EXPLAINED = float(np.deg2rad(15.0))
#: Samples of a run that are fitted: more make the phase no surer than probes can be placed.
_MOST_SAMPLES = 40_000
#: Probes whose orders are all tried.
_MOST_PROBES = 6


@dataclass(frozen=True)
class ProbeAngle:
    """Where one probe stands, as declared and as read."""

    channel: Annotated[str, "Name of the channel"]
    declared_deg: Annotated[float, "Angle that campaign.toml declares"]
    read_deg: Annotated[
        float | None,
        "Angle read from the phase of order 1 relative to the first probe; None where order 1 is "
        "too small",
    ]
    interval_deg: Annotated[float | None, "Half the width of its 95 % interval"]
    sign: Annotated[int | None, "-1 where it is read half a turn from where it is declared"]
    gain: Annotated[float | None, "Size of order 1 over that of the first probe"]


def probe_angles(campaign: Campaign) -> tuple[ProbeAngle, ...]:
    """Angles of the axial probes of a campaign of kind carrier.

    Parameters
    ----------
    campaign : Campaign
        Runs of whole revolutions.

    Returns
    -------
    tuple of ProbeAngle
        One a probe, in the order of the campaign; empty with fewer than two probes of one
        quantity.
    """
    channels = _axial(campaign)
    runs = [run for run in campaign.runs if abs(np.ptp(run.inputs["carrier_angle"])) > 2.0 * np.pi]
    if len(channels) < 2 or not runs:
        return ()
    amplitudes, variances = _order_1(runs, channels, highest_order(int(campaign.rig["n_planets"])))
    sizes = np.sqrt(np.sum(np.abs(amplitudes) ** 2, axis=0))
    std = np.sqrt(np.sum(variances, axis=0) / len(amplitudes))
    cross = amplitudes.T @ np.conj(amplitudes[:, 0])
    first = channels[0].angle or 0.0
    rows = []
    for k, channel in enumerate(channels):
        declared = channel.angle or 0.0
        is_significant = (
            min(sizes[0] / std[0], sizes[k] / std[k]) > _LEAST_SIGNIFICANCE and abs(cross[k]) > 0.0
        )
        if not is_significant:
            rows.append(ProbeAngle(channel.name, _degrees(declared), None, None, None, None))
            continue
        read = first - float(np.angle(cross[k]))
        sign = -1 if np.cos(read - declared + np.pi) > np.cos(_EXPLAINED) else 1
        relative = np.hypot(std[0] / sizes[0], std[k] / sizes[k]) if k else 0.0
        rows.append(
            ProbeAngle(
                channel.name,
                _degrees(declared),
                _degrees(read),
                float(np.rad2deg(NORMAL_95 * relative)),
                sign,
                float(abs(cross[k]) / sizes[0] ** 2),
            )
        )
    return tuple(rows)


def probe_findings(probes: Sequence[ProbeAngle]) -> Iterator[CampaignWarning]:
    """Probes whose order 1 is at odds with the declared angles, with what explains it.

    Parameters
    ----------
    probes : sequence of ProbeAngle
        Probes of a campaign of kind carrier.

    Yields
    ------
    CampaignWarning
        Check ``probe_angle``: exchanged cables, an angle counted the other way, or one probe.
    """
    rows = [row for row in probes if row.read_deg is not None]
    if len(rows) < 2:
        return
    declared = np.deg2rad([row.declared_deg for row in rows])
    read = np.deg2rad([row.read_deg or 0.0 for row in rows])
    names = [row.channel for row in rows]
    away = np.abs(_wrapped(read - declared))
    if away.max() <= _AT_ODDS:
        return
    at_odds = np.flatnonzero(away > _AT_ODDS)
    explained = False
    # All angles are relative to the first probe.
    if np.abs(_wrapped(read - (2.0 * declared[0] - declared))).max() <= _EXPLAINED:
        explained = True
        yield _finding(
            "wiring/angle_direction",
            "carrier_angle",
            f"the phases of order 1 read the probes at {_listed(read)} degrees, which are the "
            f"declared angles ({_listed(declared)}) counted the other way",
            "change the sign of carrier_angle, or count the angles of the probes the other way",
        )
    order = _order(declared, read)
    if order is not None:
        explained = True
        pairs = [f"{names[k]} at {np.rad2deg(declared[j]):.0f}" for k, j in enumerate(order)]
        yield _finding(
            "wiring/sensor_order",
            ", ".join(names[k] for k, j in enumerate(order) if j != k),
            f"the phases of order 1 read {', '.join(pairs)} degrees: cables look exchanged",
            "exchange the columns or the declared angles of these channels",
        )
    if at_odds.size == 1:
        explained = True
        name, sign = names[at_odds[0]], rows[at_odds[0]].sign
        text = (
            f"order 1 of {name} is that of its declared angle with the other sign"
            if sign == -1
            else f"order 1 reads {name} at {_listed(read[at_odds])} degrees, declared "
            f"{_listed(declared[at_odds])}"
        )
        yield _finding(
            "wiring/polarity" if sign == -1 else "wiring/sensor_angle",
            name,
            text,
            "reverse the sign of this channel, or measure the angle of its probe"
            if sign == -1
            else "measure the angle of this probe relative to the first one",
        )
    if not explained:
        yield _finding(
            "wiring/sensor_angle",
            ", ".join(names[k] for k in at_odds),
            f"the phases of order 1 read the probes at {_listed(read)} degrees, declared are "
            f"{_listed(declared)}",
            "measure the angles of the probes, and check which cable leads to which input",
        )


def _axial(campaign: Campaign) -> list[Channel]:
    """Probes of the quantity of the first channel that has an angle."""
    probes = [channel for channel in campaign.channels if channel.angle is not None]
    return [channel for channel in probes if channel.quantity == probes[0].quantity]


def _order_1(
    runs: Sequence[Run], channels: Sequence[Channel], highest: int
) -> tuple[ComplexArray, FloatArray]:
    """Amplitudes of order 1 and their variances, shape (n_runs, n_channels) each."""
    amplitudes = np.zeros((len(runs), len(channels)), dtype=np.complex128)
    # Nothing is known of a channel with too few samples.
    variances = np.full((len(runs), len(channels)), np.inf)
    for r, complete in enumerate(runs):
        run = complete.thinned(-(-complete.time.size // _MOST_SAMPLES))
        rows = np.sort(np.concatenate(whole_revolutions(run).samples))
        signals = np.array([run.signals[channel.name][rows] for channel in channels])
        known = np.isfinite(signals)
        # Channels with the same samples are one least-squares problem.
        for mask in np.unique(known, axis=0):
            if np.count_nonzero(mask) <= 2 * (highest + 1):
                continue
            alike = np.flatnonzero((known == mask).all(axis=1))
            fits = _fitted(run, rows[mask], signals[np.ix_(alike, mask)], highest)
            amplitudes[r, alike], variances[r, alike] = fits
    return amplitudes, variances


def _fitted(
    run: Run, rows: NDArray[np.int64], signals: FloatArray, highest: int
) -> tuple[ComplexArray, FloatArray]:
    """Amplitude of order 1 of signals beside the other orders and a drift, and its variance."""
    angle, time = run.inputs["carrier_angle"][rows], run.time[rows]
    phase = np.outer(np.arange(1, highest + 1), angle)
    drift = (time - time.mean()) / max(np.ptp(time), 1e-300)
    design = np.array([np.ones_like(angle), drift, *np.cos(phase), *np.sin(phase)])
    solution = np.linalg.lstsq(design.T, signals.T, rcond=None)[0]
    residual = signals - solution.T @ design
    freedom = max(angle.size - len(design), 1)
    variance = 4.0 * np.sum(residual**2, axis=1) / freedom / angle.size
    return solution[2] - 1j * solution[2 + highest], variance


def _order(declared: FloatArray, read: FloatArray) -> tuple[int, ...] | None:
    """Declared angle that each probe reads; None where no order explains it."""
    # The first probe may stand at any of the angles: all readings then turn with it.
    if declared.size > _MOST_PROBES:
        return None
    for order in permutations(range(declared.size)):
        turned = read + declared[order[0]] - declared[0]
        if np.abs(_wrapped(turned - declared[list(order)])).max() <= _EXPLAINED:
            return order
    return None


def _finding(id: str, about: str, text: str, remedy: str) -> CampaignWarning:
    line = key_of("[[channels]]", "angle_deg")
    return CampaignWarning("probe_angle", about, text, remedy, 1.0, line, id)


def _wrapped(angle: FloatArray) -> FloatArray:
    return np.asarray((angle + np.pi) % (2.0 * np.pi) - np.pi)


def _degrees(angle: float) -> float:
    return float(np.rad2deg(angle) % 360.0)


def _listed(angles: FloatArray) -> str:
    return ", ".join(f"{np.rad2deg(angle) % 360.0:.1f}" for angle in angles)
