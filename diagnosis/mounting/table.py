"""Table of products for the classes of a mounting: gap, baseline, classes and laws by block.

The gap of the linear bushings, in the channels, is what forces that they lack make of the housing:
``s = H (G F - dK B q - dC B v + p) + (what sensors add)``, with q and v as measured. This is the
balance of generalised forces, each weighted by the compliance of its motion: the weight at which
noise of the sensors is white.
"""

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from carrierflex.diagnosis.classes.constants import ClassConstants
from carrierflex.diagnosis.classes.decision import FURTHER_CAUSE, shape_of
from carrierflex.diagnosis.classes.gram_table import GramTable, IntArray, LawColumns, TableRows
from carrierflex.diagnosis.classes.held_out import ClassScores, HeldOutSquares
from carrierflex.diagnosis.classes.shares import Shares
from carrierflex.diagnosis.comparison.problem import BoolArray, FloatArray
from carrierflex.diagnosis.mounting.columns import (
    DELAYS,
    BushingSize,
    ForceGroup,
    axial_column,
    bearing_column,
    bushing_size,
    channel_column,
    delay_columns,
    force_groups,
    full_stiffness,
    gain_channels,
    law_signals,
    load_columns,
    shows_load_gain,
    unequal_column,
)
from carrierflex.diagnosis.mounting.model import MountingModel
from carrierflex.diagnosis.mounting.motion import N_FREE, BushingMotion, bushing_motions
from carrierflex.diagnosis.mounting.records import MountingRecord
from carrierflex.identification.estimation.scaled_least_squares import DEPENDENT

#: Place of the forces that follow.
BUSHINGS = "bushings"
FORCE = "bushings/restoring_force"
DISSIPATION = "bushings/dissipation"
HYSTERESIS = "bushings/hysteresis"
MEMORY = "bushings/memory"
COUPLED = "bushings/coupled_damping"
CHANGE = "bushings/time_variation"
STIFFNESS = "housing/stiffness"
LOADS = "loads/map"
GAIN = "sensors/gain"
ZERO = "sensors/zero"
DELAY = "clock/delay"

SAME = "same"
EACH = "each"
FULL = "full"
#: One bushing stiffer than the other.
UNEQUAL = "unequal"
#: Groups of columns of each force, for both bushings alike; one each has them twice.
FORCE_GROUPS: Mapping[str, tuple[str, ...]] = {
    FORCE: ("f", "radial_f"),
    DISSIPATION: ("g", "radial_g"),
    HYSTERESIS: ("stops", "radial_stops", "smooth_stops"),
    MEMORY: ("prony",),
    COUPLED: ("h", "radial_h"),
    CHANGE: ("time",),
}
#: Ways of the maps, the sparse ones first.
STIFFNESS_WAYS = ("axial", "main_bearing", UNEQUAL, FULL)
LOAD_WAYS = ("torque_from_load", "direction", "gain", FULL)
DELAY_WAYS = ("all", "torque", "radial_load")
#: Maps from loads to signals: one class where slow loads act in one direction.
LINEAR_MAPS = (STIFFNESS, LOADS, GAIN)

#: Shape of each law of the library.
SHAPE_OF_LAW: Mapping[str, str] = {
    "cubic_stiffness": FORCE,
    "quintic_stiffness": FORCE,
    "deflection_dependent_damping": COUPLED,
    "fluid_branch": MEMORY,
    "elasto_plastic_friction": HYSTERESIS,
    "parasitic_torque": LOADS,
    "ntl_direction": LOADS,
    "axial_bushing_stiffness": STIFFNESS,
    "main_bearing_compliance": STIFFNESS,
    "unequal_bushings": STIFFNESS,
    "sensor_gain": GAIN,
    "sensor_zero": ZERO,
    "sensor_delay": DELAY,
}
#: Shapes that hold a user's law: a force of deflection and speed in both bushings.
SHAPES_OF_USER = (FORCE, DISSIPATION, COUPLED)
#: Share of the floor that is added to what a class leaves: errors of the sensors' gains, which
#: every rig has, leave up to a third of the floor's amplitude, and a map of many columns learns
#: them.
_FLOOR_ERROR = 0.15
#: Folds that a deflection must be visited by for its samples to count.
_VISITED = 2
#: Noise of a channel is never taken as less than this share of its signal: a rounding.
_LEAST_NOISE = 1e-9
#: Squares of a row below this share are rounding of the rotation.
_ROUNDING = 1e-20


def _class_groups(model: MountingModel, known: Container[str]) -> dict[str, tuple[str, ...]]:
    """Groups of columns of every class, the simplest way of a shape first."""
    classes: dict[str, tuple[str, ...]] = {}
    for shape, groups in FORCE_GROUPS.items():
        classes[f"{shape}/{SAME}"] = groups
        classes[f"{shape}/{EACH}"] = tuple(
            f"{group}:{side}" for group in groups for side in ("starboard", "port")
        )
    for shape, ways in ((STIFFNESS, STIFFNESS_WAYS), (LOADS, LOAD_WAYS), (DELAY, DELAY_WAYS)):
        for way in ways:
            if f"{shape}:{way}" in known:
                classes[f"{shape}/{way}"] = (f"{shape}:{way}",)
    for shape in (GAIN, ZERO):
        of_channels = {
            channel: f"{shape}:{channel}"
            for channel in model.channels
            if f"{shape}:{channel}" in known
        }
        classes |= {f"{shape}/{channel}": (group,) for channel, group in of_channels.items()}
        if of_channels:
            classes[f"{shape}/{EACH}"] = tuple(of_channels.values())
    taken = {SHAPE_OF_LAW.get(law) for law in model.contained} & {ZERO, DELAY}
    return {name: of for name, of in classes.items() if shape_of(name) not in taken}


@dataclass(frozen=True, eq=False)
class MountingTable:
    """Gram table with what its columns are."""

    table: GramTable  # Products
    size: BushingSize  # Sizes and splines
    motions: tuple[BushingMotion, ...]  # Runs
    model: MountingModel  # Baseline and library
    reach: float  # Deflection in y or z beyond which samples do not count
    scores: ClassScores  # Held-out squares, each made once

    def counted(self, bushings: Sequence[int]) -> tuple[FloatArray, FloatArray]:
        """Deflection and speed in y and z, (2, n), where samples count; 0 is starboard, 1 port."""
        counts = [_counting(run, self.reach) for run in self.motions]
        u, v = (
            np.concatenate(
                [
                    getattr(run, name)[bushing][:, chosen]
                    for run, chosen in zip(self.motions, counts, strict=True)
                    for bushing in bushings
                ],
                axis=1,
            )
            for name in "uv"
        )
        return u, v


def mounting_table(
    model: MountingModel, records: Sequence[MountingRecord], linear: FloatArray
) -> MountingTable | None:
    """Table of all classes and laws beside linear bushings of K1 and C1."""
    constants = ClassConstants(floor_error=_FLOOR_ERROR, second_cause=FURTHER_CAUSE)
    motions = bushing_motions(model, records, linear)
    n_blocks = sum(record.n_blocks for record in records)
    if not motions or n_blocks < constants.fewest_blocks:
        return None
    size = bushing_size(motions)
    if not size.deflection > 0.0:
        return None
    turn, weights = _channel_space(records, motions)
    groups = force_groups(size)
    delays = _nearest_delays(motions, groups, (turn * weights)[:N_FREE], constants)
    columns = _Columns(
        model, size, groups, delays, shows_load_gain(motions), gain_channels(motions)
    )
    limit = _visited(motions, constants.n_folds)
    grams = []
    floors = []
    folds = []
    for number, run in enumerate(motions):
        rows = columns.along(run, turn * weights)
        counts = _counting(run, limit)
        block = run.block
        noise = float(np.sum((run.record.noise + run.record.zero_noise) * weights**2))
        for b in range(run.record.n_blocks):
            chosen = counts & (block == b)
            if not chosen.any():
                continue
            grams.append(_products(rows.rows, np.flatnonzero(chosen)))
            floors.append(noise * int(chosen.sum()))
            folds.append((b + number) % constants.n_folds)
    if len(grams) < constants.fewest_blocks:
        return None
    table = _assembled(model, np.array(grams), np.array(floors), np.array(folds), rows)
    scores = ClassScores(table, constants)
    return MountingTable(table, size, motions, model, limit, scores)


def _counting(run: BushingMotion, reach: float) -> BoolArray:
    """Samples that count: all channels measured, no bushing farther than two folds visit."""
    return np.asarray(np.isfinite(run.gap).all(axis=0) & (np.abs(run.u).max(axis=(0, 1)) <= reach))


def _channel_space(
    records: Sequence[MountingRecord], motions: Sequence[BushingMotion]
) -> tuple[FloatArray, FloatArray]:
    """Rotation of the channels over their noise, and one over the noise of each."""
    noise = np.mean([record.noise for record in records], axis=0)
    signal = np.mean([np.square(run.signals).mean(axis=1) for run in motions], axis=0)
    least = np.maximum(_LEAST_NOISE**2 * signal.max(), 1e-300)
    weights = 1.0 / np.sqrt(np.maximum(noise, least))
    turn, _ = np.linalg.qr(weights[:, None] * motions[0].body.free_output, mode="complete")
    return turn.T, weights


def _products(rows: Sequence[FloatArray], samples: IntArray) -> FloatArray:
    """Products of rows of rotated channels over some samples, shape (n_rows, n_rows)."""
    first, last = int(samples[0]), int(samples[-1])
    # A slice copies nothing.
    span = slice(first, last + 1) if samples.size == last + 1 - first else samples
    free, guided = (
        np.concatenate([columns[:, channels, span] for columns in rows])
        for channels in (slice(N_FREE), slice(N_FREE, None))
    )
    free = free.reshape(len(free), -1)
    gram = free @ free.T
    guided = guided.reshape(len(guided), -1)
    is_wide = np.square(guided).sum(axis=1) > _ROUNDING * np.diag(gram)
    wide = np.flatnonzero(is_wide)
    gram[np.ix_(wide, wide)] += guided[wide] @ guided[wide].T
    return np.asarray(gram)


def _visited(motions: Sequence[BushingMotion], n_folds: int) -> float:
    """Deflection that the blocks of two folds reach: beyond it all scores extrapolate."""
    largest = np.zeros(n_folds)
    for number, run in enumerate(motions):
        fold = (run.block + number) % n_folds
        deflection = np.abs(run.u).max(axis=(0, 1))
        for f in range(n_folds):
            largest[f] = max(largest[f], deflection[fold == f].max(initial=0.0))
    return float(np.sort(largest)[-_VISITED])


@dataclass(frozen=True, eq=False)
class _Columns:
    """What the columns of every run are."""

    model: MountingModel
    size: BushingSize
    groups: Sequence[ForceGroup]
    delays: Mapping[str, float]
    has_load_gain: bool
    with_gain: Sequence[int]

    def along(self, run: BushingMotion, rotation: FloatArray) -> TableRows:
        """Target, baseline, groups and laws along a run in rotated channels."""
        # What stiffer and more damped bushings add.
        base = run.signals_of_bushings(np.array([run.u, run.v]))
        base = base[: 0 if self.model.fixed else 2]
        table = TableRows(rotation @ np.nan_to_num(run.gap)[None], rotation @ base)
        for group in self.groups:
            forces = group.columns(run)
            starboard, port = (
                run.signals_of(-rows.T @ forces[:, side])
                for side, rows in enumerate(run.body.rows[:, :, :N_FREE])
            )
            for name, values in (
                (group.id, starboard + port),
                (f"{group.id}:starboard", starboard),
                (f"{group.id}:port", port),
            ):
                table.add_group(
                    name, rotation @ values, group.penalty, is_nonnegative=group.is_nonnegative
                )
        for name, values in self._maps(run).items():
            table.add_group(name, rotation @ values, np.eye(len(values)))
        for law in self.model.cards:
            table.add_law(law, rotation @ law_signals(self.model, self.size, run, law))
        return table

    def _maps(self, run: BushingMotion) -> dict[str, FloatArray]:
        """Columns of the maps by group."""
        maps = {
            f"{STIFFNESS}:axial": axial_column(run),
            f"{STIFFNESS}:main_bearing": bearing_column(run),
            f"{STIFFNESS}:{UNEQUAL}": unequal_column(run),
            f"{STIFFNESS}:{FULL}": full_stiffness(run),
        }
        for way in LOAD_WAYS:
            if self.has_load_gain or way != "gain":
                maps[f"{LOADS}:{way}"] = load_columns(run, way)
        for way, delay in self.delays.items():
            maps[f"{DELAY}:{way}"] = delay_columns(run, way, [delay])
        for k, channel in enumerate(self.model.channels):
            if k in self.with_gain:
                maps[f"{GAIN}:{channel}"] = channel_column(run, k, run.signals[k])
            maps[f"{ZERO}:{channel}"] = channel_column(run, k, 1.0)
        return maps


def _assembled(
    model: MountingModel, gram: FloatArray, floor: FloatArray, folds: IntArray, rows: TableRows
) -> GramTable:
    """Table of unit energies, each group scaled as one; contained laws join the baseline."""
    # Contained laws stand behind the baseline, each in the shape that leaves least.
    base = list(range(1, 1 + rows.n_base))
    total = gram.sum(axis=0)
    for law in model.contained:
        if law in rows.laws:
            variants = [[*base, *variant.tolist()] for variant in rows.laws[law]]
            base = min(variants, key=lambda columns: _remaining_square(total, columns))
    shift = len(base) - rows.n_base
    if shift:
        order = np.array([0, *base, *range(1 + rows.n_base, len(total))])
        gram = gram[:, order[:, None], order[None]]
    groups = {
        name: replace(group, columns=group.columns + shift) for name, group in rows.groups.items()
    }
    energy = np.diag(gram.sum(axis=0)).copy()
    for name, group in groups.items():
        if not name.startswith((STIFFNESS, LOADS)):
            energy[group.columns] = energy[group.columns].mean()
    scale = 1.0 / np.sqrt(np.where(energy > 0.0, energy, 1.0))
    classes = _class_groups(model, groups)
    of_user = dict.fromkeys(rows.laws, SHAPES_OF_USER)
    of_library = {law: (shape,) for law, shape in SHAPE_OF_LAW.items()}
    of_files = {name: (f"{BUSHINGS}/{law.effect_class}",) for name, law in model.measured.items()}
    shapes_of_law = of_user | of_library | of_files
    laws = {
        name: tuple(
            LawColumns(
                law,
                tuple(indices + shift for indices in variants),
                len(model.cards[law].parameters),
            )
            for law, variants in rows.laws.items()
            if law not in model.contained and shape_of(name) in shapes_of_law[law]
        )
        for name in classes
    }
    every = [group for members in FORCE_GROUPS.values() for group in members]
    every += [f"{STIFFNESS}:{FULL}", f"{LOADS}:{FULL}", f"{DELAY}:all"]
    every += [name for name in groups if name.startswith((f"{GAIN}:", f"{ZERO}:"))]
    return GramTable(
        gram=gram * np.outer(scale, scale),
        n_base=len(base),
        groups=groups,
        classes=classes,
        surface="",
        ceiling=tuple(every),
        laws=laws,
        floor=floor * scale[0] ** 2,
        folds=folds,
        scale=scale,
    )


def _remaining_square(total: FloatArray, columns: list[int]) -> float:
    """Square that some columns leave of the target."""
    A, b = total[np.ix_(columns, columns)], total[columns, 0]
    return float(total[0, 0] - b @ np.linalg.pinv(A, hermitian=True) @ b)


def _nearest_delays(
    motions: Sequence[BushingMotion],
    groups: Sequence[ForceGroup],
    channels: FloatArray,
    constants: ClassConstants,
) -> dict[str, float]:
    """Delay [s] of every way that leaves least of the gap, alone or beside one force.

    Beside a force where that takes half of what the best delay leaves alone: a force that does not
    is not missing, and a delay of another size may serve it.

    A delay that is sought beside stiffness and damping alone takes up what a force makes of them:
    beside a loop of the bushings, which holds the motion back, it gets the wrong size, and both
    together explain half of what they are. `channels`, shape (m, n_channels), are weights of the
    channels in m sums of unit noise that show every free motion.
    """
    numbers: Mapping[str, IntArray] = {}
    gram = np.zeros((0, 0))
    floor = 0.0
    for run in motions:
        rows, numbers = _delay_rows(run, groups, channels)
        products = rows @ rows.T
        gram = gram + products if gram.size else products
        floor += float(len(channels) * np.isfinite(run.gap).all(axis=0).sum())
    shares = Shares(gram[:1, 0], np.array([floor]), constants)
    sets = [(), *FORCE_GROUPS.values()]
    columns = [np.concatenate([numbers[name] for name in ("base", *run)]) for run in sets]
    delays = {}
    for way in DELAY_WAYS:
        alone, *with_forces = [_remaining_squares(gram, run, numbers[way]) for run in columns]
        best = min(with_forces, key=np.min)
        forced, bare = (HeldOutSquares(one.min(keepdims=True), (), ()) for one in (best, alone))
        is_missing = shares.is_clear_gain(forced, bare, 0.0)
        delays[way] = float(DELAYS[np.argmin(best if is_missing else alone)])
    return delays


def _delay_rows(
    run: BushingMotion, groups: Sequence[ForceGroup], channels: FloatArray
) -> tuple[FloatArray, Mapping[str, IntArray]]:
    """Gap, linear bushings, forces alike in both bushings and delays along a run; their places."""
    rows = {"base": run.signals_of_bushings(np.array([run.u, run.v]))}
    rows |= {group.id: run.signals_of_bushings(group.columns(run)) for group in groups}
    rows |= {way: delay_columns(run, way, DELAYS) for way in DELAY_WAYS}
    ends = 1 + np.cumsum([len(values) for values in rows.values()])
    numbers = dict(zip(rows, np.split(np.arange(1, ends[-1]), ends[:-1] - 1), strict=True))
    signals = [np.nan_to_num(run.gap)[None], *rows.values()]
    weighted = np.concatenate([channels @ values for values in signals])
    return weighted.reshape(len(weighted), -1), numbers


def _remaining_squares(gram: FloatArray, base: IntArray, delays: IntArray) -> FloatArray:
    """Square that each delay leaves of the gap beside some columns, shape (n_delays,)."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(gram)[base], np.finfo(float).tiny))
    sizes = np.outer(scale, scale)
    products = gram[np.ix_(base, base)] * sizes
    inverse = np.linalg.pinv(products, rcond=DEPENDENT, hermitian=True) * sizes
    taken = gram[delays][:, base] @ inverse
    square = np.diag(gram)[delays] - np.sum(taken * gram[delays][:, base], axis=1)
    product = gram[delays, 0] - taken @ gram[base, 0]
    remaining = gram[0, 0] - gram[0, base] @ inverse @ gram[base, 0]
    is_new = square > DEPENDENT * np.diag(gram)[delays]
    return np.asarray(remaining - np.where(is_new, product**2 / np.where(is_new, square, 1.0), 0.0))
