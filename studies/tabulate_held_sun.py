"""What the diagnosis says of campaigns whose sun is held where the prediction lets it float.

    python -m studies.tabulate_held_sun --cases 50 --seed 1 --out held_sun

Stages with clearances in the carrier's bearings, supports of the housing, pins and spline drawn
within their sourced ranges are solved in static equilibrium under the six loads of the blind
check's carrier, with their sun held by friction and with a floating one, which is the prediction;
the sensors' noise is 5 um. A file a campaign, made where it is missing, then held_sun.md. The
library has no such effect: right is the tilt of the housing that follows the radial load, as which
a held sun shows (docs/stage_model.md). A good answer: so in 90 % of those of two floors and more.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from carrierflex.blind_check.truth.carrier.stage import LOADS, SeriesCampaign, series_campaign
from carrierflex.diagnosis.comparison.problem import Effects
from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.diagnosis.kinds import problem_of
from carrierflex.diagnosis.results import Diagnosis
from carrierflex.files.json_files import save_json
from carrierflex.geometry.pins import PAPER_STIFFNESS
from carrierflex.identification.estimation.single_thread import single_threaded
from carrierflex.simulation.stage.condensed_stage import PUBLISHED_CLEARANCE
from carrierflex.simulation.stage.effects import StageEffects
from carrierflex.simulation.stage.hidden_stages import HIDDEN
from carrierflex.simulation.stage.quasi_static import quasi_static_turn, sensor_orders
from carrierflex.simulation.stage.stage_body import StageBody
from carrierflex.simulation.stage.stage_data import BearingData, MeshData, MountingData, StageData
from carrierflex.simulation.stage.stage_model import stage_model
from carrierflex.simulation.stage.statics import NotConvergedError, SteadyLoad
from carrierflex.workflows.fe.default_curves import default_curves
from carrierflex.workflows.outputs import prepared_folder
from carrierflex.workflows.progress import Stages
from carrierflex.workflows.simulation.stage_bodies import default_stage_body
from carrierflex.workflows.simulation.study_order_one import SENSORS
from studies.case_files import seeded_cases, write_table

#: Noise of a sensor [m], and floors from which a gap can be named.
FLOOR, VISIBLE = 5e-6, 2.0
#: Share of the published clearances: 0.2 to 0.33 mm of diameter, ISO 5753 group CN of the bearing
#: that has 0.275 mm in the GRC models.
CLEARANCE = (0.73, 1.2)
#: Quill [N/m], friction and clearance [m] of a spline that holds its sun, as in ``[bearings]``.
QUILL, FRICTION, SPLINE_CLEARANCE = (1e8, 1.4e9), (0.05, 0.15), (0.0, 0.3e-3)
#: The drawing's tolerance of a pin's place [m].
_PIN = 10e-6
_ANGLES, _HIGHEST_ORDER = 24, 7
#: Laws of the library that a tilt by the radial load has in the stage.
LOAD_TILT = ("ntl_tilt", "bearing_clearance", "clearance_rocking")
BELOW, RIGHT, RIGHT_AMONG_OTHERS, OTHER, NONE = (
    "gap below two floors",
    "tilt by the radial load, alone or tied",
    "the same, with others",
    "others alone",
    "none named",
)


@dataclass(frozen=True)
class HeldSun:
    """What the diagnosis says of one campaign.

    Parameters
    ----------
    gap : float
        RMS of the gap over the noise.
    verdict : str
        Its verdict.
    named : tuple of str
        Named laws and classes.
    ties : tuple of str
        Laws and classes that cannot be told from them.
    """

    gap: float
    verdict: str
    named: tuple[str, ...]
    ties: tuple[str, ...]

    @property
    def outcome(self) -> str:
        """One of `BELOW`, `RIGHT`, `RIGHT_AMONG_OTHERS`, `OTHER` and `NONE`."""
        if self.gap < VISIBLE:
            return BELOW
        if not self.named:
            return NONE
        of_load = [name for name in self.named if _is_load_tilt(name)]
        if len(of_load) == len(self.named):
            return RIGHT
        return RIGHT_AMONG_OTHERS if of_load or any(map(_is_load_tilt, self.ties)) else OTHER


def _is_load_tilt(name: str) -> bool:
    """Whether a law or class is a tilt of the housing that follows the radial load."""
    return name in LOAD_TILT or (name.startswith("housing/tilt/") and "radial_load" in name)


def drawn_data(rng: np.random.Generator) -> tuple[StageData, StageData, StageEffects]:
    """Stage with a held sun, the same with a floating one, and positions of the pins."""

    def hidden(name: str) -> float:
        return HIDDEN[name].at(rng.random())

    share = rng.uniform(*CLEARANCE)
    upwind, downwind = PUBLISHED_CLEARANCE
    floating = BearingData(upwind_clearance=share * upwind, downwind_clearance=share * downwind)
    low, high = np.log(QUILL)
    restrained = replace(
        floating,
        sun_radial=float(np.exp(rng.uniform(low, high))),
        sun_friction=rng.uniform(*FRICTION),
        sun_clearance=rng.uniform(*SPLINE_CLEARANCE),
    )
    mounting = MountingData(
        x=hidden("mounting_x"),
        axial_stiffness=hidden("mounting_axial"),
        tilt_stiffness=hidden("mounting_tilt"),
    )
    data = StageData(mesh=MeshData(n_slices=2), bearings=restrained, mounting=mounting)
    pins = StageEffects(pin_offset=tuple(rng.uniform(-_PIN, _PIN, 3).tolist()))
    return data, replace(data, bearings=floating), pins


def series(body: StageBody, data: StageData, effects: StageEffects) -> NDArray[np.float64]:
    """Series of the sensors' readings, zeroed at rest [m], shape (n_loads, n_sensors, n_terms)."""
    model = stage_model(body, data, effects=effects, speed=0.0)
    orders = np.array(
        [
            sensor_orders(
                model, quasi_static_turn(model, SteadyLoad(*load), _ANGLES), SENSORS
            ).amplitudes[:, : _HIGHEST_ORDER + 1]
            for load in ((0.0, 0.0, 0.0), *LOADS)
        ]
    )
    orders = orders[1:] - np.eye(1, orders.shape[2]) * orders[0]
    return cosines_and_sines(orders)


def cosines_and_sines(orders: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Constant, then cosine and sine amplitudes by order, along the last axis."""
    pairs = np.stack([orders.real, -orders.imag], axis=3).reshape(*orders.shape[:2], -1)
    return np.delete(pairs, 1, axis=2)


def held_sun_campaign(
    body: StageBody, seed: int, number: int
) -> tuple[SeriesCampaign, StageData, StageEffects]:
    """Draw a campaign; stages without an equilibrium are drawn again.

    Returns
    -------
    tuple of (SeriesCampaign, StageData, StageEffects)
        Records with their prediction, and the stage that predicts them.
    """
    rng = np.random.default_rng([seed, number])
    while True:
        restrained, floating, pins = drawn_data(rng)
        try:
            true, predicted = series(body, restrained, pins), series(body, floating, pins)
            break
        except NotConvergedError:
            continue
    made = series_campaign(
        f"held sun {number}", true, predicted, lambda _: FLOOR, rng, rng.spawn(1)[0]
    )
    return made, floating, pins


def held_sun(body: StageBody, seed: int, number: int) -> HeldSun:
    """Draw a campaign and diagnose it."""
    made, _, _ = held_sun_campaign(body, seed, number)
    problem = problem_of(made.campaign, default_curves())
    answer = diagnose(
        problem,
        campaign=made.campaign.name,
        kind="carrier",
        floor_is_measured=problem.noise_is_measured,
    )
    return HeldSun(made.gap / made.floor, answer.verdict, *named_and_tied(answer))


def named_and_tied(diagnosis: Diagnosis) -> tuple[Effects, Effects]:
    """Named laws, or classes where none is, and what cannot be told from them."""
    named = diagnosis.attribution.effects
    groups = diagnosis.attribution.aliases
    if diagnosis.classes:
        named = named or diagnosis.classes.ids
        groups = (*groups, *diagnosis.classes.ties)
    return named, tuple(dict.fromkeys(name for tied in groups for name in tied))


def held_sun_table(rows: Sequence[HeldSun]) -> list[str]:
    """Table of docs/stage_model.md."""
    gaps = np.array([row.gap for row in rows])
    shown = [row for row in rows if row.gap >= VISIBLE]
    lines = [
        f"| {len(rows)} campaigns, gap of {gaps.min():.1f} to {gaps.max():.1f} floors | |",
        "|---|---|",
        f"| two floors and more | {len(shown)} |",
    ]
    for outcome in (RIGHT, RIGHT_AMONG_OTHERS, OTHER, NONE):
        of = [row for row in shown if row.outcome == outcome]
        lines.append(f"| {outcome} | {len(of)} |")
    lines += ["", "| answer | verdict | campaigns |", "|---|---|---|"]
    answers = Counter((", ".join(row.named) or "-", row.verdict) for row in shown)
    lines += [f"| {named} | {verdict} | {n} |" for (named, verdict), n in answers.most_common()]
    return lines


def _write(body: StageBody, seed: int, number: int, path: Path) -> None:
    with single_threaded():
        row = held_sun(body, seed, number)
    save_json(path, row)


def _row(content: dict[str, Any]) -> HeldSun:
    named, ties = (tuple(content[name]) for name in ("named", "ties"))
    return HeldSun(content["gap"], content["verdict"], named, ties)


def main(
    *,
    out: Path,
    cases: int = 50,
    seed: int = 1,
    size: float = 0.06,
    workers: int = 1,
    quiet: bool = False,
) -> None:
    """Make and diagnose campaigns; write held_sun.md.

    Parameters
    ----------
    out
        Folder; campaigns that stand there are not made again.
    cases
        Campaigns.
    seed
        Seed.
    size
        Element edge length of carrier and pins [m]: the diagnosis has curves of another mesh.
    workers
        Processes.
    quiet
        Show no progress.
    """
    folder, stages = prepared_folder(out), Stages(2, quiet)
    with stages.stage(f"carrier and pins of {size} m"):
        body = default_stage_body(PAPER_STIFFNESS, size)
    rows = seeded_cases(
        folder, seed, cases, partial(_write, body, seed), _row, stages=stages, workers=workers
    )
    lines = held_sun_table(rows)
    write_table(folder / "held_sun.md", lines)
    print("\n".join(lines))


if __name__ == "__main__":
    import cyclopts

    cyclopts.run(main)
