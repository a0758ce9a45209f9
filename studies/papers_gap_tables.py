"""Tables and picture of :mod:`studies.explain_papers_gap`.

Evidence, what each hypothesis predicts, which measurement would distinguish them, what remains as
causes are added, and the condensed statics beside the stage itself.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from carrierflex.identification.carrier.printed_tables import FULL_TORQUE, LOAD_CASES
from carrierflex.simulation.stage.quasi_static import quasi_static_turn
from carrierflex.simulation.stage.stage_body import StageBody
from carrierflex.simulation.stage.stage_data import RollerBearingData
from carrierflex.simulation.stage.stage_model import stage_model
from carrierflex.simulation.stage.statics import NotConvergedError, SteadyLoad
from carrierflex.workflows.simulation.study_order_one import SENSORS
from studies.condensed_stage import outputs, stage_data, stage_effects
from studies.papers_gap_posterior import (
    ALL_SENSORS,
    AMPLITUDE_ERRORS,
    LOADS,
    NAMES,
    PUBLISHED,
    SAMPLED_ERROR,
    WIDTHS,
    WINDOW_SPREAD,
    Comparison,
    Hypothesis,
    Run,
    Samples,
    pin_loads,
    standard_errors,
)
from studies.tabulate_load_sharing import EXTREME_MOMENT

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Hypotheses whose evidences differ by less are not distinguished: two runs of the sampler with
#: other random numbers differ by as much where 14 parameters have several valleys.
DECISIVE = 7.0
#: Samples of a posterior that are taken through the stage.
_N_PREDICTED = 40
_IN_UNITS = np.array([1e6] * 7 + [1.0])


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
    extreme = EXTREME_MOMENT / stage.data.mounting.ntl_arm
    loads = (
        *LOADS,
        SteadyLoad(FULL_TORQUE, ntl_z=-extreme),
        SteadyLoad(FULL_TORQUE, ntl_z=extreme),
    )
    out = stage.turn(supports, loads)
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
    pins = [pin_loads(out[i]) for i in (0, 4, 5)]
    rows = pins[0].row_load(RollerBearingData().row_spacing).max(axis=(0, 1))
    expected = FULL_TORQUE / (6.0 * stage.data.gear.centre_distance)
    return np.array(
        [
            np.abs(order_1[2]).mean(),
            against,
            on_housing,
            on_ground,
            of_radial,
            np.abs(bending[0]),
            np.abs(bending[[2, -2]]).max(),
            *(3.0 * loads_of.load_share.max() for loads_of in pins),
            *(rows / expected),
        ]
    )


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
    log_w = samples.log_weights(SAMPLED_ERROR)
    weights = np.exp(log_w - log_w.max())
    chosen = rng.choice(len(weights), _N_PREDICTED, p=weights / weights.sum())
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


def evidence_table(runs: Mapping[Run, Samples]) -> list[str]:
    """Logarithm of the evidence over that of the best, by error and width."""
    columns = [(error, width) for width in WIDTHS for error in AMPLITUDE_ERRORS]
    best = {
        (error, width): max(
            samples.log_evidence(error) for run, samples in runs.items() if run.width == width
        )
        for error, width in columns
    }
    lines = [
        "| hypothesis | free | "
        + " | ".join(f"{1e6 * error:g} um, width {width:g}" for error, width in columns)
        + " | other windows |",
        "|---" * (len(columns) + 3) + "|",
    ]
    by_name: dict[str, dict[float, Samples]] = {}
    for run, samples in runs.items():
        by_name.setdefault(run.hypothesis.name, {})[run.width] = samples
    best_window = max(
        samples.log_evidence(SAMPLED_ERROR, WINDOW_SPREAD)
        for run, samples in runs.items()
        if run.width == 1.0
    )
    for name, at in by_name.items():
        cells = [
            f"{at[width].log_evidence(error) - best[error, width]:.1f}" for error, width in columns
        ]
        window = at[1.0].log_evidence(SAMPLED_ERROR, WINDOW_SPREAD) - best_window
        n = len(at[1.0].hypothesis.priors)
        lines.append(f"| {name} | {n} | {' | '.join(cells)} | {window:.1f} |")
    return lines


def verdict(runs: Mapping[Run, Samples], first: str, second: str) -> str:
    """Which of two hypotheses is better whatever the error and width, or "not decided"."""
    by = {(run.hypothesis.name, run.width): samples for run, samples in runs.items()}
    gaps = [
        by[first, width].log_evidence(error) - by[second, width].log_evidence(error)
        for width in WIDTHS
        for error in AMPLITUDE_ERRORS
    ]
    span = f"{min(gaps):+.1f} to {max(gaps):+.1f}"
    if min(gaps) > DECISIVE:
        return f"{first} over {second}: {span}"
    if max(gaps) < -DECISIVE:
        return f"{second} over {first}: {-max(gaps):+.1f} to {-min(gaps):+.1f}"
    return f"{first} or {second}: not decided ({span})"


def numbers_table(best: Mapping[Hypothesis, NDArray[np.float64]]) -> list[str]:
    """Published numbers and those of the most probable values of each hypothesis."""
    errors = standard_errors(SAMPLED_ERROR)
    lines = [
        "| hypothesis | free | order 1, LC1, LC2, LC4 (LC3) [um] | M2 leaves, LC1 to LC4 [um] | "
        "load sharing | largest gap of the seven, standard errors |",
        "|---|---|---|---|---|---|",
        f"| published | | {_numbers(PUBLISHED)} | |",
    ]
    for hypothesis, numbers in best.items():
        gap = np.abs((numbers[: len(NAMES)] - PUBLISHED) / errors)[:7].max()
        lines.append(
            f"| {hypothesis.name} | {len(hypothesis.priors)} | {_numbers(numbers)} | {gap:.1f} |"
        )
    return lines


def _numbers(numbers: NDArray[np.float64]) -> str:
    shown = numbers[:8] * _IN_UNITS
    order = ", ".join(f"{value:.0f}" for value in shown[:3])
    if len(numbers) > len(NAMES):
        order += f" ({1e6 * numbers[8]:.0f})"
    return f"{order} | {', '.join(f'{value:.0f}' for value in shown[3:7])} | {shown[7]:.3f}"


def left_out_table(survivors: Iterable[Samples]) -> list[str]:
    """Every datum predicted from the others, mean and standard deviation by hypothesis."""
    survivors = list(survivors)
    names = [samples.hypothesis.name for samples in survivors]
    lines = [
        f"| left out | published | {' | '.join(names)} |",
        "|---" * (len(names) + 2) + "|",
    ]
    for datum, (name, factor) in enumerate(zip(NAMES, _IN_UNITS, strict=True)):
        digits = 0 if factor > 1.0 else 3
        cells = []
        for samples in survivors:
            log_w = samples.log_weights(SAMPLED_ERROR, without=(datum,))
            weights = np.exp(log_w - log_w.max())
            weights /= weights.sum()
            values = samples.numbers[:, datum] * factor
            mean = weights @ values
            spread = np.sqrt(weights @ (values - mean) ** 2)
            # Few effective samples: the others' posterior lies where the run has hardly looked.
            few = " (few samples)" if (weights**2).sum() > 1.0 / 50.0 else ""
            cells.append(f"{mean:.{digits}f} +- {spread:.{digits}f}{few}")
        unit = " um" if factor > 1.0 else ""
        lines.append(
            f"| {name} | {PUBLISHED[datum] * factor:.{digits or 2}f}{unit} | {' | '.join(cells)} |"
        )
    return lines


def prediction_table(
    predicted: Mapping[str, NDArray[np.float64]],
) -> list[str]:
    """Median and 90 % of what each hypothesis predicts, and the information of each measurement."""
    lines = [
        f"| measurement | {' | '.join(predicted)} | standard error | bit |",
        "|---" * (len(predicted) + 3) + "|",
    ]
    rows = []
    for i, measurement in enumerate(MEASUREMENTS):
        values = [of[:, i] for of in predicted.values()]
        bits = information(values, measurement.error)
        cells = [_interval(of * measurement.factor) for of in values]
        unit = f" {measurement.unit}" if measurement.unit else ""
        text = (
            f"| {measurement.name} | {' | '.join(cells)} | "
            f"{measurement.error * measurement.factor:g}{unit} | {bits:.2f} |"
        )
        rows.append((bits, text))
    return lines + [text for _, text in sorted(rows, reverse=True)]


def _interval(values: NDArray[np.float64]) -> str:
    low, middle, high = np.quantile(values, [0.05, 0.5, 0.95])
    return f"{middle:.3g} ({low:.3g} to {high:.3g})"


def causes_table(compare: Comparison, best: Hypothesis, values: Mapping[str, float]) -> list[str]:
    """What remains of the published numbers as the causes of the best hypothesis are added."""
    steps: tuple[tuple[str, tuple[str, ...]], ...] = (
        ("stage with published clearances, sun floating", ()),
        ("and sun held by friction", ("sun_radial", "sun_friction")),
        ("and a pin out of place", ("pin_offset",)),
        ("and tilted face", ("phi_face", "theta_face")),
        ("and static saddle", ("at_rest", "by_torque", "by_load")),
    )
    lines = [
        "| causes | order 1, LC1, LC2, LC4 (LC3) [um] | M2 leaves, LC1 to LC4 [um] | "
        "load sharing | RMS of the gap to table 5 [um] | to table 4 [um] |",
        "|---|---|---|---|---|---|",
        f"| published | {_numbers(PUBLISHED)} | | |",
    ]
    chosen: dict[str, float] = {}
    for name, added in steps:
        chosen |= {key: values[key] for key in added}
        numbers = compare.numbers(best, chosen)
        gap = 1e6 * (numbers[:7] - PUBLISHED[:7])
        rms = [np.sqrt((of**2).mean()) for of in (gap[:3], gap[3:])]
        lines.append(f"| {name} | {_numbers(numbers)} | {rms[0]:.0f} | {rms[1]:.0f} |")
    return lines


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


def gap_figure(
    runs: Mapping[Run, Samples],
    best: Mapping[Hypothesis, NDArray[np.float64]],
    predicted: Mapping[str, NDArray[np.float64]],
) -> Figure:
    """Evidence by choice, numbers of the most probable values, information of measurements."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(15.0, 9.5), layout="constrained")
    evidence, information_panel, amplitudes, rest = figure.subplots(2, 2).ravel()
    names = list(dict.fromkeys(run.hypothesis.name for run in runs))
    for error, color in zip(AMPLITUDE_ERRORS, ("C0", "C1", "C2"), strict=True):
        for width, marker in zip(WIDTHS, ("v", "o", "^"), strict=True):
            at = {
                r.hypothesis.name: s.log_evidence(error)
                for r, s in runs.items()
                if r.width == width
            }
            top = max(at.values())
            evidence.plot(
                [at[name] - top for name in at],
                [names.index(name) for name in at],
                color + marker,
                alpha=0.8,
                label=f"{1e6 * error:g} µm, width {width:g}",
            )
    evidence.set_yticks(range(len(names)), names, fontsize="small")
    evidence.invert_yaxis()
    evidence.set_xscale("symlog", linthresh=5.0)
    evidence.axvspan(-DECISIVE, 0.0, color="0.9")
    evidence.set(
        xlabel="log evidence less the best's", title="grey: cannot be distinguished from the best"
    )
    evidence.legend(fontsize="x-small", ncols=3, loc="upper center", bbox_to_anchor=(0.4, -0.12))
    bits = {
        m.name: information([of[:, i] for of in predicted.values()], m.error)
        for i, m in enumerate(MEASUREMENTS)
    }
    order = sorted(bits, key=bits.__getitem__)
    information_panel.barh(order, [bits[name] for name in order], color="C0")
    information_panel.tick_params(axis="y", labelsize="small")
    information_panel.set(
        xlabel="information [bit]", title=f"what would distinguish {', '.join(predicted)}"
    )
    cases = list(LOAD_CASES)
    errors = standard_errors(SAMPLED_ERROR) * _IN_UNITS
    for i, (hypothesis, numbers) in enumerate(best.items()):
        shown = numbers * np.append(_IN_UNITS, 1e6)
        line = f"C{i % 10}o-" if i < 10 else f"C{i % 10}s:"
        amplitudes.plot(cases, shown[[0, 1, 8, 2]], line, ms=3, lw=1.0, label=hypothesis.name)
        rest.plot(cases, shown[3:7], line, ms=3, lw=1.0)
    published = PUBLISHED * _IN_UNITS
    bars = {"fmt": "ks", "capsize": 6, "label": "published, two standard errors"}
    amplitudes.errorbar(["LC1", "LC2", "LC4"], published[:3], 2.0 * errors[:3], **bars)
    rest.errorbar(cases, published[3:7], 2.0 * errors[3:7], **bars)
    amplitudes.set(ylabel="order 1 [µm]", title="table 5")
    rest.set(ylabel="RMS that model 2 leaves [µm]", title="table 4")
    rest.legend(
        *amplitudes.get_legend_handles_labels(),
        fontsize="x-small",
        loc="upper left",
        bbox_to_anchor=(1.01, 1.0),
    )
    for panel in (evidence, information_panel, amplitudes, rest):
        panel.grid(alpha=0.3)
    return figure
