"""Load cases LC1 to LC4 of the 2012 paper: records, identified motion, and LC2 simulated.

The records stand for the measurement. They come from the stage in time with a kink in the joint of
shaft and carrier, bearing clearances and soft bearings (``stage_order_one.toml``), read by sensors
with errors; no equation of the identified models went into them. The simulation is another stage,
the paper's own model (``stage_paper_lc2.toml``), with the tilt that was identified imposed.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.carrier.carrier_identification import identify_each_run
from carrierflex.identification.carrier.models import CarrierModel, flexible_model, rigid_model
from carrierflex.identification.carrier.parameter_estimate import ParameterEstimate
from carrierflex.simulation.carrier.case_files import shipped_case
from carrierflex.simulation.sensing import SensorError
from carrierflex.simulation.stage.effects import StageEffects
from carrierflex.simulation.stage.readings import ReadingEffects
from carrierflex.simulation.stage.stage_body import StageBody
from carrierflex.simulation.stage.stage_cases import StageCase, StageRun, read_stage_case
from carrierflex.simulation.stage.stage_model import stage_model
from carrierflex.simulation.stage.stage_run import simulate_stage
from carrierflex.workflows.simulation.simulate_stage import stage_campaign, stage_run_record

#: Load case that the papers show in time.
SHOWN = "LC2"
#: Elastic body of the stage for a pin fit [N m/rad] and a kind of main shaft.
BodyOf = Callable[[float, str], StageBody]
#: Zeroes and gains of the sensors, chosen: usual errors of eddy-current sensors.
_SENSOR_ERRORS = {
    "s047": SensorError(gain=0.01, zero=20e-6),
    "s137": SensorError(gain=-0.01, zero=-10e-6),
    "s227": SensorError(gain=0.005, zero=-20e-6),
    "s317": SensorError(gain=-0.005, zero=10e-6),
}


@dataclass(frozen=True, eq=False)
class StageRecords:
    """What the figures of the identified and simulated motion are drawn from."""

    campaign: Annotated[Campaign, "Records of LC1 to LC4"]
    models: Annotated[tuple[CarrierModel, ...], "M1 and M2"]
    estimates: Annotated[
        Mapping[str, Mapping[str, ParameterEstimate]],
        "By model and load case, each load case by itself as in the paper",
    ]
    simulated: Annotated[Run, "LC2 by the paper's model of the stage"]

    def measured(self, name: str = SHOWN) -> Run:
        """Record of a load case."""
        (run,) = [run for run in self.campaign.runs if run.name == name]
        return run


def stage_records(
    body_of: BodyOf, curves: Mapping[str, DeflectionCurve], duration: float
) -> StageRecords:
    """Make the records, identify M1 and M2 from each, simulate LC2.

    Parameters
    ----------
    body_of : callable
        Elastic body of the stage.
    curves : mapping of str to DeflectionCurve
        ``delta_s`` and ``delta_f`` of the identified model M2.
    duration : float
        Length of every run [s].
    """
    # Zeroed at rest with pin 1 upright, as the papers' sensors were at standstill.
    real = replace(
        read_stage_case(shipped_case("stage_order_one")), duration=duration, rest_angle=0.0
    )
    reading = replace(real.reading, sensors=_SENSOR_ERRORS)
    body = body_of(real.pin_fit_stiffness, real.main_shaft)
    rng = np.random.default_rng(real.seed)
    runs = [_record(body, real, run, reading, rng) for run in real.runs]
    campaign = stage_campaign(real, runs)
    models = (rigid_model(), flexible_model(curves["delta_s"], curves["delta_f"]))
    estimates = {model.name: identify_each_run(campaign, model) for model in models}
    return StageRecords(
        campaign, models, estimates, _simulated(body_of, estimates["m1"][SHOWN], duration)
    )


def _simulated(body_of: BodyOf, estimate: ParameterEstimate, duration: float) -> Run:
    """LC2 by the paper's model, the identified tilt at the measured face."""
    shipped = read_stage_case(shipped_case(f"stage_paper_{SHOWN.lower()}"))
    case = replace(shipped, effects=StageEffects(), duration=duration)
    found = dict(zip(estimate.names, estimate.values, strict=True))
    reading = ReadingEffects(
        phi_face=float(found["phi_PLC"]),
        theta_face=float(found["theta_PLC"]),
    )
    (run,) = case.runs
    return _record(body_of(case.pin_fit_stiffness, case.main_shaft), case, run, reading, None)


def _record(
    body: StageBody,
    case: StageCase,
    run: StageRun,
    reading: ReadingEffects,
    rng: np.random.Generator | None,
) -> Run:
    model = stage_model(body, case.data, effects=case.effects, speed=case.speed)
    pieces = simulate_stage(
        model,
        run.load,
        case.sensors,
        duration=case.duration,
        sample_rate=case.sample_rate,
        step=case.step,
        effects=reading,
        rng=rng,
        rest_angle=case.rest_angle,
    )
    return stage_run_record(run, list(pieces))
