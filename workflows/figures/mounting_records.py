"""The load history of the 2011 paper: a record, and three bushing models identified from it.

The record stands for the measurement. Its bushings are the nonlinear ones of table 3; beside them
it holds what none of the three models knows, so that no fit can be perfect: bushings of unequal
stiffness, a radial load off the vertical, a main bearing that gives way, gains of the sensors.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.simulated_campaign import simulated_mounting_campaign
from carrierflex.identification.estimation.complex_method import ComplexSearch
from carrierflex.identification.mounting.bushing_identification import (
    BushingEstimate,
    identify_bushings,
    search_bushings,
)
from carrierflex.identification.mounting.bushing_models import (
    BUSHING_MODELS,
    HYDRODYNAMIC,
    LINEAR,
    NONLINEAR,
)
from carrierflex.simulation.carrier.case_files import shipped_case
from carrierflex.simulation.mounting.case_files import MountingCase, read_mounting_case
from carrierflex.simulation.mounting.history_inputs import history_inputs
from carrierflex.simulation.mounting.inputs import MountingInputs
from carrierflex.simulation.mounting.parameter_arrays import check_parameters, parameter_array
from carrierflex.simulation.mounting.parameters import INDEX
from carrierflex.simulation.mounting.rig import MountingRig
from carrierflex.simulation.mounting.simulate import simulate, with_noise
from carrierflex.workflows.executors import SerialExecutor

#: The paper keeps 2000 samples of 520 s [1/s].
SAMPLE_RATE = 2000.0 / 520.0
#: Radial load along y and z [N]: not printed, chosen within the axis of figure 6 (100 kN a
#: cylinder) so that the housing moves as far, and the way, that the axes of figures 6 and 7 show.
RADIAL_LOAD = (10e3, 125e3)
#: What the record holds and the models do not; chosen.
UNMODELLED = {
    "starboard_excess": 0.06,
    "ntl_angle": 0.04,
    "main_bearing_compliance": 2e-10,
    "gain_ssz": 1.02,
    "gain_sbx": 0.97,
}
#: Weights of equation 12: theta_x rules, as in the paper, which prints no numbers.
WEIGHTS = {"d_x": 1.0, "d_y": 1.0, "d_z": 1.0, "theta_x": 10.0, "theta_y": 1.0, "theta_z": 1.0}
#: Names in the paper's figures.
LABELS = {NONLINEAR.name: "NLin", LINEAR.name: "Lin", HYDRODYNAMIC.name: "HD-b"}


@dataclass(frozen=True, eq=False)
class MountingRecords:
    """What the figures of the mounting are drawn from."""

    campaign: Annotated[Campaign, "The record"]
    inputs: Annotated[MountingInputs, "Its loads"]
    measured: Annotated[
        NDArray[np.float64],
        "Motion of the housing from the sensors, equation 10 [m, rad], shape (n, 6)",
    ]
    adapted: Annotated[
        Mapping[str, NDArray[np.float64]], "Motion of the identified models, by model, shape (n, 6)"
    ]
    estimates: Annotated[Mapping[str, BushingEstimate], "By model"]
    searches: Annotated[
        Mapping[str, ComplexSearch], "Complex method on the same objective, by model"
    ]


def mounting_records(evaluations: int) -> MountingRecords:
    """Simulate the record, identify the three models, search them by the complex method.

    Parameters
    ----------
    evaluations : int
        Simulations that each search may take.
    """
    case = _case()
    (run,) = case.runs
    inputs = history_inputs(run.history)
    response = simulate(case.rig, case.truth, inputs, step=case.step)
    noisy = with_noise(response, case.noise_std, np.random.default_rng(case.seed))
    campaign = simulated_mounting_campaign(case, [(inputs, noisy)])
    fitted = identify_bushings(campaign, HYDRODYNAMIC, SerialExecutor(), weights=WEIGHTS)
    estimates = {estimate.model.name: estimate for estimate in fitted}
    return MountingRecords(
        campaign,
        inputs,
        case.rig.housing_motion(noisy.signals),
        {name: _motion(case.rig, estimate, inputs) for name, estimate in estimates.items()},
        estimates,
        {
            model.name: search_bushings(
                campaign, model, weights=WEIGHTS, seed=case.seed, max_evaluations=evaluations
            )
            for model in BUSHING_MODELS
        },
    )


def _case() -> MountingCase:
    """The shipped case, sampled as the paper does, with what its models do not know."""
    shipped = read_mounting_case(shipped_case("mounting_2011"))
    truth = shipped.truth.copy()
    for name, value in UNMODELLED.items():
        truth[INDEX[name]] = value
    check_parameters(truth)
    (run,) = shipped.runs
    history = replace(
        run.history, sample_rate=SAMPLE_RATE, ntl_y=RADIAL_LOAD[0], ntl_z=RADIAL_LOAD[1]
    )
    runs = (replace(run, history=history),)
    return replace(shipped, truth=truth, runs=runs)


def _motion(
    rig: MountingRig, estimate: BushingEstimate, inputs: MountingInputs
) -> NDArray[np.float64]:
    values = estimate.model.simulator_values(estimate.fit.values)
    return rig.housing_motion(simulate(rig, parameter_array(rig, values), inputs).signals)
