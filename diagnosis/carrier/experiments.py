"""Feasible loads of the dynamometer among which a separating measurement is sought."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from carrierflex.diagnosis.comparison.problem import CandidateExperiment, Effects, FloatArray
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.records import Run

if TYPE_CHECKING:
    from carrierflex.diagnosis.carrier.problem import CarrierProblem

#: Radial load of the dynamometer where the records hold none [N]: that of the 2012 paper's load
#: cases.
_RADIAL_LOAD = 200e3
_REVOLUTIONS = 4
_SAMPLES = 144
_Load = tuple[float, float, float]


def carrier_experiments(problem: "CarrierPlant") -> tuple[CandidateExperiment, ...]:
    """Steps of torque, of radial load along z and y, and radial loads at low torque.

    Parameters
    ----------
    problem : CarrierProblem
        What was measured.

    Returns
    -------
    tuple of CandidateExperiment
        Each a short campaign of several steady runs.
    """
    nominal = problem.model.source.rig.nominal_torque
    size = problem.model.source.largest_load
    force = size if size > 1.0 else _RADIAL_LOAD
    shares = (-1.0, -0.5, 0.25, 0.5, 1.0)
    kilo = f"{force / 1e3:g} kN"
    plans: list[tuple[str, list[_Load]]] = [
        (
            "steps of 10, 25, 50, 75 and 100 % torque without radial load",
            [(s, 0.0, 0.0) for s in (0.1, 0.25, 0.5, 0.75, 1.0)],
        ),
        (
            f"five radial loads along z up to {kilo} of both signs at full torque",
            [(1.0, 0.0, s) for s in shares],
        ),
        (
            f"five radial loads along y up to {kilo} of both signs at full torque",
            [(1.0, s, 0.0) for s in shares],
        ),
        (
            f"radial loads of {kilo} along y and z at a quarter and at full torque",
            [(t, y, z) for t in (0.25, 1.0) for y, z in ((1.0, 0.0), (0.0, 1.0), (0.0, -1.0))],
        ),
    ]
    return tuple(
        CandidateExperiment(
            text, _builder(problem, [(t * nominal, y * force, z * force) for t, y, z in loads])
        )
        for text, loads in plans
    )


def _builder(
    problem: "CarrierPlant", loads: Sequence[_Load]
) -> "Callable[[Effects, FloatArray], CarrierPlant | None]":
    campaign = _campaign(problem.campaign, loads, problem.model.source.speed)

    def build(effects: Effects, theta: FloatArray) -> "CarrierPlant | None":
        return problem.under(campaign, effects, theta)

    return build


def _campaign(campaign: Campaign, loads: Sequence[_Load], speed: float) -> Campaign:
    """Campaign of steady runs; its signals are blank."""
    n = _REVOLUTIONS * _SAMPLES + 1
    angle = 2.0 * np.pi * np.arange(n) / _SAMPLES
    blank = {channel.name: np.zeros(n) for channel in campaign.channels}
    runs = tuple(
        Run(
            f"step {k + 1}",
            f"step{k + 1}.csv",
            f"step {k + 1}",
            angle / speed,
            {
                "carrier_angle": angle,
                "torque": np.full(n, t),
                "ntl_y": np.full(n, y),
                "ntl_z": np.full(n, z),
            },
            blank,
        )
        for k, (t, y, z) in enumerate(loads)
    )
    baseline = replace(campaign.baseline, source="model")
    return replace(campaign, runs=runs, baseline=baseline)
