"""What could be added to a carrier's campaign, and the products of all rows over it."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from carrierflex.diagnosis.carrier.model import (
    CarrierModel,
    contained_channels,
    effect_rows,
    rows_at,
)
from carrierflex.diagnosis.carrier.problem import CarrierProblem, steady_run
from carrierflex.diagnosis.carrier.records.columns import (
    SAME_CONDITION,
    blocks_of_runs,
    columns_of_campaign,
    largest_load,
    mean_load,
    mean_speed,
    typical_speed,
)
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.inference.planning.plan import PlannedTable, Signature
from carrierflex.diagnosis.inference.planning.results import (
    LOADS,
    MINUTES,
    SENSOR,
    Addition,
    Costs,
    RigLimits,
)
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import Channel
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.carrier.models import rim_sensor
from carrierflex.simulation.carrier.effects.drawing import CURVE_ERROR, body_of_effect
from carrierflex.simulation.carrier.rim import CarrierInputs
from carrierflex.simulation.carrier.run_cases import AXIAL, RADIAL
from carrierflex.simulation.fit_parameter import FitParameter
from carrierflex.simulation.stage.stage_data import MountingData

#: Effects that a radial load without a record has, and the columns of its record.
_FOLLOW_LOAD, _NTL = ("ntl_tilt", "flange_warp", "load_sharing_ntl"), ("ntl_y", "ntl_z")


@dataclass(frozen=True, eq=False)
class CarrierPool:
    """Campaign as planned with all that could be added, and the additions."""

    #: Planned runs first, planned channels first; signals of what is added are blank
    campaign: Campaign
    planned: Addition  # What is planned alone
    additions: tuple[Addition, ...]  # What could be added


@dataclass(frozen=True)
class _Load:
    name: str
    text: str
    torque: float
    ntl_y: float
    ntl_z: float
    speed: float


def carrier_pool(campaign: Campaign, costs: Costs, limits: RigLimits) -> CarrierPool:
    """Sensors at feasible places, further loads alone and in sets, and longer runs."""
    durations = [float(run.time[-1] - run.time[0]) for run in campaign.runs]
    seconds = float(np.mean(durations))
    channels = tuple(channel.name for channel in campaign.channels)
    once = {run.name: 1.0 for run in campaign.runs}
    loads = _feasible_loads(campaign, limits)
    sensors = _feasible_sensors(campaign, limits)
    runs = (*campaign.runs, *(_steady_run(campaign, load, seconds) for load in loads))
    pool = replace(
        campaign,
        channels=(*campaign.channels, *sensors),
        runs=tuple(_blank(run, sensors) for run in runs),
    )
    additions = [
        Addition(
            SENSOR,
            f"{'an axial' if sensor.quantity == AXIAL else 'a radial'} sensor at "
            f"{np.rad2deg(sensor.angle or 0.0) % 360:.0f} deg",
            once,
            (*channels, sensor.name),
            costs.sensor,
        )
        for sensor in sensors
    ]
    for names in _sets_of_loads(loads):
        texts = " and ".join(load.text for load in loads if load.name in names)
        for length in (1.0, 2.0, 4.0):
            longer = once | dict.fromkeys(names, length)
            duration = len(names) * length * seconds
            cost = costs.load_case * len(names) + costs.minute * duration / 60.0
            text = f"{texts}, {length * seconds:.0f} s{' each' if len(names) > 1 else ''}"
            additions.append(Addition(LOADS, text, longer, channels, cost))
    for factor in (2.0, 4.0):
        text = f"every run {factor:g} times as long"
        cost = costs.minute * (factor - 1.0) * (sum(durations) / 60.0)
        additions.append(Addition(MINUTES, text, dict.fromkeys(once, factor), channels, cost))
    return CarrierPool(pool, Addition(MINUTES, "as planned", once, channels, 0.0), tuple(additions))


def _feasible_loads(campaign: Campaign, limits: RigLimits) -> list[_Load]:
    """Loads that no planned run has."""
    nominal = float(campaign.rig["nominal_torque"])
    speed = max(map(mean_speed, campaign.runs), key=abs)
    has_radial = "ntl_y" in campaign.contract.inputs
    full = min(nominal, limits.torque)
    loads = [
        _Load(f"torque {s:g}", f"{s:.0%} torque without radial load", s * nominal, 0.0, 0.0, speed)
        for s in (0.1, 0.25, 0.5, 0.75, 1.0)
        if s * nominal <= limits.torque
    ]
    loads.append(_Load("slow", "full torque at 0.5 of the speed", full, 0.0, 0.0, 0.5 * speed))
    directions = ("y", "-y", "z", "-z") if has_radial else ()
    for torque, along, share in product((0.25, 1.0), directions, (0.5, 1.0)):
        force = share * limits.radial_load
        signed = -force if along.startswith("-") else force
        y, z = (signed, 0.0) if along.endswith("y") else (0.0, signed)
        text = f"{torque:.0%} torque with {force / 1e3:g} kN along {along}"
        loads.append(
            _Load(f"torque {torque:g} {along} {share:g}", text, torque * full, y, z, speed)
        )
    scale = np.array([nominal, limits.radial_load, limits.radial_load, speed])
    planned = np.array(
        [
            [*(mean_load(run, name) for name in ("torque", *_NTL)), mean_speed(run)]
            for run in campaign.runs
        ]
    )

    def is_planned(load: _Load) -> bool:
        possible = np.array([load.torque, load.ntl_y, load.ntl_z, load.speed])
        apart = np.abs(possible / scale - planned / scale)
        return bool((apart <= SAME_CONDITION).all(axis=1).any())

    return [load for load in loads if not is_planned(load)]


def _sets_of_loads(loads: Sequence[_Load]) -> Iterator[tuple[str, ...]]:
    """Every load alone, then sets of torques and of radial loads."""
    names = {load.name for load in loads}
    yield from ((load.name,) for load in loads)
    sets = [
        ("torque 0.5", "torque 0.25"),
        ("torque 0.1", "torque 0.5"),
        ("torque 0.1", "torque 0.75"),
        ("torque 0.1", "torque 0.5", "torque 0.75"),
        ("torque 0.1", "torque 0.25", "torque 0.5", "torque 0.75"),
        ("torque 1 y 1", "torque 1 z 1"),
        ("torque 1 y 1", "torque 1 z 1", "torque 1 z 0.5"),
        ("torque 1 z 1", "torque 1 -z 1", "torque 1 z 0.5", "torque 1 -z 0.5"),
        ("torque 1 y 1", "torque 1 -y 1", "torque 1 z 1", "torque 1 -z 1"),
        ("torque 0.25", "torque 1 y 1", "torque 1 z 1"),
        ("torque 0.25 y 1", "torque 0.25 z 1"),
        ("torque 0.25", "torque 0.5", "torque 1 y 1", "torque 1 z 1"),
        ("torque 0.1", "torque 0.5", "torque 1 y 1", "torque 1 z 1", "torque 1 -z 0.5"),
    ]
    yield from (members for members in sets if names.issuperset(members))


def _feasible_sensors(campaign: Campaign, limits: RigLimits) -> list[Channel]:
    """Axial and radial sensors at feasible places where none stands."""
    angles = limits.sensor_angles or tuple(np.deg2rad(np.arange(0, 360, 30)).tolist())
    squares = [(channel.noise_std or 0.0) ** 2 for channel in campaign.channels]
    noise = float(np.sqrt(np.mean(squares))) or None
    sensors = []
    for quantity, letter in ((AXIAL, "s"), (RADIAL, "r")):
        taken = [float(c.angle or 0.0) for c in campaign.channels if c.quantity == quantity]
        for angle in angles:
            apart = [abs(np.angle(np.exp(1j * (angle - other)))) for other in taken]
            if min(apart, default=np.pi) < np.deg2rad(10.0):
                continue
            name = f"{letter}{np.rad2deg(angle) % 360:03.0f} added"
            radius = campaign.channels[0].radius
            sensors.append(
                Channel(name, quantity, "m", angle=angle, radius=radius, noise_std=noise)
            )
    return sensors


def _blank(run: Run, channels: Sequence[Channel]) -> Run:
    blank = {channel.name: np.zeros(run.time.size) for channel in channels}
    predictions = {**run.predictions, **blank} if run.predictions else {}
    return replace(run, signals={**run.signals, **blank}, predictions=predictions)


def _steady_run(campaign: Campaign, load: _Load, seconds: float) -> Run:
    """Run under one load; its signals are blank."""
    rate = min((run.time.size - 1) / (run.time[-1] - run.time[0]) for run in campaign.runs)
    rate = max(float(rate), 36 * abs(load.speed) / (2.0 * np.pi))
    time = np.arange(round(seconds * rate) + 1) / rate
    loads = (load.torque, load.ntl_y, load.ntl_z)
    run = steady_run(campaign, load.name, load.text, time, load.speed * time, loads)
    return replace(run, predictions=run.signals) if campaign.runs[0].predictions else run


def carrier_planned_table(
    problem: CarrierProblem,
    pool: Campaign,
    limits: RigLimits,
    note: Callable[[str], None] = lambda text: None,
) -> PlannedTable:
    """Products of target, baseline and signatures by run and channel.

    `problem` has signals: its fitted baseline says at which amplitudes errors of sensors act.
    Parts: every planned run of the pool at every channel, every added run at the planned channels.
    """
    model = _model_of(problem, pool)
    base = _baseline_values(problem, model)
    candidates = tuple(problem.cards)
    rows = effect_rows(model, candidates, base)
    n_runs, n_channels = len(problem.campaign.runs), len(problem.campaign.channels)
    noise = np.full(len(pool.channels), float(np.mean(problem.noise)))
    noise[:n_channels] = problem.noise
    contained = contained_channels(model)
    of_run = _rows_of_load(model, problem.campaign)
    n_columns = rows.size + of_run * n_runs
    products = []
    for r, run in enumerate(pool.within_use().runs):
        note(f"signatures under {run.condition}")
        sensors = pool.channels[: None if r < n_runs else n_channels]
        for c, (block,) in blocks_of_runs([run], sensors, model.source, 1, model.effects):
            present = block.present
            numbers, weights = rows_at(rows.groups, r, c, len(present))
            signatures = weights @ present
            if of_run and r < n_runs:
                loads = _unrecorded_rows(model, sensors[c], block.inputs, limits.radial_load)
                signatures = np.concatenate([signatures, loads])
                at_end = rows.size + of_run * r + np.arange(of_run)
                numbers = np.concatenate([numbers, at_end])
            gram = np.zeros((n_columns, n_columns))
            gram[np.ix_(numbers, numbers)] = signatures @ signatures.T / noise[c]
            products.append((gram, r, c, float(present.shape[1])))
    grams, runs, channels, counts = map(np.array, zip(*products, strict=True))
    unknowns = model.parameters((), contained)
    scales, parameters = _scales(model, candidates, contained, base.size)
    of_effects = tuple(
        Signature(*key, tuple(columns.tolist())) for key, columns in rows.variants.items()
    )
    sizes = np.ones(n_columns)
    sizes[1 : 1 + base.size] = [unknown.scale for unknown in unknowns]
    precision = [
        (unknown.scale / unknown.prior_std) ** 2 if unknown.is_free else np.inf
        for unknown in unknowns
    ]
    bound = np.full(n_columns, np.inf)
    of_curves = [k for k, unknown in enumerate(unknowns) if unknown.effect == CURVE_ERROR]
    bound[[1 + k for k in of_curves]] = [unknowns[k].upper / unknowns[k].scale for k in of_curves]
    for signature in of_effects:
        columns, last = list(signature.columns), model.effects[signature.effect].parameters[-1]
        change = 0.0 if last.absent_at is None else abs(signature.variant[0] - last.absent_at)
        sizes[columns] = np.array(scales[signature.effect]) / (change or 1.0)
        if body_of_effect(signature.effect):
            bound[columns] = last.upper / last.scale
    return PlannedTable(
        grams * np.outer(sizes, sizes),
        base.size,
        np.array(precision),
        of_effects,
        parameters,
        runs,
        channels,
        counts,
        tuple(run.name for run in pool.runs),
        tuple(channel.name for channel in pool.channels),
        float(np.sqrt(np.mean(problem.noise))),
        n_columns - rows.size,
        # Zero and calibration of strain gauges on the main shaft [N m]; chosen.
        (limits.radial_load * MountingData.ntl_arm / 1e3) ** 2,
        bound,
    )


def _rows_of_load(model: CarrierModel, campaign: Campaign) -> int:
    """Columns of a run for a radial load along y and z that no run of a rig has on record."""
    is_possible = "ntl_y" in campaign.contract.inputs
    if not is_possible or any(run.inputs[name].any() for run in campaign.runs for name in _NTL):
        return 0
    return len(_NTL) * sum(len(model.effects[name].parameters) for name in _FOLLOW_LOAD)


def _unrecorded_rows(
    model: CarrierModel, channel: Channel, inputs: CarrierInputs, load: float
) -> FloatArray:
    """What a radial load along y, then z adds, each amplitude of noticeable size, shape (k, n)."""
    sensor, rig = rim_sensor(channel), model.source.rig
    zero = np.zeros_like(inputs.torque)
    none = replace(inputs, ntl_y=zero, ntl_z=zero)
    rows = []
    for name in _FOLLOW_LOAD:
        effect = model.effects[name]
        scales = np.array([parameter.scale for parameter in effect.parameters])
        still = effect.signals(sensor, none, rig)
        for of_load in (replace(none, ntl_y=zero + load), replace(none, ntl_z=zero + load)):
            rows.append(scales[:, None] * (effect.signals(sensor, of_load, rig) - still))
    return np.concatenate(rows)


def _model_of(problem: CarrierProblem, pool: Campaign) -> CarrierModel:
    """Model over all runs and channels; shapes lie within the loads that are possible."""
    of = problem.model
    source = replace(of.source, speed=typical_speed(pool), largest_load=largest_load(pool))
    index = columns_of_campaign(pool.runs[0], pool.channels[0], source)
    names = tuple(run.name for run in pool.runs)
    channels = tuple(channel.name for channel in pool.channels)
    return CarrierModel(source, index, of.contained, names, channels, of.known)


def _baseline_values(problem: CarrierProblem, model: CarrierModel) -> FloatArray:
    """Fitted baseline; parameters of an added run are those of the first run."""
    theta = problem.starts((), {})[1]
    values = list(zip(problem.parameters(()), theta.tolist(), strict=True))
    of_first_run = {(p.effect, p.name): value for p, value in reversed(values)}
    of_runs = {(p.effect, p.name, p.run): value for p, value in values}
    return np.array(
        [
            of_runs.get((p.effect, p.name, p.run), of_first_run.get((p.effect, p.name), 0.0))
            for p in model.parameters((), contained_channels(model))
        ]
    )


def _scales(
    model: CarrierModel, candidates: tuple[str, ...], contained: Mapping[str, int], n_base: int
) -> tuple[dict[str, list[float]], dict[str, FitParameter]]:
    """Scales of the amplitudes of every effect, and its first one."""
    scales: dict[str, list[float]] = {}
    first: dict[str, FitParameter] = {}
    for name in candidates:
        one = model.effects[name].is_of_one_channel
        choice = {**contained, name: 0} if one else contained
        sizes = [p for p in model.parameters((name,), choice)[n_base:] if not p.shape]
        scales[name] = [p.scale for p in sizes]
        published = sizes[0].name.rpartition("_")[0] if one else sizes[0].name
        pair = sizes[0].pair
        first[name] = replace(sizes[0], name=published if pair is None else pair.size)
        shape = model.effects[name].parameters[-1]
        if shape.absent_at is not None:
            # A quantity that has a value without the effect: its smallest change.
            nodes = np.array(model.source.shape_nodes(model.effects[name]))
            nearest = float(np.abs(nodes[nodes != shape.absent_at] - shape.absent_at).min())
            scales[name] = [nearest]
            first[name] = replace(shape, name=f"change of {shape.name}", scale=nearest)
    return scales, first
