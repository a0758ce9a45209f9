"""Supports with which a misalignment shows the order 1 that table 5 of the 2012 paper determines.

Bounded least squares over static equilibria in LC1, LC2 and LC4 at once, from the best points of a
Latin hypercube:

    python -m studies.search_order_one --out search

The shipped case ``stage_order_one.toml`` was found so. A good answer: what no parameter can part
(LC1 from LC2) is left, and little beside it.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.stats.qmc import LatinHypercube

from carrierflex.files.json_files import save_json
from carrierflex.files.versions import versions
from carrierflex.identification.carrier.printed_tables import (
    FULL_TORQUE,
    LOAD_CASES,
    SENSOR_RADIUS,
    derived_facts,
)
from carrierflex.reduction.pin_joints import PAPER_STIFFNESS
from carrierflex.simulation.stage.quasi_static import quasi_static_turn, sensor_orders
from carrierflex.simulation.stage.stage_body import StageBody
from carrierflex.simulation.stage.stage_data import BearingData, MountingData, StageData
from carrierflex.simulation.stage.stage_model import stage_model
from carrierflex.simulation.stage.statics import SteadyLoad
from carrierflex.workflows.outputs import prepared_folder
from carrierflex.workflows.simulation.order_one_supports import Support, clearances
from carrierflex.workflows.simulation.stage_bodies import default_stage_body
from carrierflex.workflows.simulation.study_order_one import SENSORS

#: Ranges of docs/order_one.md, with their sources there [rad, N/m, m, N m/rad, N/m, N/m].
RANGES = {
    "phi_PLC": (0.05e-3, 3e-3),
    "axial_stiffness": (0.5e6, 8.3e6),
    "x": (-0.3, 0.6),
    "tilt_stiffness": (1e3, 8e5),
    "upwind_radial": (1e8, 6e9),
    "downwind_radial": (1e8, 6e9),
}
#: Searched by their logarithm: the range spans decades.
_LOGARITHMIC = ("axial_stiffness", "tilt_stiffness", "upwind_radial", "downwind_radial")
#: Angles of a turn.
_ANGLES = 8
#: Points of the hypercube, of which the best are starts, and steps of each search.
_POINTS, _STEPS = 48, 40
#: Difference for the gradient, share of a range: contacts settle to a few nanometres.
_DIFFERENCE = 1e-3


@dataclass(frozen=True, eq=False)
class SearchedSupport:
    """The best of the searches.

    Parameters
    ----------
    values : mapping of str to float
        Of the keys of `RANGES`.
    order_1 : mapping of str to float
        Mean amplitude at the sensors by load case of the paper [m].
    """

    values: Mapping[str, float]
    order_1: Mapping[str, float]


def support_of(values: Mapping[str, float]) -> Support:
    """Support with the published clearances and the given values."""
    mounting = {key: values[key] for key in ("axial_stiffness", "x", "tilt_stiffness")}
    bearings = {key: values[key] for key in ("upwind_radial", "downwind_radial")}
    data = StageData(
        bearings=BearingData(**clearances(), **bearings), mounting=MountingData(**mounting)
    )
    return Support("searched", data, values["phi_PLC"])


def order_1(body: StageBody, support: Support, load_case: str) -> float:
    """Mean amplitude at the sensors in a load case of the paper [m]."""
    share, force = LOAD_CASES[load_case]
    load = SteadyLoad(share * FULL_TORQUE, ntl_z=force)
    model = stage_model(body, support.data, effects=support.effects, speed=0.0)
    return sensor_orders(model, quasi_static_turn(model, load, _ANGLES), SENSORS).mean_amplitude(1)


def search(
    body: StageBody,
    wanted: Mapping[str, float],
    ranges: Mapping[str, tuple[float, float]],
    rng: np.random.Generator,
    *,
    n_points: int = _POINTS,
    n_starts: int = 3,
) -> SearchedSupport:
    """Support within the ranges whose order 1 comes nearest to the wanted, in least squares.

    Parameters
    ----------
    body : StageBody
        Shaft, carrier and pins.
    wanted : mapping of str to float
        Order 1 [m] by load case.
    ranges : mapping of str to (float, float)
        Of the keys of `RANGES`, SI units.
    rng : numpy.random.Generator
        Of the hypercube.
    n_points, n_starts : int
        Points of the hypercube, and how many of them searches begin at.
    """
    points = LatinHypercube(len(ranges), rng=rng).random(n_points)

    def gap(point: NDArray[np.float64]) -> NDArray[np.float64]:
        """Gap by load case [um]."""
        support = support_of(_values(point, ranges))
        return np.array(
            [1e6 * (order_1(body, support, name) - size) for name, size in wanted.items()]
        )

    best = sorted(points, key=lambda point: float(np.linalg.norm(gap(point))))[:n_starts]
    fits = [
        least_squares(gap, start, bounds=(0.0, 1.0), diff_step=_DIFFERENCE, max_nfev=_STEPS)
        for start in best
    ]
    values = _values(min(fits, key=lambda fit: fit.cost).x, ranges)
    support = support_of(values)
    return SearchedSupport(values, {name: order_1(body, support, name) for name in LOAD_CASES})


def _values(
    point: NDArray[np.float64], ranges: Mapping[str, tuple[float, float]]
) -> dict[str, float]:
    """Values at a point of the unit cube."""
    values = {}
    for share, (name, (low, high)) in zip(point, ranges.items(), strict=True):
        scale = low * (high / low) ** share if name in _LOGARITHMIC else low + share * (high - low)
        values[name] = float(scale)
    return values


def main(*, out: Path, size: float = 0.06, softest_bearing: float = 1e8, seed: int = 2012) -> None:
    """Search, and write order_one_search.json.

    Parameters
    ----------
    out
        Folder.
    size
        Element edge length of carrier and pins [m].
    softest_bearing
        Lower end of the carrier bearings' range [N/m].
    seed
        Of the hypercube.
    """
    folder = prepared_folder(out)
    stiff = dict.fromkeys(("upwind_radial", "downwind_radial"), (softest_bearing, 6e9))
    ranges = {**RANGES, **stiff}
    wanted = {case: phi.value * SENSOR_RADIUS for case, phi in derived_facts().phi_PLC.items()}
    body = default_stage_body(PAPER_STIFFNESS, size)
    nearest = search(body, wanted, ranges, np.random.default_rng(seed))
    document = {"found": nearest.values, "order_1_m": nearest.order_1, "paper_m": wanted}
    inputs = {"size": size, "ranges": ranges, "seed": seed}
    save_json(
        folder / "order_one_search.json", {**document, "inputs": inputs, "versions": versions()}
    )


if __name__ == "__main__":
    import cyclopts

    cyclopts.run(main)
