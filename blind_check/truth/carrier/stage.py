"""Truth of the kind "carrier" from the whole planetary stage, with its own effects.

Readings of the stage come as a table, which ``studies/tabulate_stage_readings.py`` makes: this
module, as every truth, imports no simulation. The prediction of the baseline is the stage without
the effect; what is measured is the stage with it, read with noise and by sensors that are not quite
as declared.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np
from numpy.typing import NDArray

from carrierflex.blind_check.labels import STAGE, CasePlan, Label
from carrierflex.blind_check.truth.alias_table import BROUGHT_ALONG, stage_class
from carrierflex.blind_check.truth.carrier.rig import N_SENSORS, RIG, SENSOR_NAMES, rim_channels
from carrierflex.blind_check.truth.noise import (
    case_rng,
    coloured_noise,
    noise_rng,
    root_mean_square,
    slow_ripple,
    uniform_std,
)
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import Baseline, InputSignal
from carrierflex.identification.campaign.records import Run

FloatArray = NDArray[np.float64]

#: Loads of the table's runs: torque [N m], radial load along y and z [N].
LOADS = (
    (360e3, 0.0, 0.0), (180e3, 0.0, 0.0), (360e3, 0.0, -2e5), (360e3, 1e5, 1e5), (270e3, 0.0, 5e4),
    (90e3, -5e4, 0.0),
)  # fmt: skip
#: Sizes of each effect in the table.
N_SIZES = 3
_SPEED = 2.3
_SPEED_RIPPLE = 0.01
_SECONDS = 48.0
_RATE = 20.0
_MEMORY = 0.5
#: Noise [m] that a gap is set against: down to what no sensor reaches, up to a poor one.
_LEAST_NOISE, _MOST_NOISE = 0.3e-6, 20e-6
#: Errors of gain and torque.
_GAIN, _TORQUE = 3e-3, 0.01


@cache
def _table() -> Mapping[str, tuple[str, FloatArray]]:
    """Support and series of every case of the table [m], shape (n_runs, n_sensors, n_terms)."""
    path = files("carrierflex.blind_check") / "data" / "stage_readings.csv"
    lines = [
        line for line in path.read_text(encoding="utf-8").splitlines() if not line.startswith("#")
    ]
    rows: dict[str, list[list[float]]] = {}
    supports: dict[str, str] = {}
    for line in lines[1:]:
        case, support, _, _, *terms = line.split(",")
        supports[case] = support
        rows.setdefault(case, []).append([float(term) * 1e-9 for term in terms])
    shape = (len(LOADS), N_SENSORS, -1)
    return {
        case: (supports[case], np.array(values).reshape(shape)) for case, values in rows.items()
    }


def stage_readings(case: str) -> tuple[FloatArray, FloatArray]:
    """Series with the effect and of the same stage without it [m].

    Shapes (n_runs, n_sensors, 1 + 2 n_orders): constant, then cosine and sine amplitudes by order.
    """
    support, series = _table()[case]
    return series, _table()[f"nominal {support}"][1]


def stage_case(plan: CasePlan, repeat: int = 0) -> tuple[Campaign, Label]:
    """Campaign and label of a case whose gap a stage's own effect makes.

    Parameters
    ----------
    plan : CasePlan
        Effects and wanted gap over the noise.
    repeat : int
        Number of the noise.
    """
    rng = case_rng(plan)
    size = int(rng.integers(N_SIZES)) + 1
    case = f"{plan.effects[0]} {size}" if len(plan.effects) == 1 else " + ".join(plan.effects)
    series, nominal = stage_readings(case)
    campaign = series_campaign(
        plan.name,
        series,
        nominal,
        lambda gap: float(np.clip(gap / plan.ratio, _LEAST_NOISE, _MOST_NOISE)),
        rng,
        noise_rng(plan, repeat),
    )
    label = _label(plan, campaign.gap / campaign.floor, campaign.floor, campaign.rho)
    return campaign.campaign, label


@dataclass(frozen=True, eq=False)
class SeriesCampaign:
    """Campaign of readings that stand as series, with its prediction.

    Parameters
    ----------
    campaign : Campaign
        The campaign.
    gap : float
        RMS of the true signals less the predicted ones [m].
    floor : float
        Standard deviation of the noise [m].
    rho : float
        RMS that the truth leaves of the records over that of the prediction.
    """

    campaign: Campaign
    gap: float
    floor: float
    rho: float


def series_campaign(
    name: str,
    series: FloatArray,
    nominal: FloatArray,
    floor_of_gap: Callable[[float], float],
    rng: np.random.Generator,
    noise_source: np.random.Generator,
) -> SeriesCampaign:
    """Campaign under `LOADS` of a stage's readings, predicted by those of another stage.

    Parameters
    ----------
    name : str
        Name of the campaign.
    series, nominal : ndarray, shape (n_runs, n_sensors, 1 + 2 n_orders)
        Constant, then cosine and sine amplitudes by order [m], measured and predicted.
    floor_of_gap : callable
        Standard deviation of the noise [m] by the RMS of the gap [m].
    rng, noise_source : numpy.random.Generator
        Of speed, gains and torque; of the noise.
    """
    angles = [_angles(rng) for _ in LOADS]
    true, predicted = (
        [_signals(values[k], angle) for k, angle in enumerate(angles)]
        for values in (series, nominal)
    )
    gap = root_mean_square(
        np.concatenate([(a - b).ravel() for a, b in zip(true, predicted, strict=True)])
    )
    floor = floor_of_gap(gap)
    gain = 1.0 + rng.uniform(-_GAIN, _GAIN, N_SENSORS)
    torque_error = 1.0 + _TORQUE * float(rng.choice((-1.0, 1.0)))
    runs, remaining = [], []
    for k, (angle, load) in enumerate(zip(angles, LOADS, strict=True)):
        noise = floor * coloured_noise(noise_source, true[k].shape, memory=_MEMORY)
        measured = gain[:, None] * true[k] + noise
        remaining.append((measured - true[k], measured - predicted[k]))
        declared = (load[0] * torque_error, load[1], load[2])
        runs.append(_run(k, angle, declared, (measured, predicted[k])))
    with_effect, without = (
        root_mean_square(np.concatenate([pair[i].ravel() for pair in remaining])) for i in (0, 1)
    )
    return SeriesCampaign(_campaign(name, runs, floor), gap, floor, with_effect / without)


def _angles(rng: np.random.Generator) -> FloatArray:
    """Carrier angle over time of a run with slow ripple of the speed."""
    time = np.arange(int(_SECONDS * _RATE)) / _RATE
    speed = _SPEED * (1.0 + slow_ripple(rng, time, size=_SPEED_RIPPLE))
    turned = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) / _RATE)])
    return np.asarray(rng.uniform(0.0, 2.0 * np.pi) + turned)


def _signals(series: FloatArray, angle: FloatArray) -> FloatArray:
    """Signals of a run [m], shape (n_sensors, n)."""
    orders = np.arange(1, (series.shape[1] + 1) // 2)
    waves = np.outer(orders, angle)
    return np.asarray(
        series[:, :1] + series[:, 1::2] @ np.cos(waves) + series[:, 2::2] @ np.sin(waves)
    )


def _run(
    number: int,
    angle: FloatArray,
    load: tuple[float, float, float],
    signals: tuple[FloatArray, FloatArray],
) -> Run:
    still = np.ones_like(angle)
    measured, predicted = (dict(zip(SENSOR_NAMES, rows, strict=True)) for rows in signals)
    name = f"run{number + 1}"
    return Run(
        name,
        f"{name}.parquet",
        f"load {number + 1}",
        np.arange(angle.size) / _RATE,
        {
            "carrier_angle": angle,
            "torque": load[0] * still,
            "ntl_y": load[1] * still,
            "ntl_z": load[2] * still,
        },
        measured,
        predicted,
    )


def _campaign(name: str, runs: list[Run], floor: float) -> Campaign:
    return Campaign(
        kind="carrier",
        name=name,
        baseline=Baseline("columns", ("flexible_pins",)),
        rig=dict(RIG),
        channels=rim_channels(floor, uniform_std(_GAIN)),
        runs=tuple(runs),
        inputs=(InputSignal("torque", "N m", gain_std=_TORQUE),),
    )


def _label(plan: CasePlan, gap_over_floor: float, floor: float, rho: float) -> Label:
    """Label without parameters: the stage's sizes are none of the library's."""
    along = {name for effect in plan.effects for name in BROUGHT_ALONG.get(effect, ())}
    return Label(
        case=plan.name,
        kind="carrier",
        family=STAGE,
        effects=plan.effects,
        acceptable=tuple(stage_class(effect) for effect in plan.effects),
        present=("sensor_gain", *sorted(along)),
        gap_over_floor=gap_over_floor,
        floor=floor,
        rho=rho,
        parameters={},
        where={},
    )
