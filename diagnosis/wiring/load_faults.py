"""Faults of the loads and of the carrier's angle, as campaigns in which they are put right.

What a fault has no size of (a sign, an exchange) is put right once; a zero, or the eccentricity of
an encoder, is sought as the size with which the refitted baseline leaves least. The mean square is
nearly a parabola in the size: its vertex from finite differences, in a few rounds, is enough.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from carrierflex.diagnosis.wiring.linear_records import FloatArray
from carrierflex.diagnosis.wiring.refits import LOADS, RADIAL_LOADS, Fault, WiringRival
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign_check.campaign_warning import sample_of
from carrierflex.identification.estimation.gauss_newton import StopRule

ANGLE = "carrier_angle"
#: First steps of an angle [rad] and of a load over its largest value.
_ANGLE_STEP, _LOAD_STEP = float(np.deg2rad(3.0)), 0.03
#: What is left at a first size over the least, up to which the smaller size is taken.
_NEARLY = 1.5
#: Samples in which a size is sought, of a channel in a run and of all.
_SAMPLES_OF_ONE, _MOST_SAMPLES = 1000, 200_000
#: Those of a channel in a run in which the size is chosen that a search begins with.
_SAMPLES_OF_A_START = 250
#: Rounds in which a size is sought, and the step of one over that of the round before.
_ROUNDS, _NARROWER = 4, 0.4
#: Share of the changes of a held input that are one and the same number of samples apart.
_EVEN = 0.8
_Change = Callable[[Run], FloatArray]


def load_faults(campaign: Campaign, run: str = "") -> Iterator[WiringRival]:
    """Signs and axes of the loads put right, of one run or, where it is empty, of all."""

    def fault(id: str, text: str, sources: Mapping[str, tuple[str, float]]) -> WiringRival:
        """Fault whose inputs are others of the same run, with a factor."""
        corrected = with_scaled_inputs(campaign, sources, run)
        return corrected_rival(id, ", ".join(sources), text, corrected)

    loads = [name for name in LOADS if _varies(campaign, name)]
    for name in loads:
        yield fault(Fault.TORQUE_SIGN, f"{name} of the other sign", {name: (name, -1.0)})
    if set(RADIAL_LOADS) & set(loads):
        y, z = RADIAL_LOADS
        if set(RADIAL_LOADS) <= set(loads):
            text = "radial loads of the other sign"
            yield fault(Fault.TORQUE_SIGN, text, {y: (y, -1.0), z: (z, -1.0)})
        for sign_y, sign_z in ((1.0, 1.0), (1.0, -1.0), (-1.0, 1.0)):
            signs = "" if sign_y == sign_z else f", {y if sign_y < 0.0 else z} reversed"
            text = f"{y} and {z} exchanged{signs}"
            yield fault(Fault.LOAD_AXES, text, {y: (z, sign_y), z: (y, sign_z)})
    if _varies(campaign, ANGLE):
        yield fault(
            Fault.ANGLE_DIRECTION, "the angle counted the other way", {ANGLE: (ANGLE, -1.0)}
        )


def corrected_rival(id: str, about: str, text: str, corrected: Campaign) -> WiringRival:
    """Rival that is not refitted yet."""
    line = sample_of(corrected.runs[0].file, 0)
    return WiringRival(id, about, text, np.inf, line, corrected=corrected)


def held_inputs(campaign: Campaign) -> Iterator[WiringRival]:
    """Inputs that are held from one reading to the next, in straight lines between the readings."""
    for name in campaign.contract.inputs:
        if name != ANGLE and _is_held(campaign, name):
            corrected = with_inputs(campaign, "", {name: partial(_between_readings, name=name)})
            text = f"{name} in straight lines between its readings, not held from one to the next,"
            yield corrected_rival(Fault.HELD_INPUT, name, text, corrected)


def sized_faults(
    campaign: Campaign, refitted: Callable[[Campaign], float]
) -> Iterator[WiringRival]:
    """Baseline refitted with the zero of a load or of the angle put right, or an eccentric encoder.

    Sizes are sought in some samples of a long campaign, from one that fewer tell; what is left is
    of all.
    """
    n_channels, n_runs = len(campaign.channels), len(campaign.runs)
    n_samples = n_channels * sum(run.time.size for run in campaign.runs)
    n_records = n_channels * n_runs
    every = -(-n_samples // min(_MOST_SAMPLES, _SAMPLES_OF_ONE * n_records))
    searched = campaign.thinned(every) if every > 1 else campaign
    rough = searched.thinned(max(1, n_samples // (every * _SAMPLES_OF_A_START * n_records)))
    for fault in _unknown_sizes(campaign):

        def square(of: Campaign, size: FloatArray, fault: _SizedFault = fault) -> float:
            return refitted(with_inputs(of, "", {fault.about: fault.corrected(size)}))

        first = _first_size(partial(square, rough), fault)
        size, least = _least(partial(square, searched), first, fault.step)
        corrected = with_inputs(campaign, "", {fault.about: fault.corrected(size)})
        if searched is not campaign:
            least = refitted(corrected)
        rival = corrected_rival(fault.id, fault.about, fault.words(size), corrected)
        yield replace(rival, mean_square=least)


def _first_size(square: Callable[[FloatArray], float], fault: "_SizedFault") -> FloatArray:
    """Size that a search begins with: the smallest of those that leave nearly the least."""
    if len(fault.starts) == 1:
        return np.array(fault.starts[0])
    squares = [square(np.array(start)) for start in fault.starts]
    # A carrier of n equal planets is nearly the same a share of a turn on.
    pairs = zip(fault.starts, squares, strict=True)
    near = [start for start, one in pairs if one <= _NEARLY * min(squares)]
    return np.array(min(near, key=np.linalg.norm))


@dataclass(frozen=True, eq=False)
class _SizedFault:
    """A fault of one input, of unknown size."""

    id: str
    about: str
    corrected: Callable[[FloatArray], _Change]  # ``(size) -> (run) -> values``
    words: Callable[[FloatArray], str]  # ``(size) -> what is corrected``
    step: float
    starts: Sequence[tuple[float, ...]] = ((0.0,),)  # Sizes to begin with


def _unknown_sizes(campaign: Campaign) -> Iterator[_SizedFault]:
    if _varies(campaign, ANGLE):
        yield _SizedFault(
            Fault.ANGLE_ZERO,
            ANGLE,
            lambda size: lambda run: run.inputs[ANGLE] + size[0],
            lambda size: f"the zero of {ANGLE} moved by {np.rad2deg(size[0]):+.2f} degrees",
            _ANGLE_STEP,
            starts=[(float(angle),) for angle in np.deg2rad(np.arange(-170, 181, 10))],
        )
        yield _SizedFault(
            Fault.ENCODER,
            ANGLE,
            lambda size: (
                lambda run: (
                    run.inputs[ANGLE]
                    + size[0] * np.cos(run.inputs[ANGLE])
                    + size[1] * np.sin(run.inputs[ANGLE])
                )
            ),
            lambda size: (
                f"{ANGLE} corrected by {np.rad2deg(np.hypot(*size)):.2f} degrees once a "
                "turn, as of an eccentric encoder,"
            ),
            _ANGLE_STEP,
            starts=[(0.0, 0.0)],
        )
    for name in LOADS:
        if _varies(campaign, name):
            yield _zero_of_load(campaign, name)


def _zero_of_load(campaign: Campaign, name: str) -> _SizedFault:
    unit = campaign.input_units[name]
    largest = max(float(np.abs(run.inputs[name]).max()) for run in campaign.runs)
    return _SizedFault(
        Fault.LOAD_ZERO,
        name,
        lambda size: lambda run: run.inputs[name] + size[0],
        lambda size: f"the zero of {name} moved by {size[0]:+.4g} {unit}",
        _LOAD_STEP * largest,
    )


def _least(
    square: Callable[[FloatArray], float], size: FloatArray, step: float
) -> tuple[FloatArray, float]:
    """Size at which a mean square is least, and that: vertices of paraboloids, each nearer.

    It ends where a vertex gained what its paraboloid promised: a narrower one gains no more.
    """
    n = size.size
    least = square(size)
    for width in step * _NARROWER ** np.arange(_ROUNDS):
        steps = width * np.eye(n)
        ahead = np.array([square(size + one) for one in steps])
        behind = np.array([square(size - one) for one in steps])
        slope = (ahead - behind) / (2.0 * width)
        curvature = np.diag((ahead - 2.0 * least + behind) / width**2)
        for i in range(n):
            for j in range(i):
                both = square(size + steps[i] + steps[j])
                mixed = (both - ahead[i] - ahead[j] + least) / width**2
                curvature[i, j] = curvature[j, i] = mixed
        if not (np.isfinite(curvature).all() and np.linalg.eigvalsh(curvature).min() > 0.0):
            break
        step_to_vertex = -np.linalg.solve(curvature, slope)
        promised = least + 0.5 * float(slope @ step_to_vertex)
        reached = square(size + step_to_vertex)
        if not reached < least:
            break
        size, least = size + step_to_vertex, reached
        if abs(reached - promised) <= StopRule.kept_promise * reached:
            break
    return size, least


def with_scaled_inputs(
    campaign: Campaign, sources: Mapping[str, tuple[str, float]], run: str = ""
) -> Campaign:
    """Campaign with inputs that are others of the same run, with a factor; in one run, or in all.

    `sources` are the input that is read for another one, and the factor, by the name of that one.
    """

    def taken(source: str, factor: float) -> _Change:
        return lambda of_run: factor * of_run.inputs[source]

    changes = {name: taken(source, factor) for name, (source, factor) in sources.items()}
    return with_inputs(campaign, run, changes)


def with_inputs(campaign: Campaign, name: str, changes: Mapping[str, _Change]) -> Campaign:
    """Campaign with other inputs in one run, or in all."""

    def changed(run: Run) -> Run:
        inputs = {key: change(run) for key, change in changes.items()}
        return replace(run, inputs={**run.inputs, **inputs})

    runs = tuple(changed(run) if name in ("", run.name) else run for run in campaign.runs)
    return replace(campaign, runs=runs)


def _varies(campaign: Campaign, name: str) -> bool:
    """Whether an input is there and acts."""
    return any(name in run.inputs and run.inputs[name].any() for run in campaign.runs)


def _is_held(campaign: Campaign, name: str) -> bool:
    """Whether an input that moves repeats its last reading as often as a held one does."""
    steps = np.concatenate([np.diff(run.inputs[name]) for run in campaign.runs])
    moves = np.flatnonzero(steps)
    if moves.size < 2:
        return False
    # Rest before, between and after the drive is no holding.
    typical = np.median(np.diff(moves))
    return bool(typical >= 2.0 and np.mean(np.diff(moves) == typical) > _EVEN)


def _between_readings(run: Run, name: str) -> FloatArray:
    """Input in straight lines between the samples at which it changes."""
    values = run.inputs[name]
    new = np.flatnonzero(np.diff(values, prepend=np.nan) != 0.0)
    return np.interp(run.time, run.time[new], values[new])
