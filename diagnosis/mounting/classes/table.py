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
from carrierflex.diagnosis.classes.gram_table import GramTable, IntArray
from carrierflex.diagnosis.classes.held_out import ClassScores
from carrierflex.diagnosis.comparison.problem import BoolArray, FloatArray
from carrierflex.diagnosis.mounting.classes.assembly import Layout, assembled, class_sizes
from carrierflex.diagnosis.mounting.classes.catalogue import (
    DELAY,
    FULL,
    GAIN,
    LOAD_WAYS,
    LOADS,
    STIFFNESS,
    UNEQUAL,
    ZERO,
)
from carrierflex.diagnosis.mounting.classes.delays import nearest_delays
from carrierflex.diagnosis.mounting.classes.forces import (
    BushingSize,
    ForceGroup,
    bushing_size,
    force_groups,
)
from carrierflex.diagnosis.mounting.classes.laws import law_signals
from carrierflex.diagnosis.mounting.classes.maps import (
    axial_column,
    bearing_column,
    delay_columns,
    full_stiffness,
    gain_channels,
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
    model : MountingModel
        Baseline and library.
    reach : float
        Deflection in y or z beyond which samples do not count.
    scores : ClassScores
        Held-out squares, each made once.
    sizes : mapping of str to int
        Columns of each class.
    """

    table: GramTable
    body: RigidBody
    size: BushingSize
    motions: tuple[BushingMotion, ...]
    model: MountingModel
    reach: float
    scores: ClassScores
    sizes: Mapping[str, int]

    def counted(self, bushings: Sequence[int]) -> tuple[FloatArray, FloatArray]:
        """Deflection and speed of some bushings where samples count.

        Parameters
        ----------
        bushings : sequence of int
            0 starboard, 1 port.

        Returns
        -------
        tuple of ndarray, shape (2, n)
            In y and in z, [m] and [m/s].
        """
        u, v = [], []
        for own in self.motions:
            chosen = _counting(own, self.reach)
            u += [own.u[bushing][:, chosen] for bushing in bushings]
            v += [own.v[bushing][:, chosen] for bushing in bushings]
        return np.concatenate(u, axis=1), np.concatenate(v, axis=1)


@dataclass(frozen=True, eq=False)
class _Columns:
    """What the columns of every run are.

    Parameters
    ----------
    model : MountingModel
        Baseline and library.
    body : RigidBody
        Housing on the fitted linear bushings.
    size : BushingSize
        Sizes and splines.
    groups : sequence of ForceGroup
        Forces of the bushings.
    delays : mapping of str to float
        Delay of every way.
    load_ways, laws : sequence of str
        Ways of the map of the loads, laws of the library.
    with_gain : sequence of int
        Channels whose gain may be wrong.
    """

    model: MountingModel
    body: RigidBody
    size: BushingSize
    groups: Sequence[ForceGroup]
    delays: Mapping[str, float]
    load_ways: Sequence[str]
    laws: Sequence[str]
    with_gain: Sequence[int]


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
    turn, weights = _channel_space(body, records, motions)
    has_gain = tells_load_gain(body, motions)
    groups = force_groups(size)
    columns = _Columns(
        model,
        body,
        size,
        groups,
        nearest_delays(body, motions, groups, (turn * weights)[:N_FREE], constants),
        [way for way in LOAD_WAYS if has_gain or way != "gain"],
        tuple(model.cards),
        gain_channels(motions),
    )
    limit = _visited(motions, constants.n_folds)
    grams = []
    floors = []
    folds = []
    layout = Layout({}, {})
    for number, own in enumerate(motions):
        rows, layout = _rows(columns, own, turn * weights)
        counts = _counting(own, limit)
        block = _block_of_grid(own)
        noise = float(np.sum((own.record.noise + own.record.zero_noise) * weights**2))
        for b in range(own.record.n_blocks):
            chosen = counts & (block == b)
            if not chosen.any():
                continue
            grams.append(_products(rows, _places(chosen)))
            floors.append(noise * int(chosen.sum()))
            folds.append((b + number) % constants.n_folds)
    if len(grams) < constants.fewest_blocks:
        return None
    table = assembled(model, np.array(grams), np.array(floors), np.array(folds), layout)
    scores = ClassScores(table, constants)
    return MountingTable(table, body, size, motions, model, limit, scores, class_sizes(table))


def _counting(own: BushingMotion, reach: float) -> BoolArray:
    """Samples that count: all channels measured, no bushing farther than two folds visit."""
    return np.asarray(np.isfinite(own.gap).all(axis=0) & (np.abs(own.u).max(axis=(0, 1)) <= reach))


def _places(chosen: BoolArray) -> slice | IntArray:
    """Samples that are chosen; as a slice where they follow one another, which copies nothing."""
    places = np.flatnonzero(chosen)
    first, last = int(places[0]), int(places[-1])
    return slice(first, last + 1) if places.size == last + 1 - first else places


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


def _products(rows: Sequence[FloatArray], places: slice | IntArray) -> FloatArray:
    """Products of rows of rotated channels over some samples, shape (n_rows, n_rows).

    Forces on the housing show in the first channels alone.
    """
    free, held = (
        np.concatenate([own[:, channels, places] for own in rows])
        for channels in (slice(N_FREE), slice(N_FREE, None))
    )
    free = free.reshape(len(free), -1)
    gram = free @ free.T
    held = held.reshape(len(held), -1)
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


def _base_rows(body: RigidBody, own: BushingMotion) -> FloatArray:
    """What stiffer and more damped bushings add, shape (2, n_channels, n)."""
    return signals_of(body, own, body.on_coordinates(np.array([own.u, own.v])))


def _rows(
    columns: _Columns, own: BushingMotion, rotation: FloatArray
) -> tuple[list[FloatArray], Layout]:
    """Target, baseline, groups and laws along a run in rotated channels.

    Each shape (n_rows, n_channels, n): together they would be the largest array of a diagnosis.
    """
    model, body = columns.model, columns.body
    n_base = 0 if model.held else 2
    rows = [rotation @ np.nan_to_num(own.gap)[None], rotation @ _base_rows(body, own)[:n_base]]
    first = 1 + n_base
    layout = Layout({}, {})

    def put(name: str, values: FloatArray, penalty: FloatArray, *, positive: bool) -> None:
        nonlocal first
        rows.append(rotation @ values)
        layout.groups[name] = (slice(first, first + len(values)), penalty, positive)
        first += len(values)

    for group in columns.groups:
        forces = group.columns(own)
        same = _of_sides(body, own, forces)
        put(group.id, same[0] + same[1], group.penalty, positive=group.is_nonnegative)
        for name, side in zip(("starboard", "port"), same, strict=True):
            put(f"{group.id}:{name}", side, group.penalty, positive=group.is_nonnegative)
    for name, values in _map_columns(columns, own).items():
        put(name, values, np.eye(len(values)), positive=False)
    for law in columns.laws:
        values = law_signals(body, model, columns.size, own, law)
        n_shapes, n_columns = values.shape[:2]
        rows.append(rotation @ values.reshape(-1, *values.shape[2:]))
        places = first + np.arange(n_shapes * n_columns).reshape(n_shapes, n_columns)
        layout.laws[law] = tuple(places)
        first += n_shapes * n_columns
    return rows, layout


def _of_sides(body: RigidBody, own: BushingMotion, forces: FloatArray) -> list[FloatArray]:
    """Signals of the forces of the starboard and of the port bushing."""
    found = []
    for side in range(2):
        found.append(signals_of(body, own, body.of_side(forces[:, side], side)))
    return found


def _map_columns(columns: _Columns, own: BushingMotion) -> dict[str, FloatArray]:
    """Columns of the maps by group."""
    body = columns.body
    found = {
        f"{STIFFNESS}:axial": axial_column(body, own),
        f"{STIFFNESS}:main_bearing": bearing_column(body, own),
        f"{STIFFNESS}:{UNEQUAL}": unequal_column(body, own),
        f"{STIFFNESS}:{FULL}": full_stiffness(body, own),
    }
    for way in columns.load_ways:
        found[f"{LOADS}:{way}"] = load_columns(body, own, way)
    for way, delay in columns.delays.items():
        found[f"{DELAY}:{way}"] = delay_columns(body, own, way, [delay])
    for k, channel in enumerate(columns.model.channels):
        if k in columns.with_gain:
            found[f"{GAIN}:{channel}"] = gain_column(own, k)
        found[f"{ZERO}:{channel}"] = zero_column(own, k)
    return found
