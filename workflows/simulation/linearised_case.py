"""The state space of a case: a mounting under the loads of a run, a stage at its speed."""

from pathlib import Path

from carrierflex.files.toml_files import toml_document
from carrierflex.geometry.parameters import DEFAULT_SIZE
from carrierflex.reduction.state_space import StateSpace
from carrierflex.simulation.carrier.case_files import shipped_case
from carrierflex.simulation.case_kinds import CARRIER_CASE, STAGE_FORMAT
from carrierflex.simulation.mounting.case_files import read_mounting_case
from carrierflex.simulation.mounting.linearised import mounting_state_space
from carrierflex.simulation.stage.linearised import stage_state_space
from carrierflex.simulation.stage.modal_form import modal_stage
from carrierflex.simulation.stage.stage_cases import read_stage_case
from carrierflex.simulation.stage.stage_model import stage_model
from carrierflex.workflows.simulation.linearise_mounting import operating_point
from carrierflex.workflows.simulation.linearise_stage import rim_readings
from carrierflex.workflows.simulation.simulate_stage import stage_body_of_case


def case_state_space(case: Path | str, run: str | None = None) -> StateSpace:
    """State space of a case of kind mounting or of a stage case.

    Parameters
    ----------
    case : path
        Case file (TOML), or the name of a bundled case.
    run : str, optional
        Mounting: run at whose largest torque it is linearised; the first by default.

    Raises
    ------
    ValueError
        Where the case is of another kind or has no such run.
    """
    path = Path(case)
    if not path.suffix and not path.exists():
        path = shipped_case(str(case))
    document = toml_document(path, CARRIER_CASE)
    if document.get("format") == STAGE_FORMAT:
        if run is not None:
            raise ValueError(
                f"--run is {run!r}; a stage is linearised at the speed of its case, whatever the "
                "run: leave --run out"
            )
        what = read_stage_case(path)
        body = stage_body_of_case(what, DEFAULT_SIZE)
        model = stage_model(body, what.data, effects=what.effects, speed=what.speed)
        names = [sensor.name for sensor in what.sensors]
        return stage_state_space(modal_stage(model), rim_readings(what, model), names, what.name)
    if document.get("kind") != "mounting":
        raise ValueError(
            f"{case}: a case of the carrier's motion, which holds no equations of motion; expected "
            "a body file (.h5), a case of kind mounting or a stage case"
        )
    mounting = read_mounting_case(path)
    runs = {run.name: run for run in mounting.runs}
    if run is not None and run not in runs:
        raise ValueError(f"{case}: no run {run!r}; expected one of {', '.join(runs)}")
    loads, _ = operating_point(runs[run] if run is not None else mounting.runs[0])
    return mounting_state_space(mounting.rig, mounting.truth, loads, mounting.name)
