"""Feasible loads of the dynamometer among which a separating measurement is sought."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from carrierflex.diagnosis.carrier.records.columns import ColumnSource
from carrierflex.diagnosis.comparison.problem import Effects, FloatArray
from carrierflex.diagnosis.kind.comparison_problem import CandidateExperiment, ComparisonProblem
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.records import Run

#: Radial load of the dynamometer where the records hold none [N]: that of the 2012 paper's load
#: cases.
_RADIAL_LOAD = 200e3
_REVOLUTIONS = 4
_SAMPLES = 144
_Load = tuple[float, float, float]
#: Comparison problem that measured what a model predicts under the inputs of another campaign.
Under = Callable[[Campaign, Effects, FloatArray], ComparisonProblem]


def carrier_experiments(
    campaign: Campaign, source: ColumnSource, under: Under
) -> tuple[CandidateExperiment, ...]:
    """Steps of torque, of radial load along z and y, and radial loads at low torque.

    Parameters
    ----------
    campaign : Campaign
        What was measured.
    source : ColumnSource
        Nominal torque, largest radial load and typical speed of the records.
    under : callable
        ``(campaign, effects, theta) -> ComparisonProblem`` whose signals are those of a model under
        the inputs of a campaign.

    Returns
    -------
    tuple of CandidateExperiment
        Each a short campaign of several steady runs.
    """
    nominal = source.rig.nominal_torque
    has_radial_load = "ntl_y" in campaign.contract.inputs
    size = source.largest_load
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
    candidate_experiments = []
    for text, shares_of_loads in plans if has_radial_load else plans[:1]:
        loads = [(torque * nominal, y * force, z * force) for torque, y, z in shares_of_loads]
        runs = _steady_runs(campaign, loads, source.speed)
        candidate_experiments.append(CandidateExperiment(text, _builder(runs, under)))
    return tuple(candidate_experiments)


def _builder(
    campaign: Campaign, under: Under
) -> Callable[[Effects, FloatArray], ComparisonProblem | None]:
    def build(effects: Effects, theta: FloatArray) -> ComparisonProblem | None:
        return under(campaign, effects, theta)

    return build


def _steady_runs(campaign: Campaign, loads: Sequence[_Load], speed: float) -> Campaign:
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
                name: values
                for name, values in {
                    "carrier_angle": angle,
                    "torque": np.full(n, t),
                    "ntl_y": np.full(n, y),
                    "ntl_z": np.full(n, z),
                }.items()
                if name in campaign.contract.inputs
            },
            blank,
        )
        for k, (t, y, z) in enumerate(loads)
    )
    baseline = replace(campaign.baseline, source="model")
    return replace(campaign, runs=runs, baseline=baseline)
