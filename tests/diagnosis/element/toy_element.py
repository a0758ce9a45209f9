"""An element of driven runs without forces: what its classes leave of known causes is given."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np

from carrierflex.diagnosis.classes.gram_table import ColumnGroup, LawColumns
from carrierflex.diagnosis.classes.held_out import ClassScores
from carrierflex.diagnosis.element.columns import DELAY, FORCE_SURFACE
from carrierflex.diagnosis.element.table import CLASS_GROUPS
from tests.diagnosis.classes.toy_table import N_KNOWN, known_scores

STEP, N_SAMPLES = 5e-3, 2000
#: Lag [s] of which every fit finds the delay, and the place of its column.
LAG, LAG_COLUMN = 2e-3, 7
#: Name of all classes together among the sets of known squares.
UNION = "union"


@dataclass(frozen=True, eq=False)
class ToyRun:
    """Run in force space, all of whose samples count."""

    record: SimpleNamespace
    x: np.ndarray
    v: np.ndarray
    lag: float = 0.0
    step: float = STEP

    @property
    def drive(self):
        return self.record.drive

    @property
    def counts(self):
        return np.ones(N_SAMPLES, dtype=bool)


def run_of(drive):
    """Run whose deflection has the shape of its drive."""
    return moved_run(drive, drive)


def moved_run(drive, x):
    """Run of a drive and a deflection."""
    return ToyRun(SimpleNamespace(drive=drive, gap=None), x, np.gradient(x, STEP))


TIME = STEP * np.arange(N_SAMPLES)


def line(level=1.0, frequency_hz=7.0):
    """Run under one frequency."""
    return run_of(level * np.sin(2.0 * np.pi * frequency_hz * TIME))


def multisine(level=1.0, seed=0):
    """Run under many frequencies at once."""
    lines = np.arange(10, 200, 3) / TIME[-1]
    phases = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, lines.size)
    rows = np.sin(2.0 * np.pi * np.outer(lines, TIME) + phases[:, None])
    return run_of(level * rows.mean(axis=0))


def sweep(level=1.0):
    """Run through many frequencies, one after the other."""
    return run_of(level * np.sin(2.0 * np.pi * (2.0 + TIME) * TIME))


def growing_line(level=1.0):
    """Run under one frequency that grows all along."""
    return run_of(level * np.exp(TIME / TIME[-1]) * line().x)


def decay(level=1.0):
    """Run after a release, in which nothing drives."""
    return moved_run(np.zeros(N_SAMPLES), level * np.exp(-TIME) * line().x)


class ToyScores(ClassScores):
    """Known held-out squares, the same beside nothing, every fit of which finds the same delay."""

    @property
    def without_baseline(self):
        return self

    def amplitudes(self, squares):
        return {LAG_COLUMN: LAG}


@dataclass(frozen=True, eq=False)
class ToyElement:
    """What an answer reads of the table of an element."""

    model: SimpleNamespace
    records: tuple[ToyRun, ...]
    scores: ToyScores

    @property
    def table(self):
        return self.scores.table

    @property
    def runs(self):
        return self


def toy_element(records, causes, classes, *, model=None, union=None, laws=None, force=1e6):
    """Element of some runs whose gap is made of causes.

    Parameters
    ----------
    records : sequence of ToyRun
        Runs.
    causes : dict
        Size of each cause in floors.
    classes : dict
        What a class leaves of the causes that it shows; one that is not told shows none.
    model : SimpleNamespace, optional
        What an answer reads of the baseline.
    union : dict, optional
        What all classes together leave of each cause; nothing unless told.
    laws : dict
        Law of a class and what it leaves of the causes, by class.
    force : float or ndarray, shape (N_KNOWN,)
        Square of the force in floors, all of it in equal blocks or by block.
    """
    shown = {name: classes.get(name, {}) for name in CLASS_GROUPS}
    shown[UNION] = dict.fromkeys(causes, 0.0) if union is None else union
    columns = {}
    for column, (name, (law, remaining)) in enumerate((laws or {}).items()):
        columns[name] = (LawColumns(law, (np.array([column]),), 1),)
        shown[f"columns [{column}]"] = remaining
    plain, _ = known_scores(causes, shown)
    by_block = np.broadcast_to(np.asarray(force) / N_KNOWN, N_KNOWN)
    table = replace(
        plain.table,
        gram=by_block[:, None, None],
        classes=CLASS_GROUPS,
        surface=FORCE_SURFACE,
        groups={DELAY: ColumnGroup(np.array([LAG_COLUMN]), np.eye(1))},
        laws={name: columns.get(name, ()) for name in CLASS_GROUPS},
    )
    # Columns of a law stand behind the classes beside them.
    known = {
        tuple(sorted(names, key=lambda name: name.startswith("columns"))): squares
        for names, squares in plain.known.items()
    }
    return ToyElement(model, tuple(records), ToyScores(table, plain.constants, known))
