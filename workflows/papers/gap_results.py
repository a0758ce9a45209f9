"""What the posteriors of the paper's gap say.

Evidence and order of the hypotheses, what each predicts, which measurement would distinguish them,
what remains as causes are added, and the condensed statics beside the stage itself.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.identification.carrier.printed_tables import FULL_TORQUE
from carrierflex.simulation.stage.condensed_stage import (
    CondensedStage,
    outputs,
    stage_data,
    stage_effects,
)
from carrierflex.simulation.stage.quasi_static import quasi_static_turn
from carrierflex.simulation.stage.stage_body import StageBody
from carrierflex.simulation.stage.stage_data import RollerBearingData
from carrierflex.simulation.stage.stage_model import stage_model
from carrierflex.simulation.stage.statics import NotConvergedError, SteadyLoad
from carrierflex.workflows.papers.gap_posterior import (
    ALL_SENSORS,
    AMPLITUDE_ERRORS,
    CHOICES,
    EXTREME_MOMENT,
    LOADS,
    NAMES,
    PUBLISHED,
    WIDTHS,
    Comparison,
    Hypothesis,
    Run,
    Samples,
    pin_loads,
)
from carrierflex.workflows.papers.gap_rows import (
    CausesRow,
    EvidenceRow,
    LeftOutRow,
    OrderRow,
    PredictionRow,
)
from carrierflex.workflows.simulation.study_order_one import SENSORS

#: Hypotheses whose evidences differ by less are not distinguished: two runs of the sampler with
#: other random numbers differ by as much where 14 parameters have several valleys.
DECISIVE = 7.0
#: Samples of a posterior that are taken through the stage.
_N_PREDICTED = 40


@dataclass(frozen=True)
class Measurement:
    """A measurement that could distinguish hypotheses, and its standard error."""

    name: str
    unit: str
    factor: float
    error: float


#: In the order of :func:`measured`. Errors are chosen; that of the radial sensors is the run-out of
#: what they look at.
MEASUREMENTS = (
    Measurement("order 1 in LC3", "um", 1e6, 6e-6),
    Measurement("order 1 that turns against the carrier, LC1", "um", 1e6, 6e-6),
    Measurement("order 1 of an axial sensor on the housing, LC1", "um", 1e6, 6e-6),
    Measurement("order 1 of an axial sensor on the ground, LC1", "um", 1e6, 6e-6),
    Measurement("order 1 of the radial sensors, LC1", "um", 1e6, 20e-6),
    Measurement("shaft bending, constant in the shaft", "kN m", 1e-3, 1e3),
    Measurement("shaft bending, twice a revolution", "kN m", 1e-3, 1e3),
    Measurement("load sharing factor, no moment", "", 1.0, 0.02),
    Measurement("load sharing factor, -300 kN m", "", 1.0, 0.02),
    Measurement("load sharing factor, +300 kN m", "", 1.0, 0.02),
    Measurement("upwind row over T / (6 a)", "", 1.0, 0.05),
    Measurement("downwind row", "", 1.0, 0.05),
)


def measured(
    compare: Comparison, hypothesis: Hypothesis, values: Mapping[str, float]
) -> NDArray[np.float64]:
    """What the measurements of `MEASUREMENTS` would give without error, SI units."""
    supports = hypothesis.supports(values)
    stage = compare.stages[supports.n_slices]
    out = stage.turn(supports, (*LOADS, *extreme_loads(stage)))
    signals = compare.signals(out[: len(LOADS)], hypothesis, values)
    n = len(stage.angles)
    order_1 = 2.0 * np.fft.rfft(signals, axis=1)[:, 1] / n
    angles = np.array([sensor.angle for sensor in SENSORS])
    against = np.abs((order_1[0] * np.exp(-1j * angles)).mean())
    n_sensors = len(ALL_SENSORS)
    both = (
        compare.signals(out[: len(LOADS)], replace(hypothesis, ground=ground), values)[0]
        for ground in (False, True)
    )
    first = n_sensors if hypothesis.ground else 0
    radial = out[0, :, first + len(SENSORS) : first + n_sensors]
    on_housing, on_ground, of_radial = (
        2.0 * np.abs(np.fft.rfft(signal, axis=0)[1]).mean() / n for signal in (*both, radial)
    )
    # The main bearing alone: weights and radial load turn in the shaft and have order 1.
    bending = np.fft.fft(out[0, :, -2] + 1j * out[0, :, -1]) / n
    return np.array(
        [
            np.abs(order_1[2]).mean(),
            against,
            on_housing,
            on_ground,
            of_radial,
            np.abs(bending[0]),
            np.abs(bending[[2, -2]]).max(),
            *sharing(stage, out[[0, -2, -1]]),
        ]
    )


def extreme_loads(stage: CondensedStage) -> tuple[SteadyLoad, SteadyLoad]:
    """Full torque with the extreme moment downwards, and upwards."""
    extreme = EXTREME_MOMENT / stage.data.mounting.ntl_arm
    return SteadyLoad(FULL_TORQUE, ntl_z=-extreme), SteadyLoad(FULL_TORQUE, ntl_z=extreme)


def sharing(stage: CondensedStage, out: NDArray[np.float64]) -> NDArray[np.float64]:
    """Load sharing factor without moment and under `extreme_loads`; rows without moment.

    Parameters
    ----------
    stage : CondensedStage
        The stage.
    out : ndarray, shape (3, n_angles, n_outputs)
        Its outputs over a turn, under full torque and under `extreme_loads`.

    Returns
    -------
    ndarray, shape (5,)
        Factors, then the largest load of an upwind and of a downwind row of a planet's bearings
        over a turn, over ``T / (6 a)``.
    """
    pins = [pin_loads(turn) for turn in out]
    rows = pins[0].row_load(RollerBearingData().row_spacing).max(axis=(0, 1))
    expected = FULL_TORQUE / (6.0 * stage.data.gear.centre_distance)
    return np.array([*(3.0 * turn.load_share.max() for turn in pins), *(rows / expected)])


def predictions(
    compare: Comparison, hypothesis: Hypothesis, points: Iterable[Mapping[str, float]]
) -> NDArray[np.float64]:
    """What the measurements would give at points of a posterior, shape (n, n_measurements).

    Points where contact does not settle under one of the loads are left out.
    """
    values = np.array([measured(compare, hypothesis, point) for point in points])
    return values[np.isfinite(values).all(axis=1)]


def drawn(samples: Samples, rng: np.random.Generator) -> list[dict[str, float]]:
    """Values of some posterior samples with the middle error of the amplitudes."""
    weights = samples.weights()
    chosen = rng.choice(len(weights), _N_PREDICTED, p=weights)
    names = list(samples.hypothesis.priors)
    return [dict(zip(names, map(float, samples.points[i]), strict=True)) for i in chosen]


def information(predicted: Sequence[NDArray[np.float64]], error: float) -> float:
    """Expected information of a measurement on which hypothesis holds [bit].

    Mutual information of the hypothesis, all alike, and the measured value: the predictions of each
    hypothesis with the normal error of the measurement.

    Parameters
    ----------
    predicted : sequence of ndarray, shape (n,)
        Predictions by hypothesis.
    error : float
        Standard error of the measurement.
    """
    ends = np.concatenate(list(predicted))
    grid = np.linspace(ends.min() - 5.0 * error, ends.max() + 5.0 * error, 4001)
    density = np.array(
        [
            np.exp(-0.5 * ((grid[:, None] - values) / error) ** 2).mean(axis=1)
            / (error * np.sqrt(2.0 * np.pi))
            for values in predicted
        ]
    )
    mean = density.mean(axis=0)
    ratio = np.log2(np.maximum(density, 1e-300) / np.maximum(mean, 1e-300))
    return float(np.trapezoid((density * ratio).mean(axis=0), grid))


def evidence(runs: Mapping[Run, Samples]) -> tuple[EvidenceRow, ...]:
    """Evidence of every hypothesis less that of the best, by width and errors."""
    rows = []
    for width in WIDTHS:
        at_width = {run: samples for run, samples in runs.items() if run.width == width}
        for error, window in CHOICES:
            values = {run: of.log_evidence(error, window) for run, of in at_width.items()}
            best = max(values.values())
            rows += [
                EvidenceRow(
                    run.hypothesis.name,
                    len(run.hypothesis.priors),
                    width,
                    error,
                    window,
                    value - best,
                )
                for run, value in values.items()
            ]
    return tuple(rows)


def order(runs: Mapping[Run, Samples], first: str, second: str) -> OrderRow:
    """Which of two hypotheses is better whatever the error and width."""
    by = {(run.hypothesis.name, run.width): samples for run, samples in runs.items()}
    gaps = [
        by[first, width].log_evidence(error) - by[second, width].log_evidence(error)
        for width in WIDTHS
        for error in AMPLITUDE_ERRORS
    ]
    better = first if min(gaps) > DECISIVE else second if max(gaps) < -DECISIVE else None
    return OrderRow(first, second, min(gaps), max(gaps), better)


def prediction_rows(predicted: Mapping[str, NDArray[np.float64]]) -> tuple[PredictionRow, ...]:
    """Predictions by measurement, the most informative first."""
    rows = []
    for i, measurement in enumerate(MEASUREMENTS):
        quantiles = {
            name: np.quantile(of[:, i], [0.05, 0.5, 0.95]) * measurement.factor
            for name, of in predicted.items()
        }
        rows.append(
            PredictionRow(
                measurement.name,
                measurement.unit,
                measurement.error * measurement.factor,
                {name: (float(a), float(b), float(c)) for name, (a, b, c) in quantiles.items()},
                information([of[:, i] for of in predicted.values()], measurement.error),
            )
        )
    return tuple(sorted(rows, key=lambda row: -row.bits))


def causes_rows(
    compare: Comparison, best: Hypothesis, values: Mapping[str, float]
) -> tuple[CausesRow, ...]:
    """What remains of the published numbers as the causes of the best hypothesis are added."""
    steps: tuple[tuple[str, tuple[str, ...]], ...] = (
        ("published clearances, sun floating", ()),
        ("and sun restrained by friction", ("sun_radial", "sun_friction")),
        ("and a pin out of position", ("pin_offset",)),
        ("and tilted face", ("phi_face", "theta_face")),
        ("and static saddle", ("at_rest", "by_torque", "by_load")),
    )
    rows = []
    chosen: dict[str, float] = {}
    for name, added in steps:
        chosen |= {key: values[key] for key in added}
        numbers = compare.numbers(best, chosen)
        gap = numbers[:7] - PUBLISHED[:7]
        table_5, table_4 = (float(np.sqrt((of**2).mean())) for of in (gap[:3], gap[3:]))
        rows.append(CausesRow(name, numbers, table_5, table_4))
    return tuple(rows)


def left_out_rows(compared: Iterable[Samples]) -> tuple[LeftOutRow, ...]:
    """Every published number predicted from the others, by hypothesis."""
    rows = []
    for samples in compared:
        for datum, name in enumerate(NAMES):
            weights = samples.weights(without=(datum,))
            values = samples.numbers[:, datum]
            mean = float(weights @ values)
            spread = float(np.sqrt(weights @ (values - mean) ** 2))
            # Few effective samples: the others' posterior is where none was drawn.
            few = bool((weights**2).sum() > 1.0 / 50.0)
            rows.append(
                LeftOutRow(
                    name, float(PUBLISHED[datum]), samples.hypothesis.name, mean, spread, few
                )
            )
    return tuple(rows)


def largest_deviation(
    compare: Comparison,
    body: StageBody,
    hypothesis: Hypothesis,
    points: Iterable[Mapping[str, float]],
) -> float:
    """Largest relative gap of condensed numbers to those of the stage's statics.

    Points where either does not settle are left out.
    """
    gaps = []
    for values in points:
        supports = hypothesis.supports(values)
        model = stage_model(body, stage_data(supports), effects=stage_effects(supports), speed=0.0)
        try:
            turns = [quasi_static_turn(model, load, compare.n_angles) for load in LOADS]
        except NotConvergedError:
            continue
        out = np.array([outputs(model, turn, ALL_SENSORS) for turn in turns])
        exact = compare.numbers_of(out, hypothesis, values)
        gaps.append(np.abs(compare.numbers(hypothesis, values) / exact - 1.0).max())
    return float(np.nanmax(gaps))
