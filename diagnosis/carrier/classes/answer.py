"""Class of the missing effect of a carrier: table by block, decision, the laws nearest to it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from carrierflex.diagnosis.carrier.classes.class_rows import (
    UNDETERMINED,
    ClassRows,
    class_rows,
    shapes,
    torque_levels,
)
from carrierflex.diagnosis.carrier.classes.measured_laws import VisitedLoads, law_of_carrier_class
from carrierflex.diagnosis.carrier.model import (
    CarrierModel,
    EffectRows,
    contained_channels,
    effect_rows,
    is_held,
    rows_at,
)
from carrierflex.diagnosis.carrier.records.sums import IN_MEMORY, ROUNDING, CarrierSums
from carrierflex.diagnosis.classes.answer import answer_of
from carrierflex.diagnosis.classes.constants import ClassConstants
from carrierflex.diagnosis.classes.decision import (
    FURTHER_CAUSE,
    ClassesByShape,
    shape_of,
    way_of,
)
from carrierflex.diagnosis.classes.gram_table import ColumnGroup, GramTable, IntArray, LawColumns
from carrierflex.diagnosis.classes.held_out import ClassScores
from carrierflex.diagnosis.classes.results import NOTHING, ClassAnswer
from carrierflex.diagnosis.classes.shares import Shares
from carrierflex.diagnosis.comparison.problem import Effects, FloatArray
from carrierflex.diagnosis.inference.law_fits import FEWEST_CONDITIONS
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.simulation.carrier.effects.drawing import body_of_effect
from carrierflex.simulation.carrier.effects.inside_stage import STAGE, group_of_effect
from carrierflex.simulation.carrier.measured_laws.rim_patterns import (
    BY_BOTH,
    BY_RADIAL_LOAD,
    BY_TORQUE,
    MODULATED,
    NONE,
    OFFSET,
    PLANET_PASS,
    SADDLE,
    TILT,
    TIME,
    TURNING_TILT,
    UNEVEN,
    WAVES,
)

#: Classes of errors of the sensors.
GAIN, ZERO, ANGLE, DELAY = "channel/gain", "channel/zero", "channel/angle", "clock/delay"
#: A carrier that differs from its drawing, by the body that does.
_MODEL = "model"
#: Standard deviation of a derivative of the curves, over its value: its mesh (5 % of the outer
#: radius') and the change's own size (5 to 10 % at 8 %), against carriers of another finite element
#: code (docs/validation.md).
DERIVATIVE_STD = 0.1
#: Size of a combination of causes, over the largest, that counts as a column of their class.
_COUNTED = 0.03
#: Weight of an exactly known parameter of the baseline, of columns of unit energy.
_EXACT = 1e6

#: Frame and pattern of each law of the library, and what it follows.
_LAWS = {
    "axial_offset": (OFFSET, (NONE,)),
    "thermal_drift": (OFFSET, (TIME,)),
    "housing_tilt": (TILT, (NONE,)),
    "torque_tilt": (TILT, (BY_TORQUE,)),
    "ntl_tilt": (TILT, (BY_RADIAL_LOAD,)),
    "bearing_clearance": (TILT, (BY_RADIAL_LOAD,)),
    "clearance_rocking": (TILT, (BY_RADIAL_LOAD,)),
    "flange_warp": (SADDLE, (NONE, BY_TORQUE, BY_RADIAL_LOAD)),
    "ring_pass": (PLANET_PASS, (BY_TORQUE,)),
    "load_sharing_ntl": (MODULATED, (BY_BOTH,)),
    "carrier_tilt": (TURNING_TILT, (NONE,)),
    # At radial sensors the waves of a tilt are those of a shift.
    "radial_offset": (TILT, (NONE,)),
    "eccentricity": (TURNING_TILT, (NONE,)),
    "flexible_pins": (WAVES, (BY_TORQUE,)),
    "stiff_pins": (WAVES, (BY_TORQUE,)),
    "pin_clearance": (WAVES, (BY_TORQUE,)),
    "face_runout": (WAVES, (NONE,)),
    "unequal_load_sharing": (UNEVEN, (BY_TORQUE,)),
    "sensor_gain": (GAIN, (NONE,)),
    "sensor_zero": (ZERO, (NONE,)),
    "sensor_angle": (ANGLE, (NONE,)),
    "sensor_delay": (DELAY, (NONE,)),
}
CLASS_OF_LAW = {law: shape for law, (shape, _) in _LAWS.items()}
#: Frames and patterns of laws that hold whatever the load.
CONSTANT_SHAPES = {law: shape for law, (shape, follows) in _LAWS.items() if NONE in follows}
#: Effects of the sensors, whose own signatures are the columns of their class.
_SENSOR_EFFECTS = {law: shape for law, shape in CLASS_OF_LAW.items() if law.startswith("sensor_")}
#: Blocks of a run that the table keeps, and folds of blocks where conditions are few.
_BLOCKS_A_RUN = 4
#: Blocks that are enough to tell how far a score varies from one to the next; four times as many
#: where memory holds their products.
_FEWEST_BLOCKS = 24
_TORQUES_NOTE = "fewer than three torques: what a class follows cannot be determined"
_OFFSET_NOTE = "the offset of every run is fitted to it: whether one is missing is not compared"
#: The folds choose from penalties down to none, for gaps of hundreds of floors.
_CONSTANTS = ClassConstants(
    ridges=(1e-12, 1e-10, *ClassConstants.ridges), second_cause=FURTHER_CAUSE
)


@dataclass(frozen=True, eq=False)
class CarrierTable:
    """Table with what its columns are."""

    table: GramTable  # Products
    sizes: Mapping[str, int]  # Columns of each class
    visited: VisitedLoads  # Loads of the records, over which amplitudes are tabulated


def carrier_class_table(
    model: CarrierModel,
    campaign: Campaign,
    records: CarrierSums,
    noise: FloatArray,
    candidates: Effects,
    base: FloatArray,
) -> CarrierTable | None:
    """Table of all classes and laws of a campaign; None where the blocks are too few."""
    if len(records.segments) < _CONSTANTS.fewest_blocks:
        return None
    source = model.source
    scale = np.array([source.rig.nominal_torque, source.largest_load, source.largest_load])
    means = records.mean_loads
    n_torques = torque_levels(means[:, 0] / scale[0])
    of_all_runs = tuple(name for name in candidates if not model.effects[name].per_run)
    effects = effect_rows(model, of_all_runs, base)
    classes = class_rows(campaign.channels, source.rig, means / scale, n_torques)
    rows = _table_rows(model, effects, classes)
    block_of_segment = _block_of_each_segment(records, rows.of_run.start)
    gram = _products(rows, model, records, block_of_segment)
    by_segment = records.counts @ noise
    floor = np.array([by_segment[block_of_segment == b].sum() for b in range(len(gram))])
    first = np.unique(block_of_segment, return_index=True)[1]
    conditions = [records.segments[p].condition for p in first.tolist()]
    # Without the condition of one of two torques nothing tells what follows torque from what does
    # not: only amplitudes at the torques that were fitted can be predicted.
    has_torques = n_torques >= FEWEST_CONDITIONS
    has_conditions = has_torques and len(set(conditions)) >= FEWEST_CONDITIONS
    run = records.run_of_segment[first]
    if has_conditions:
        folds = _numbered(conditions)
    else:
        folds = (np.arange(run.size) - np.searchsorted(run, run) + run) % _BLOCKS_A_RUN
    visited = VisitedLoads(
        records.loads,
        scale,
        n_torques,
        tuple(dict.fromkeys(channel.quantity for channel in campaign.channels)),
        source.rig.n_planets,
        float(campaign.rig["sensor_radius"]),
        {name: group.weights for name, group in classes.groups.items()},
    )
    groups = rows.groups
    # Unit energies, each group scaled as one; causes of a body have units of their own.
    energy = np.diag(gram.sum(axis=0)).copy()
    for group in groups.values():
        energy[group.columns] = energy[group.columns].max()
    unit = 1.0 / np.sqrt(np.where(energy > 0.0, energy, 1.0))
    variance = float(floor.sum() / records.counts.sum())
    penalty = _known_of_base(model, rows, base, unit, variance)
    groups |= _groups_of_model(model, rows, unit)
    class_groups = {
        name: members
        for name, members in _groups_of_classes(model, has_torques=has_torques).items()
        if set(members) <= set(groups)
    }
    # In place: the products of all blocks are the table's alone.
    gram *= np.outer(unit, unit)
    laws = _laws(rows, model)
    model_laws = {name: of_class for name, of_class in laws.items() if name in class_groups}
    table = GramTable(
        gram=gram,
        n_base=rows.n_base,
        groups=groups,
        classes=class_groups,
        surface="",
        ceiling=tuple(dict.fromkeys(name for names in class_groups.values() for name in names)),
        laws={name: (*laws.get(shape_of(name), ()), *laws.get("", ())) for name in class_groups}
        | model_laws,
        floor=floor * unit[0] ** 2,
        base_penalty=penalty,
        folds=folds,
        scale=unit,
    )
    sizes = table.sizes
    for name in class_groups:
        if shape_of(name) == _MODEL or shape_of(name).startswith(STAGE):
            sizes[name] = _n_combinations(table, groups[class_groups[name][0]])
    return CarrierTable(table, sizes, visited)


def _known_of_base(
    model: CarrierModel, rows: "_TableRows", base: FloatArray, unit: FloatArray, variance: float
) -> FloatArray:
    """Penalty of shared regressors by what is known of them, in units of the table, (n_base,)."""
    penalty = np.zeros(rows.n_base)
    for k, parameter in enumerate(model.parameters((), contained_channels(model))):
        if parameter.run is not None:
            continue
        number = int(rows.of_row[1 + k])
        if is_held(parameter, float(base[k])):
            penalty[number - 1] = _EXACT
        elif np.isfinite(parameter.prior_std):
            penalty[number - 1] = variance * (unit[number] / parameter.prior_std) ** 2
    return penalty


def _groups_of_model(
    model: CarrierModel, rows: "_TableRows", unit: FloatArray
) -> dict[str, ColumnGroup]:
    """Causes of every body, each penalised by its change over its tolerance; those of the stage."""
    members: dict[str, list[str]] = {}
    for (owner, _), numbers in rows.effects.variants.items():
        body, of_stage = body_of_effect(owner), group_of_effect(owner)
        if body or of_stage:
            name = f"{_MODEL}:{body}" if body else f"{STAGE}:{of_stage}"
            members.setdefault(name, []).extend([owner] * numbers.size)
    groups = {}
    for name, owners in members.items():
        columns = rows.of_row[rows.effects.of(*owners)]
        if name.startswith(STAGE):
            # Between two sizes a cause is a sum of what it is at both.
            is_sized = all(model.effects[owner].n_shapes for owner in owners)
            groups[name] = ColumnGroup(columns, np.eye(columns.size), is_sized)
        else:
            std = np.array([model.effects[owner].parameters[0].scale for owner in owners])
            weight = (unit[columns] / std) ** 2
            groups[name] = ColumnGroup(columns, np.diag(weight / weight.mean()))
    return groups


def _n_combinations(table: GramTable, group: ColumnGroup) -> int:
    """Combinations of causes, within their tolerances, that differ."""
    tolerance = 1.0 / np.sqrt(np.diag(group.penalty))
    products = table.total[np.ix_(group.columns, group.columns)]
    sizes = np.sqrt(np.maximum(np.linalg.eigvalsh(products * np.outer(tolerance, tolerance)), 0.0))
    return int(np.count_nonzero(sizes > _COUNTED * sizes.max(initial=0.0)))


def _block_of_each_segment(records: CarrierSums, n_columns: int) -> IntArray:
    """Block of the table of every segment, numbered as they come; as many as memory holds."""
    n_runs = int(records.run_of_segment.max()) + 1
    bytes_of_block = n_columns**2 * np.dtype(float).itemsize
    most = _BLOCKS_A_RUN * _FEWEST_BLOCKS
    n_blocks = int(np.clip(IN_MEMORY // bytes_of_block, _FEWEST_BLOCKS, most))
    if n_runs > n_blocks:
        return _numbered(_blocks_of_runs(records, n_runs, n_blocks)[records.run_of_segment])
    most = max(1, min(_BLOCKS_A_RUN, n_blocks // n_runs))
    blocks: list[IntArray] = []
    for run in range(n_runs):
        n_segments = int(np.count_nonzero(records.run_of_segment == run))
        neighbours = np.array_split(np.arange(n_segments), min(most, n_segments))
        blocks += [np.full(block.size, len(blocks) + k) for k, block in enumerate(neighbours)]
    return np.concatenate(blocks)


def _blocks_of_runs(records: CarrierSums, n_runs: int, most: int) -> IntArray:
    """Block of every run: each condition has its share of them, one at least."""
    first = np.searchsorted(records.run_of_segment, np.arange(n_runs))
    conditions = np.array([records.segments[p].condition for p in first.tolist()])
    blocks = np.empty(n_runs, dtype=np.int64)
    n_blocks = 0
    for condition in dict.fromkeys(conditions.tolist()):
        runs = np.flatnonzero(conditions == condition)
        for block in np.array_split(runs, max(1, most * runs.size // n_runs)):
            blocks[block] = n_blocks
            n_blocks += 1
    return blocks


def _numbered(labels: Sequence[str] | IntArray) -> IntArray:
    """Labels as numbers in the order in which they first come."""
    _, first, inverse = np.unique(labels, return_index=True, return_inverse=True)
    return np.asarray(np.argsort(np.argsort(first))[inverse])


@dataclass(frozen=True, eq=False)
class _TableRows:
    """Rows of the table: target, shared baseline, laws, classes; then offset and values of a run.

    The last ones are at the same numbers for every run and are taken out of it.
    """

    effects: EffectRows
    classes: ClassRows
    of_row: IntArray  # number in the table of each row of target, baseline and laws
    n_base: int  # parameters of the baseline that all runs share
    of_classes: slice
    of_run: slice  # offset and parameters of one run

    @property
    def groups(self) -> dict[str, ColumnGroup]:
        """Columns of every group, and their penalty."""
        groups = {
            name: ColumnGroup(self.of_classes.start + np.arange(rows.start, rows.stop), penalty)
            for name, (rows, penalty) in self.classes.rows_of_groups.items()
        }
        for law, name in _SENSOR_EFFECTS.items():
            columns = self.of_row[self.effects.of(law)]
            if columns.size:
                groups[f"{name}:{NONE}"] = ColumnGroup(columns, np.eye(columns.size))
        return groups


def _table_rows(model: CarrierModel, effects: EffectRows, classes: ClassRows) -> _TableRows:
    parameters = model.parameters((), contained_channels(model))
    is_of_run = np.zeros(effects.size, dtype=bool)
    is_of_run[1 : 1 + len(parameters)] = [p.run is not None for p in parameters]
    of_row = np.cumsum(~is_of_run) - 1
    first = int(np.count_nonzero(~is_of_run))
    end = first + classes.size
    n_of_run = 0
    for run in model.runs:
        numbers = [1 + k for k, p in enumerate(parameters) if p.run == run]
        of_row[numbers] = end + 1 + np.arange(len(numbers))
        n_of_run = max(n_of_run, len(numbers))
    n_base = first - effects.size + effects.n_base
    return _TableRows(
        effects, classes, of_row, n_base, slice(first, end), slice(end, end + 1 + n_of_run)
    )


def _products(
    rows: _TableRows, model: CarrierModel, records: CarrierSums, block_of_segment: IntArray
) -> FloatArray:
    """Products of the rows by block, the parameters of each run fitted to the run and taken out."""
    n_blocks, size, end = int(block_of_segment.max()) + 1, rows.of_run.stop, rows.of_run.start
    waves = slice(rows.of_classes.start, end + 1)
    n_columns = records.index.flexible.start
    result = np.zeros((n_blocks, end, end))
    before = np.zeros(end)
    for run in range(len(model.runs)):
        of_classes = rows.classes.of_run(run)
        segments = records.segments_of(slice(run, run + 1))
        blocks, first = np.unique(block_of_segment[segments], return_index=True)
        products = records.products_of_basis(segments, first)
        by_channel, weighted = [], []
        for channel in range(len(model.channels)):
            numbers, of_effects = rows_at(rows.effects.groups, run, channel, n_columns)
            weights = np.zeros((size, len(records.index)))
            weights[rows.of_row[numbers], :n_columns] = of_effects
            weights[waves, n_columns:] = of_classes[:, channel]
            by_channel.append(records.by_basis(channel, weights))
            weighted.append(by_channel[-1] @ products[:, channel])
        gram = np.concatenate(weighted, axis=2) @ np.hstack(by_channel).T
        before += np.diag(gram.sum(axis=0))[:end]
        result[blocks] += _without_run(gram, rows.of_run)
    # What the parameters of the runs take completely is rounding of either sign.
    empty = np.diag(result.sum(axis=0)) <= ROUNDING * before
    result[:, empty] = 0.0
    result[:, :, empty] = 0.0
    return result


def _without_run(gram: FloatArray, of_run: slice) -> FloatArray:
    """Products of one run by block once its parameters, the last ones, are fitted to it."""
    total = gram.sum(axis=0)
    rest = slice(0, of_run.start)
    fit = total[rest, of_run] @ np.linalg.pinv(total[of_run, of_run], rcond=ROUNDING)
    # ``G - F R - (F R)' + F G_rr F'`` with R the rows of the run, as one product and its transpose.
    half = gram[:, of_run, rest] - 0.5 * gram[:, of_run, of_run] @ fit.T
    taken = fit @ half
    return np.asarray(gram[:, rest, rest] - taken - np.swapaxes(taken, 1, 2))


def _laws(rows: _TableRows, model: CarrierModel) -> dict[str, tuple[LawColumns, ...]]:
    """Columns of every law by frame and pattern; a user's effect under the empty name."""
    variants: dict[str, list[IntArray]] = {}
    for (law, _), numbers in rows.effects.variants.items():
        variants.setdefault(law, []).append(rows.of_row[numbers])
    laws: dict[str, tuple[LawColumns, ...]] = {}
    for law, columns in variants.items():
        shape = _model_class(law) or model.class_of_measured.get(law, CLASS_OF_LAW.get(law, ""))
        of_law = LawColumns(law, tuple(columns), len(model.effects[law].parameters))
        laws[shape] = (*laws.get(shape, ()), of_law)
    return laws


def _groups_of_classes(model: CarrierModel, *, has_torques: bool) -> dict[str, tuple[str, ...]]:
    """Groups of columns of every class, the simplest of a shape first."""
    groups: dict[str, tuple[str, ...]] = {}
    for shape in shapes():
        if shape.id == OFFSET:
            # Every run has an offset of its own: what follows the loads is in it.
            groups[f"{OFFSET}/{TIME}"] = (f"{OFFSET}:{TIME}",)
            continue
        for dependences in shape.sets if has_torques else (tuple(shape.columns),):
            name = _class_id(shape.id, dependences, has_torques=has_torques)
            groups.setdefault(name, tuple(f"{shape.id}:{one}" for one in dependences))
    for effect, name in _SENSOR_EFFECTS.items():
        if effect not in model.contained:
            groups[f"{name}/{NONE}"] = (f"{name}:{NONE}",)
    for name in filter(None, map(_model_class, model.effects)):
        frame, pattern, *_ = name.split("/")
        groups[name] = (f"{frame}:{pattern}",)
    return groups


def _model_class(law: str) -> str:
    """Class of a cause of drawing or stage, the body or group it is of; empty of another law."""
    body, group = body_of_effect(law), group_of_effect(law)
    if group:
        return f"{STAGE}/{group}/{BY_TORQUE}+{BY_RADIAL_LOAD}"
    return f"{_MODEL}/{body}" if body else ""


def carrier_class_answer(
    model: CarrierModel, classes: CarrierTable, candidates: Effects
) -> ClassAnswer:
    """Class of the missing effect."""
    by_run = tuple(name for name in candidates if model.effects[name].per_run)
    scores = ClassScores(classes.table, _CONSTANTS)
    shares = Shares(scores.of(()).squares, classes.table.floor, _CONSTANTS)
    errors = {name: DERIVATIVE_STD for name in classes.sizes if shape_of(name) == _MODEL}
    rule = ClassesByShape(scores, shares, classes.sizes, chooses_anew=True, errors=errors)
    decision = rule.decision()
    is_open = any(way_of(name) == UNDETERMINED for name in classes.sizes)
    notes = [_TORQUES_NOTE] if is_open else []
    if not any(model.effects[name].per_run for name in model.contained):
        notes.append(_OFFSET_NOTE)
    if decision.state != NOTHING:
        decision = replace(decision, note="; ".join(notes))
    answer = answer_of(
        scores,
        shares,
        decision,
        rule.rivals(decision),
        shape_of=lambda name, squares, law: (
            None,
            law_of_carrier_class(scores, name, squares, classes.visited),
        ),
        simulated=candidates,
    )
    # Laws with values by run say nothing of a condition that is held out.
    holding = {
        law: (_class_id(*_LAWS[law], has_torques=True),) if law in _LAWS else () for law in by_run
    }
    classes_of_law = {**answer.classes_of_law, **holding}
    laws = answer.law_sets
    # They are no columns of the table: each is fitted alone and beside others, unless the table has
    # their class and the answer does not (it has none of offsets that a baseline lacks).
    shown = {name for names in (decision.classes, *decision.ties) for name in names}
    absent = classes.sizes.keys() - shown
    tried = [law for law in by_run if not absent.intersection(holding[law])]
    with_values = [tuple(sorted((*others, law))) for law in tried for others in ((), *laws[:1])]
    # What a tolerance allows no product knows: every cause of a body is fitted within its own.
    of_model = [law for law in candidates if _model_class(law) in shown]
    classes_of_law = _classes_of_laws(classes_of_law, has_torques=not is_open)
    return replace(
        answer,
        classes_of_law=classes_of_law,
        same_scores=True,
        law_sets=(*laws, *with_values),
        causes=_with_each(laws[:1], of_model),
        alike=_alike(classes_of_law, candidates),
    )


def _alike(classes_of_law: Mapping[str, Sequence[str]], candidates: Effects) -> tuple[Effects, ...]:
    """Laws of each class of which the records cannot say what it follows."""
    groups: dict[str, list[str]] = {}
    for law, (first, *_) in classes_of_law.items():
        if law in candidates and way_of(first) == UNDETERMINED:
            groups.setdefault(first, []).append(law)
    return tuple(map(tuple, groups.values()))


def _with_each(nearest: Sequence[Effects], causes: Sequence[str]) -> tuple[Effects, ...]:
    """Every cause of a body, alone and in the nearest set of laws in the place of its own."""
    others = [law for laws in nearest for law in laws if not _model_class(law)]
    sets = [(cause,) for cause in causes]
    return tuple(dict.fromkeys((*sets, *(tuple(sorted((*others, cause))) for cause in causes))))


def _class_id(shape: str, dependences: Sequence[str], *, has_torques: bool) -> str:
    """Class of a shape that follows some loads, undetermined where the torques are too few."""
    if not has_torques:
        return f"{shape}/{UNDETERMINED}"
    words = [BY_TORQUE, BY_RADIAL_LOAD] if BY_BOTH in dependences else list(dependences)
    return f"{shape}/{'+'.join(words)}"


def _classes_of_laws(
    classes_of_law: Mapping[str, Sequence[str]], *, has_torques: bool
) -> dict[str, tuple[str, ...]]:
    """Classes that hold each law, first the one that follows the loads as the law does."""
    ordered = {}
    for law, classes in classes_of_law.items():
        first = _model_class(law)
        if law in _LAWS:
            shape, follows = _LAWS[law]
            is_sensor = shape == OFFSET or law in _SENSOR_EFFECTS
            first = _class_id(shape, follows, has_torques=has_torques or is_sensor)
        ordered[law] = tuple(sorted(classes, key=lambda name: name != first))
    return ordered
