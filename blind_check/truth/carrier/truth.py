"""Truth of the kind "carrier".

Six runs of four axial sensors, one withheld effect or two, and a rig not quite as declared.

Torque is 1 % wrong, probes have gains up to 3 % and angles up to 0.5 degrees off, speed has a
ripple of 1 %, noise has a memory, the deflection curves belong to a slightly different carrier on
another mesh. The baseline is refitted by the truth's own least squares on the measured inputs.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.blind_check.labels import (
    ALIASED,
    FORM,
    FORM_FAMILIES,
    MODEL,
    NOTHING,
    ONE_CONDITION,
    OUTSIDE,
    SEVERAL,
    STAGE,
    CasePlan,
    Label,
)
from carrierflex.blind_check.truth.alias_table import same_class
from carrierflex.blind_check.truth.carrier.alias_sets import alias_sets
from carrierflex.blind_check.truth.carrier.off_drawing import model_case
from carrierflex.blind_check.truth.carrier.other_forms import OTHER_FORMS, drawn_form
from carrierflex.blind_check.truth.carrier.rig import (
    N_SENSORS,
    RIG,
    SENSOR_ANGLES,
    SENSOR_NAMES,
    AddedRun,
    CarrierState,
    drawn_record,
    rim_channels,
)
from carrierflex.blind_check.truth.carrier.signals import (
    RADIUS,
    WAVE_ORDERS,
    RimRecord,
    curve_at,
    drawn_values,
    scaled_values,
)
from carrierflex.blind_check.truth.carrier.stage import stage_case
from carrierflex.blind_check.truth.linear_refit import LinearBaseline
from carrierflex.blind_check.truth.noise import (
    added_rng,
    case_rng,
    coloured_noise,
    largest_leak,
    noise_rng,
    root_mean_square,
    uniform_std,
)
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import Baseline, InputSignal
from carrierflex.identification.campaign.records import Run

FloatArray = NDArray[np.float64]

KNOWN = ("axial_offset", "housing_tilt", "carrier_tilt", "flexible_pins")
_MEMORY = 0.5
_SECONDS, _SECONDS_ALONE = 48.0, 150.0
#: Torque over nominal, radial load y and z [N], speed [rad/s] of each run.
_LOADS = (
    (1.0, 0.0, 0.0, 2.3), (0.5, 0.0, 0.0, 1.5), (1.0, 0.0, -2e5, 2.3), (1.0, 1e5, 1e5, 2.3), (0.75,
    0.0, 5e4, 2.0),
    (0.25, -5e4, 0.0, 2.3),
)  # fmt: skip
#: Torque and radial load that never change: what follows the load cannot be told from what does
#: not.
_CONSTANT = ((1.0, 0.0, 0.0, 2.3), (1.0, 0.0, 0.0, 1.5), (1.0, 0.0, 0.0, 2.0))
_TORQUE = 0.01
#: Runs of a drawn plan of loads, and its largest radial load [N].
_FORM_RUNS, _LARGEST_LOAD = 8, 2e5


#: Steps of the search for the size of an effect; sizes that act through a threshold or a sine need
#: more than one.
_SIZE_STEPS, _SIZE_TOLERANCE = 30, 1e-4
#: Largest factor on an effect of unit size that a machine could have: pin loads that stay positive,
#: gains off by 30 %, a sensor 5 degrees from its place, 0.15 s of delay, deflections of three times
#: the model's.
_LARGEST = {
    "unequal_load_sharing": 5.0, "load_sharing_ntl": 5.0, "flexible_pins": 3.0, "stiff_pins": 1.5,
    "pin_clearance": 1.5,
    "sensor_gain": 3.0, "sensor_angle": 3.0, "sensor_delay": 5.0,
}  # fmt: skip
#: Noise of a case [m], drawn between the first two; down to the last where an effect cannot grow to
#: the wanted gap.
_NOISE, _LEAST_NOISE = (2e-6, 5e-6), 0.3e-6
#: Forms that are drawn until the loads show one.
_REDRAWS = 50
#: Largest errors of the sensors, gain and angle [rad]; every size up to them is as likely.
_LARGEST_GAIN, _LARGEST_ANGLE = 0.03, float(np.deg2rad(0.5))
_Gap = Callable[[CarrierState], float]
#: Families whose signals come from tables.
_WITH_A_TRUTH = {STAGE: stage_case, MODEL: model_case}


def carrier_case(
    plan: CasePlan, repeat: int = 0, *, added: Sequence[AddedRun] = ()
) -> tuple[Campaign, Label]:
    """Campaign and label of one case.

    Parameters
    ----------
    plan : CasePlan
        What to withhold and how large its gap shall be.
    repeat : int
        Number of the noise: the truth and the loads of a case are the same in all.
    added : sequence of AddedRun
        Runs measured after those of the case, on the same machine: truth, earlier records and label
        stay what they are without them.

    Returns
    -------
    tuple of (Campaign, Label)
        Records with noise, and the truth.

    Raises
    ------
    ValueError
        Where runs are to be added to a case of the family "stage" or "model".
    """
    if plan.family in _WITH_A_TRUTH:
        if added:
            raise ValueError(f"family {plan.family} takes no further runs; expected another family")
        return _WITH_A_TRUTH[plan.family](plan, repeat)
    rng = case_rng(plan)
    loads: Sequence[Sequence[float]] = {ALIASED: _CONSTANT, ONE_CONDITION: _LOADS[:1]}.get(
        plan.family, _LOADS
    )
    if plan.family in FORM_FAMILIES:
        loads = _form_loads(rng)
    records = [
        drawn_record(rng, k, load, _SECONDS_ALONE if plan.family == ONE_CONDITION else _SECONDS)
        for k, load in enumerate(loads)
    ]
    contained = tuple(name for name in KNOWN if name not in plan.effects)
    error = 1.0 + _TORQUE * float(rng.choice((-1.0, 1.0)))
    declared = [replace(record, torque=record.torque * error) for record in records]
    baseline = _baseline(declared, contained)
    n_runs = len(records) + len(added)
    known = _known_state(contained, rng, n_runs)

    def residuals(read_state: CarrierState) -> list[FloatArray]:
        """Measured less baseline of every run, as the state's readings make it."""
        # Not of the effect alone: what the baseline holds keeps its bound from acting too early.
        return baseline.residuals(read_state.read(records))

    ideal, floor = _sized_state(
        plan, rng, known, n_runs, lambda candidate: _size(residuals(candidate))
    )
    state, share = _with_sensor_errors(
        ideal,
        plan,
        rng,
        floor,
        lambda candidate: _size(_differences(residuals(candidate), residuals(ideal))),
    )
    every = [*records, *_added_records(plan, added, len(records))]
    noise_generator = noise_rng(plan, repeat)
    noise = [
        floor * coloured_noise(noise_generator, (N_SENSORS, record.time.size), memory=_MEMORY)
        for record in every
    ]
    measured = [
        signal + noise_of_run for signal, noise_of_run in zip(state.read(every), noise, strict=True)
    ]
    # The effect as sensors without errors would read it: what a perfect model adds.
    effect = _differences(ideal.read(records), known.read(records))
    rho = _rho(baseline, measured[: len(records)], effect)
    gap = _size(residuals(ideal)) if plan.effects else 0.0
    label = _label(plan, state, contained, (floor, gap, rho))
    if plan.family in FORM_FAMILIES:
        gaps_alone = [_size(residuals(one)) / floor for one in _each_alone(plan, ideal)]
        label = _form_label(plan, label, loads, gaps_alone)
        label = _with_aliases(label, plan, (ideal, known), (records, baseline))
    # What is outside the library, and a drift, have no place among the orders.
    elif label.effects and "thermal_drift" not in label.effects:
        label = replace(label, where=_largest_cell(residuals(ideal), declared))
    declared += [replace(record, torque=record.torque * error) for record in every[len(records) :]]
    return _campaign(plan, declared, measured, contained, (floor, share)), label


def _each_alone(plan: CasePlan, ideal: CarrierState) -> list[CarrierState]:
    """State with each of several causes alone; empty for one or none."""
    if len(plan.effects) < 2:
        return []
    return [
        replace(
            ideal,
            effects={
                name: values
                for name, values in ideal.effects.items()
                if name == cause or name not in plan.effects
            },
        )
        for cause in plan.effects
    ]


def _added_records(plan: CasePlan, added: Sequence[AddedRun], first: int) -> list[RimRecord]:
    """Records of further runs, from random numbers of their own."""
    rng = added_rng(plan)
    return [drawn_record(rng, first + k, run.load, run.seconds) for k, run in enumerate(added)]


def _label(
    plan: CasePlan,
    state: CarrierState,
    contained: Sequence[str],
    sizes: tuple[float, float, float],
) -> Label:
    floor, gap, rho = sizes
    inside = () if plan.family == OUTSIDE else plan.effects
    one_load = plan.family in (ALIASED, ONE_CONDITION)
    return Label(
        case=plan.name,
        kind="carrier",
        family=plan.family,
        effects=inside,
        acceptable=tuple(same_class("carrier", effect, one_load=one_load) for effect in inside),
        # With nothing missing, what the sensors' errors leave is too small to be found.
        present=("sensor_gain", "sensor_angle") if plan.effects else (),
        gap_over_floor=gap / floor,
        floor=floor,
        rho=rho,
        parameters={}
        if plan.family in (OUTSIDE, *FORM_FAMILIES)
        else {name: _named_parameters(name, state) for name in (*inside, *contained)},
        where={},
    )


def _form_loads(rng: np.random.Generator) -> Sequence[Sequence[float]]:
    """The check's six loads, or eight of three or four torques and any radial load."""
    if rng.uniform() < 0.5:
        return _LOADS
    torques = (1.0, 0.75, 0.5, 0.25)[: int(rng.integers(3, 5))]
    loads: list[tuple[float, ...]] = []
    for k in range(_FORM_RUNS):
        size = _LARGEST_LOAD * float(rng.uniform(0.1, 1.0)) if k % 4 else 0.0
        angle, speed = float(rng.uniform(-np.pi, np.pi)), float(rng.uniform(1.4, 2.4))
        load = (size * np.cos(angle), size * np.sin(angle))
        loads.append((torques[k % len(torques)], *load, speed))
    return loads


def _form_label(
    plan: CasePlan, label: Label, loads: Sequence[Sequence[float]], own_gaps: Sequence[float]
) -> Label:
    """Label of a case that is judged by class: the classes of its causes."""
    causes = [OTHER_FORMS[name] for name in plan.effects]
    return replace(
        label,
        family=plan.family if causes else NOTHING,
        classes=tuple(sorted(f"{cause.shape}/{cause.follows}" for cause in causes)),
        drive="six_loads" if len(loads) == len(_LOADS) else "eight_loads",
        own_gaps=tuple(own_gaps),
    )


def _with_aliases(
    label: Label,
    plan: CasePlan,
    states: tuple[CarrierState, CarrierState],
    measured: tuple[Sequence[RimRecord], LinearBaseline],
) -> Label:
    """Label of several causes with the sets of classes that the sensors do not tell from theirs.

    `states` are those with and without the causes, `measured` what acts and what is refitted.
    Labels of one cause or two are what they were: a tie is no right answer there.
    """
    if plan.family != SEVERAL:
        return label
    (ideal, known), (records, baseline) = states, measured
    without = known.read(records)
    alone = {
        name: _differences(one.read(records), without)
        for name, one in zip(plan.effects, _each_alone(plan, ideal), strict=True)
    }
    most = largest_leak(plan) * label.floor
    return replace(label, class_aliases=alias_sets(alone, records, baseline, most))


def _rho(
    baseline: LinearBaseline, measured: Sequence[FloatArray], effect: Sequence[FloatArray]
) -> float:
    """Held-out RMS of the baseline without the effect over that with it."""
    return _size(baseline.held_out(_differences(measured, effect))) / _size(
        baseline.held_out(measured)
    )


def _known_state(contained: Sequence[str], rng: np.random.Generator, n_runs: int) -> CarrierState:
    """What the baseline holds: tilts of 0.06 to 0.15 mrad, pins, offsets."""
    return CarrierState(
        {
            name: scaled_values(drawn_values(name, rng, n_runs), rng.uniform(0.6, 1.5))
            for name in contained
        }
    )


def _differences(signals: Sequence[FloatArray], others: Sequence[FloatArray]) -> list[FloatArray]:
    return [signal - other for signal, other in zip(signals, others, strict=True)]


def _baseline(declared: Sequence[RimRecord], contained: Sequence[str]) -> LinearBaseline:
    """Regressors on the measured inputs; the curve of flexible pins is the truth's own."""
    columns = []
    for record in declared:
        point = record.sensors - record.angle
        rows = {
            "housing_tilt": [f(record.sensors) * RADIUS + 0.0 * point for f in (np.sin, np.cos)],
            "carrier_tilt": [f(point) * RADIUS for f in (np.sin, np.cos)],
            "flexible_pins": [curve_at("delta_f", point) * record.torque / 1e3],
        }
        columns_of_run = [
            row.reshape(-1) for name in rows if name in contained for row in rows[name]
        ]
        columns.append(np.array(columns_of_run).T if columns_of_run else np.zeros((point.size, 0)))
    last = columns[0].shape[1] - 1
    return LinearBaseline(
        columns,
        own_offset="axial_offset" in contained,
        not_negative=(last,) if "flexible_pins" in contained else (),
    )


def _size(signals: Sequence[FloatArray]) -> float:
    return root_mean_square(np.concatenate([signal.reshape(-1) for signal in signals]))


def _campaign(
    plan: CasePlan,
    declared: Sequence[RimRecord],
    measured: Sequence[FloatArray],
    contained: tuple[str, ...],
    errors: tuple[float, float],
) -> Campaign:
    """Records in the form of a measurement campaign; its words tell nothing about the truth.

    `errors` are the noise [m] and the share of the largest errors up to which those of the sensors
    are drawn.
    """
    floor, share = errors
    runs = []
    for record, signals in zip(declared, measured, strict=True):
        name = f"run{record.number + 1}"
        inputs = {
            "carrier_angle": record.angle,
            "torque": record.torque,
            "ntl_y": record.ntl_y,
            "ntl_z": record.ntl_z,
        }
        condition = f"load {record.number + 1}" if len(declared) > 1 else "one load"
        channels = dict(zip(SENSOR_NAMES, signals, strict=True))
        runs.append(Run(name, f"{name}.parquet", condition, record.time, inputs, channels))
    return Campaign(
        kind="carrier",
        name=plan.name,
        baseline=Baseline("model", contained),
        rig=dict(RIG),
        channels=rim_channels(
            floor, uniform_std(share * _LARGEST_GAIN), uniform_std(share * _LARGEST_ANGLE)
        ),
        runs=tuple(runs),
        inputs=(InputSignal("torque", "N m", gain_std=_TORQUE),),
    )


def _named_parameters(name: str, state: CarrierState) -> dict[str, float]:
    """True values by the names of diagnosis.json."""
    sensors = {
        "sensor_gain": ("g", state.gain),
        "sensor_angle": ("dv", state.turned),
        "sensor_zero": ("z", state.zero),
    }
    if name in sensors:
        symbol, values = sensors[name]
        index = int(np.argmax(np.abs(values)))
        return {f"{symbol}_{SENSOR_NAMES[index]}": float(values[index])}
    if name == "sensor_delay":
        return {"tau": state.delay}
    waves = (
        {f"{letter}_{order}": 0.0 for order in WAVE_ORDERS for letter in ("a", "b")}
        if name == "face_runout"
        else {}
    )
    return {key: float(value) for key, value in {**waves, **state.effects[name]}.items()}


def _largest_cell(
    gap: Sequence[FloatArray], records: Sequence[RimRecord]
) -> dict[str, float | str]:
    """Run, order and pattern of the largest part of the gap.

    ``A_m(n) = 1/4 sum_i Y_i(n) exp(j m v_i)`` with Y_i(n) the part of channel i at n times the
    carrier angle.
    """
    best, cell = -1.0, dict[str, float | str]()
    for signal, record in zip(gap, records, strict=True):
        for order in range(9):
            turned = np.exp(-1j * order * record.angle)
            amplitude = signal @ turned / record.time.size * (2.0 if order else 1.0)
            for m, text in ((0, "m=0"), (1, "m=+1"), (-1, "m=-1"), (2, "m=2")):
                if order == 0 and m == -1:
                    continue  # the conjugate of m = +1
                size = abs(np.mean(amplitude * np.exp(1j * m * SENSOR_ANGLES))) ** 2 * (
                    0.5 if order else 2.0 if m == 1 else 1.0
                )
                if size > best:
                    best, cell = (
                        size,
                        {"run": f"run{record.number + 1}", "order": order, "channel_pattern": text},
                    )
    return cell


def _sized_state(
    plan: CasePlan, rng: np.random.Generator, known: CarrierState, n_runs: int, gap: _Gap
) -> tuple[CarrierState, float]:
    """State with the withheld effects, and the noise."""
    floor = float(np.exp(rng.uniform(*np.log(_NOISE))))
    units = [_unit_effect(plan.family, name, rng, n_runs) for name in plan.effects]
    if plan.family in (FORM, SEVERAL):
        units = [
            _shown(unit, name, rng, known, gap)
            for name, unit in zip(plan.effects, units, strict=True)
        ]
    ratios = plan.own_ratios or (plan.ratio / np.sqrt(max(len(units), 1)),) * len(units)
    for name, unit, share in zip(plan.effects, units, ratios, strict=True):
        if name in _LARGEST:
            floor = min(floor, gap(_with(known, unit, _LARGEST[name])) / share)
    floor = max(floor, _LEAST_NOISE)
    state = known
    for name, unit, share in zip(plan.effects, units, ratios, strict=True):
        state = _with(
            state, unit, _factor(known, unit, share * floor, _LARGEST.get(name, np.inf), gap)
        )
    return state, floor


def _factor(
    known: CarrierState, unit: CarrierState, wanted: float, largest: float, gap: _Gap
) -> float:
    """Factor on a unit effect at which it leaves the wanted gap, or its physical limit."""
    factor = 1.0
    for _ in range(_SIZE_STEPS):
        reached = gap(_with(known, unit, factor))
        if abs(reached / wanted - 1.0) < _SIZE_TOLERANCE or reached == 0.0:
            break
        factor = min(factor * wanted / reached, largest)
    return factor


def _with_sensor_errors(
    state: CarrierState,
    plan: CasePlan,
    rng: np.random.Generator,
    floor: float,
    leak: Callable[[CarrierState], float],
) -> tuple[CarrierState, float]:
    """State before sensors up to 3 % and 0.5 degrees off."""
    gain = rng.uniform(-_LARGEST_GAIN, _LARGEST_GAIN, N_SENSORS)
    turned = rng.uniform(-_LARGEST_ANGLE, _LARGEST_ANGLE, N_SENSORS)
    leaked = leak(replace(state, gain_error=gain, angle_error=turned)) / floor
    share = min(1.0, largest_leak(plan) / leaked) if leaked > 0.0 else 1.0
    return replace(state, gain_error=share * gain, angle_error=share * turned), share


def _unit_effect(family: str, name: str, rng: np.random.Generator, n_runs: int) -> CarrierState:
    """A state that holds one effect alone, of about 30 micrometres."""
    if family == OUTSIDE:
        return CarrierState({}, outside=(name, 3e-5))
    if name in OTHER_FORMS:
        return CarrierState({name: drawn_form(name, rng)})
    gains = np.zeros(N_SENSORS)
    gains[rng.integers(N_SENSORS)] = rng.choice((-1.0, 1.0))
    if name == "sensor_gain":
        return CarrierState({}, gain=0.1 * gains)
    if name == "sensor_angle":
        return CarrierState({}, turned=0.03 * gains)
    if name == "sensor_zero":
        return CarrierState({}, zero=3e-5 * gains)
    if name == "sensor_delay":
        return CarrierState({}, delay=0.03 * float(gains.sum()))
    return CarrierState({name: drawn_values(name, rng, n_runs)})


def _shown(
    unit: CarrierState, name: str, rng: np.random.Generator, known: CarrierState, gap: _Gap
) -> CarrierState:
    """Unit effect of a form that these loads show, drawn anew until they do."""
    for _ in range(_REDRAWS):
        if gap(_with(known, unit, 1.0)) > _LEAST_NOISE:
            return unit
        unit = CarrierState({name: drawn_form(name, rng)})
    raise ArithmeticError(f"no form of {name} shows under the drawn loads")


def _with(state: CarrierState, effect: CarrierState, factor: float) -> CarrierState:
    """State with one more effect, `factor` times its unit."""
    more = {name: scaled_values(values, factor) for name, values in effect.effects.items()}
    return replace(
        state,
        effects={**state.effects, **more},
        gain=state.gain + factor * effect.gain,
        turned=state.turned + factor * effect.turned,
        zero=state.zero + factor * effect.zero,
        delay=state.delay + factor * effect.delay,
        outside=(effect.outside[0], factor * effect.outside[1])
        if effect.outside[0]
        else state.outside,
    )
