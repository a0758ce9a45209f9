"""Reading of simulation cases of kind ``mounting`` (TOML): rig, truth and load histories."""

from dataclasses import dataclass
from pathlib import Path

from carrierflex.files.problems import problems_of, refuse
from carrierflex.files.toml_files import read_toml
from carrierflex.simulation.case_kinds import MOUNTING_CASE
from carrierflex.simulation.mounting.load_history import LoadHistory
from carrierflex.simulation.mounting.parameter_arrays import ParameterArray, parameter_array
from carrierflex.simulation.mounting.rig import MountingRig
from carrierflex.simulation.mounting.shaft_bending import BendingGauges
from carrierflex.simulation.mounting.table_3 import TABLE_3
from carrierflex.simulation.record_size import (
    MOST_IN_A_FILE,
    MOST_IN_MEMORY,
    refuse_size,
    refuse_steps,
)

#: Time, five inputs and six sensors.
_COLUMNS = 12


@dataclass(frozen=True, eq=False)
class MountingRun:
    """One run: its name, condition and loads."""

    name: str
    condition: str
    history: LoadHistory


@dataclass(frozen=True, eq=False)
class MountingCase:
    """A set of runs on the mounting rig with their truth.

    Parameters
    ----------
    name : str
        Title.
    seed : int
        Seed of the random generator for the noise.
    noise_std : float
        Standard deviation of the noise of every sensor [m].
    rig : MountingRig
        Nominal rig, as a campaign states it.
    truth : ndarray
        Flat parameter set of the true mounting.
    runs : tuple of MountingRun
        Runs.
    step : float, optional
        Largest step [s] of nonlinear bushings; chosen from their stiffness where the case has none.
    bending : tuple of BendingGauges
        Sections of the main shaft whose bending moments are recorded.
    """

    name: str
    seed: int
    noise_std: float
    rig: MountingRig
    truth: ParameterArray
    runs: tuple[MountingRun, ...]
    step: float | None = None
    bending: tuple[BendingGauges, ...] = ()


def read_mounting_case(path: Path) -> MountingCase:
    """Read a case file of kind ``mounting``.

    Parameters
    ----------
    path : Path
        TOML file; ``cases/mounting_2011.toml`` shows its keys. Keys of the rig and of a history
        that are left out have the defaults of :class:`MountingRig` and :class:`LoadHistory`.

    Returns
    -------
    MountingCase
        The case in SI units.

    Raises
    ------
    FileNotFoundError
        Where there is no such file.
    ValueError
        Where it is not TOML, or keys are unknown, missing or wrong; all of them at once.
    """
    from carrierflex.simulation.mounting.case_tables import MountingCaseDocument

    document = read_toml(path, MOUNTING_CASE, MountingCaseDocument)
    try:
        given = dict(document.truth.given())
        column = TABLE_3[given.pop("table_3")] if "table_3" in given else {}
        truth = parameter_array(document.rig, {**column, **given})
    except ValueError as error:
        refuse(problems_of(error), str(path))
        raise
    runs = tuple(MountingRun(run.name, run.condition, run.history) for run in document.runs)
    return MountingCase(
        document.name,
        document.seed,
        document.noise_std,
        document.rig,
        truth,
        runs,
        document.step,
        tuple(BendingGauges(gauges.section, gauges.noise_std) for gauges in document.bending),
    )


def refuse_long_runs(case: MountingCase, file: str, *, piecewise: bool = False) -> None:
    """Refuse a case whose records are too long, before anything is simulated.

    Parameters
    ----------
    case : MountingCase
        The case.
    file : str
        Its file, for the message.
    piecewise : bool
        Whether records are written piece by piece.

    Raises
    ------
    ValueError
        Where there are too many samples or steps.
    """
    numbers = 0.0
    for run in case.runs:
        history = run.history
        mine = history.duration * history.sample_rate * _COLUMNS
        numbers = mine if piecewise else numbers + mine
        most = MOST_IN_A_FILE if piecewise else MOST_IN_MEMORY
        keys = {"duration [s]": history.duration, "sample_rate [1/s]": history.sample_rate}
        refuse_size(file, keys, numbers, most)
        refuse_steps(file, history.duration, case.step)
