"""Table of products for the classes of a mounting: gap, baseline, classes and laws by block.

The gap of the linear bushings, in the channels, is what forces that they lack make of the housing:
``s = H (G F - dK B q - dC B v + p) + (what sensors add)``, with q and v as measured. This is the
balance of generalised forces, each weighted by the compliance of its motion: the weight at which
noise of the sensors is white.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from carrierflex.diagnosis.classes.constants import ClassConstants
from carrierflex.diagnosis.classes.gram_table import ColumnGroup, GramTable, IntArray, LawColumns
from carrierflex.diagnosis.classes.held_out import ClassScores
from carrierflex.diagnosis.classes.shape_decision import shape_of
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.mounting.cards import NEGATIVE_CONTROLS
from carrierflex.diagnosis.mounting.classes.catalogue import (
    DELAY,
    DELAY_WAYS,
    EACH,
    FORCE_GROUPS,
    FULL,
    GAIN,
    LOAD_WAYS,
    LOADS,
    SHAPE_OF_LAW,
    SHAPES_OF_USER,
    STIFFNESS,
    ZERO,
    class_groups,
)
from carrierflex.diagnosis.mounting.classes.forces import (
    BushingSize,
    ForceGroup,
    bushing_size,
    force_groups,
)
from carrierflex.diagnosis.mounting.classes.laws import law_signals
from carrierflex.diagnosis.mounting.classes.maps import (
    DELAYS,
    axial_column,
    bearing_column,
    delay_column,
    full_stiffness,
    gain_column,
    load_columns,
    signals_of,
    tells_load_gain,
    unequal_column,
    zero_column,
)
from carrierflex.diagnosis.mounting.classes.motion import BushingMotion, bushing_motions
from carrierflex.diagnosis.mounting.classes.rigid_body import N_FREE, RigidBody, rigid_body
from carrierflex.diagnosis.mounting.model import MountingModel
from carrierflex.diagnosis.mounting.records import MountingRecord

#: Folds that a deflection must be visited by for its samples to count.
_VISITED = 2
_CONTROLS = tuple(card.id for card in NEGATIVE_CONTROLS)
#: Noise of a channel is never taken as less than this share of its signal: a rounding.
_LEAST_NOISE = 1e-9
#: Squares of a row below this share are rounding of the rotation.
_ROUNDING = 1e-20


@dataclass(frozen=True, eq=False)
class MountingTable:
    """Gram table with what its columns are.

    Parameters
    ----------
    table : GramTable
        Products.
    body : RigidBody
        Housing on the fitted linear bushings.
    size : BushingSize
        Sizes and splines.
    motions : tuple of BushingMotion
        Runs.
    scores : ClassScores
        Held-out squares, each made once.
    sizes : mapping of str to int
        Columns of each class.
    """

    table: GramTable
    body: RigidBody
    size: BushingSize
    motions: tuple[BushingMotion, ...]
    scores: ClassScores
    sizes: Mapping[str, int]


@dataclass(frozen=True, eq=False)
class _Layout:
    """Rows of the table: target and baseline, groups, laws.

    Parameters
    ----------
    groups : mapping of str to tuple
        Place, penalty and sign of each group.
    laws : mapping of str to tuple of ndarray
        Places of the columns of each shape of a law.
    """

    groups: dict[str, tuple[slice, FloatArray, bool]]
    laws: dict[str, tuple[IntArray, ...]]


def mounting_table(
    model: MountingModel,
    records: Sequence[MountingRecord],
    linear: FloatArray,
    constants: ClassConstants,
) -> MountingTable | None:
    """Table of all classes and laws.

    Parameters
    ----------
    model : MountingModel
        Baseline and library.
    records : sequence of MountingRecord
        Runs.
    linear : ndarray, shape (2,)
        K1 and C1 of the linear bushings that fit the records best.
    constants : ClassConstants
        Number of folds.

    Returns
    -------
    MountingTable or None
        None where the channels do not show the motion, or the blocks are too few.
    """
    body = rigid_body(model.rig, model.sensors, float(linear[0]), float(linear[1]))
    n_blocks = sum(record.n_blocks for record in records)
    if not body.shows_motion or n_blocks < constants.fewest_blocks:
        return None
    bare = replace(model, contained=())
    predicted = [bare.predicted(record, (), linear, {}) for record in records]
    motions = bushing_motions(body, records, predicted)
    size = bushing_size(motions)
    if not size.deflection > 0.0:
        return None
    groups = force_groups(size, motions)
    turn, weights = _channel_space(body, records, motions)
    delays = {way: _nearest_delay(body, motions, way, weights) for way in DELAY_WAYS}
    laws = [name for name in model.cards if name not in _CONTROLS]
    has_gain = tells_load_gain(body, motions)
    load_ways = [way for way in LOAD_WAYS if has_gain or way != "gain"]
    limit = _visited(motions, constants.n_folds)
    grams, floors, folds = [], [], []
    layout = None
    for number, own in enumerate(motions):
        rows, layout = _rows(model, body, size, own, groups, delays, load_ways, laws)
        weighted = (turn * weights) @ rows
        counts = np.isfinite(own.gap).all(axis=0) & (np.abs(own.u).max(axis=(0, 1)) <= limit)
        block = _block_of_grid(own)
        noise = float(np.sum((own.record.noise + own.record.zero_noise) * weights**2))
        for b in range(own.record.n_blocks):
            chosen = counts & (block == b)
            if not chosen.any():
                continue
            grams.append(_products(weighted[:, :, chosen]))
            floors.append(noise * int(chosen.sum()))
            folds.append((b + number) % constants.n_folds)
    assert layout is not None
    table = _assembled(model, np.array(grams), np.array(floors), np.array(folds), layout)
    return MountingTable(table, body, size, motions, ClassScores(table, constants), _sizes(table))


def _block_of_grid(own: BushingMotion) -> IntArray:
    """Block of every sample of the even grid."""
    inputs = own.record.inputs
    if inputs.uniform:
        return own.record.block
    places = np.clip(np.searchsorted(inputs.time, inputs.grid), 0, inputs.time.size - 1)
    return np.asarray(own.record.block[places])


def _channel_space(
    body: RigidBody, records: Sequence[MountingRecord], motions: Sequence[BushingMotion]
) -> tuple[FloatArray, FloatArray]:
    """Rotation of the channels over their noise, and one over the noise of each.

    The first three of the rotated channels see all motions that the bushings leave free.
    """
    noise = np.mean([record.noise for record in records], axis=0)
    signal = np.mean([np.square(own.signals).mean(axis=1) for own in motions], axis=0)
    least = np.maximum(_LEAST_NOISE**2 * signal.max(), 1e-300)
    weights = 1.0 / np.sqrt(np.maximum(noise, least))
    turn, _ = np.linalg.qr(weights[:, None] * body.free_output, mode="complete")
    return turn.T, weights


def _products(rows: FloatArray) -> FloatArray:
    """Products of rows of rotated channels, shape (n_rows, n_rows).

    Forces on the housing show in the first channels alone.
    """
    free = rows[:, :N_FREE].reshape(len(rows), -1)
    gram = free @ free.T
    held = rows[:, N_FREE:].reshape(len(rows), -1)
    is_wide = np.square(held).sum(axis=1) > _ROUNDING * np.diag(gram)
    wide = np.flatnonzero(is_wide)
    gram[np.ix_(wide, wide)] += held[wide] @ held[wide].T
    return np.asarray(gram)


def _visited(motions: Sequence[BushingMotion], n_folds: int) -> float:
    """Deflection that the blocks of two folds reach: beyond it all scores extrapolate."""
    largest = np.zeros(n_folds)
    for number, own in enumerate(motions):
        fold = (_block_of_grid(own) + number) % n_folds
        deflection = np.abs(own.u).max(axis=(0, 1))
        for f in range(n_folds):
            largest[f] = max(largest[f], deflection[fold == f].max(initial=0.0))
    return float(np.sort(largest)[-_VISITED])


def _nearest_delay(
    body: RigidBody, motions: Sequence[BushingMotion], way: str, weights: FloatArray
) -> float:
    """Delay that explains most of the gap beside stiffness and damping."""
    candidates = np.concatenate([DELAYS, -DELAYS])
    best = (-1.0, float(DELAYS[0]))
    gap = np.concatenate([(np.nan_to_num(own.gap) * weights[:, None]).ravel() for own in motions])
    base = np.concatenate(
        [(_base_rows(body, own) * weights[:, None]).reshape(2, -1) for own in motions],
        axis=1,
    )
    inverse = np.linalg.pinv(base @ base.T)
    gap = gap - (gap @ base.T) @ inverse @ base
    for delay in candidates.tolist():
        column = np.concatenate(
            [(delay_column(body, own, way, delay)[0] * weights[:, None]).ravel() for own in motions]
        )
        column = column - (column @ base.T) @ inverse @ base
        square = float(column @ column)
        taken = float(column @ gap) ** 2 / square if square > 0.0 else 0.0
        if taken > best[0]:
            best = (taken, delay)
    return best[1]


def _base_rows(body: RigidBody, own: BushingMotion) -> FloatArray:
    """What stiffer and more damped bushings add, shape (2, n_channels, n)."""
    return signals_of(body, own, body.on_coordinates(np.array([own.u, own.v])))


def _rows(
    model: MountingModel,
    body: RigidBody,
    size: BushingSize,
    own: BushingMotion,
    groups: Sequence[ForceGroup],
    delays: Mapping[str, float],
    load_ways: Sequence[str],
    laws: Sequence[str],
) -> tuple[FloatArray, _Layout]:
    """Target, baseline, groups and laws along a run, shape (n_rows, n_channels, n)."""
    n_base = 0 if model.held else 2
    rows = [np.nan_to_num(own.gap)[None], _base_rows(body, own)[:n_base]]
    first = 1 + n_base
    layout = _Layout({}, {})

    def put(name: str, values: FloatArray, penalty: FloatArray, *, positive: bool) -> None:
        nonlocal first
        rows.append(values)
        layout.groups[name] = (slice(first, first + len(values)), penalty, positive)
        first += len(values)

    for group in groups:
        forces = group.columns(own)
        straight = group.straight(own)
        same = _of_sides(body, own, forces)
        put(group.id, same[0] + same[1], group.penalty, positive=group.is_nonnegative)
        each = same if straight is None else _of_sides(body, own, forces - straight)
        for name, side in zip(("starboard", "port"), each, strict=True):
            put(f"{group.id}:{name}", side, group.penalty, positive=group.is_nonnegative)
    for name, values in _map_columns(model, body, own, delays, load_ways).items():
        put(name, values, np.eye(len(values)), positive=False)
    for law in laws:
        values = law_signals(body, model, size, own, law)
        n_shapes, n_columns = values.shape[:2]
        rows.append(values.reshape(-1, *values.shape[2:]))
        places = first + np.arange(n_shapes * n_columns).reshape(n_shapes, n_columns)
        layout.laws[law] = tuple(places)
        first += n_shapes * n_columns
    return np.concatenate(rows), layout


def _of_sides(body: RigidBody, own: BushingMotion, forces: FloatArray) -> list[FloatArray]:
    """Signals of the forces of the starboard and of the port bushing."""
    found = []
    for side in range(2):
        alone = np.zeros_like(forces)
        alone[:, side] = forces[:, side]
        found.append(signals_of(body, own, body.on_coordinates(alone)))
    return found


def _map_columns(
    model: MountingModel,
    body: RigidBody,
    own: BushingMotion,
    delays: Mapping[str, float],
    load_ways: Sequence[str],
) -> dict[str, FloatArray]:
    """Columns of the maps by group."""
    found = {
        f"{STIFFNESS}:axial": axial_column(body, own),
        f"{STIFFNESS}:main_bearing": bearing_column(body, own),
        f"{STIFFNESS}:unequal": unequal_column(body, own),
        f"{STIFFNESS}:{FULL}": full_stiffness(body, own),
    }
    for way in load_ways:
        found[f"{LOADS}:{way}"] = load_columns(body, own, way)
    for way, delay in delays.items():
        found[f"{DELAY}:{way}"] = delay_column(body, own, way, delay)
    for k, channel in enumerate(model.channels):
        found[f"{GAIN}:{channel}"] = gain_column(own, k)
        found[f"{ZERO}:{channel}"] = zero_column(own, k)
    return found


def _assembled(
    model: MountingModel, gram: FloatArray, floor: FloatArray, folds: IntArray, layout: _Layout
) -> GramTable:
    """Table of unit energies, each group scaled as one; contained laws join the baseline."""
    n_base = 0 if model.held else 2
    gram, layout, n_base = _with_contained(model, gram, layout, n_base)
    energy = np.diag(gram.sum(axis=0)).copy()
    for name, (place, _, _) in layout.groups.items():
        if not name.startswith((STIFFNESS, LOADS)):
            energy[place] = energy[place].mean()
    scale = 1.0 / np.sqrt(np.where(energy > 0.0, energy, 1.0))
    groups = {
        name: ColumnGroup(np.arange(place.start, place.stop), penalty, positive)
        for name, (place, penalty, positive) in layout.groups.items()
    }
    classes = {
        name: own
        for name, own in class_groups(model.channels, model.contained).items()
        if set(own) <= set(groups)
    }
    laws = {
        name: tuple(
            LawColumns(law, places, len(model.cards[law].parameters))
            for law, places in layout.laws.items()
            if law not in model.contained and shape_of(name) in shapes_of_law(law)
        )
        for name in classes
    }
    every = [*(group for own in FORCE_GROUPS.values() for group in own)]
    every += [f"{STIFFNESS}:{FULL}", f"{LOADS}:{FULL}", f"{DELAY}:all"]
    every += [f"{shape}:{channel}" for shape in (GAIN, ZERO) for channel in model.channels]
    return GramTable(
        gram=gram * np.outer(scale, scale),
        n_base=n_base,
        groups=groups,
        classes=classes,
        surface="",
        ceiling=tuple(every),
        laws=laws,
        floor=floor * scale[0] ** 2,
        folds=folds,
        scale=scale,
    )


def shapes_of_law(law: str) -> tuple[str, ...]:
    """Shapes that hold a law; of a user's law those of any force of deflection and speed."""
    return (SHAPE_OF_LAW[law],) if law in SHAPE_OF_LAW else SHAPES_OF_USER


def _with_contained(
    model: MountingModel, gram: FloatArray, layout: _Layout, n_base: int
) -> tuple[FloatArray, _Layout, int]:
    """Table whose baseline holds the contained laws, each at the shape that fits best beside it."""
    base = list(range(1, 1 + n_base))
    total = gram.sum(axis=0)
    for law in model.contained:
        variants = layout.laws.get(law, ())
        if not variants:
            continue
        left = [_left(total, [*base, *own.tolist()]) for own in variants]
        base += variants[int(np.argmin(left))].tolist()
    added = base[n_base:]
    if not added:
        return gram, layout, n_base
    rest = np.arange(1 + n_base, len(total))
    order = np.concatenate([[0], base, rest]).astype(int)
    shift = len(added)
    groups = {
        name: (slice(place.start + shift, place.stop + shift), penalty, positive)
        for name, (place, penalty, positive) in layout.groups.items()
    }
    laws = {law: tuple(own + shift for own in places) for law, places in layout.laws.items()}
    return gram[:, order[:, None], order[None]], _Layout(groups, laws), n_base + shift


def _left(total: FloatArray, places: list[int]) -> float:
    """Square that some columns leave of the target."""
    A, b = total[np.ix_(places, places)], total[places, 0]
    return float(total[0, 0] - b @ np.linalg.pinv(A, hermitian=True) @ b)


def _sizes(table: GramTable) -> dict[str, int]:
    """Columns of each class."""
    return {
        name: sum(table.groups[group].columns.size for group in own)
        for name, own in table.classes.items()
    }


__all__ = ["EACH", "MountingTable", "mounting_table", "shapes_of_law"]
