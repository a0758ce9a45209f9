"""Reading of simulation cases of kind ``mounting`` (TOML): rig, truth and load histories."""

from dataclasses import dataclass
from pathlib import Path

from carrierflex.files.problems import problems_of, refuse
from carrierflex.files.toml_files import TomlKind, read_toml
from carrierflex.simulation.carrier.case_files import MOST_CASE_BYTES
from carrierflex.simulation.mounting.load_history import LoadHistory
from carrierflex.simulation.mounting.parameters import ParameterArray, parameter_array
from carrierflex.simulation.mounting.rig import MountingRig

MOUNTING_CASE = TomlKind(
    "a case file of kind mounting",
    most_bytes=MOST_CASE_BYTES,
    format="carrierflex-case",
)


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
    """

    name: str
    seed: int
    noise_std: float
    rig: MountingRig
    truth: ParameterArray
    runs: tuple[MountingRun, ...]
    step: float | None = None


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
        truth = parameter_array(document.rig, document.truth.given())
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
    )
