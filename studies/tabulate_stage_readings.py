"""What the sensors of the whole planetary stage read, with and without its own effects.

Static equilibria over a turn under the six loads of the blind check's carrier, zeroed over a slow
turn at rest. The table is the blind check's truth "stage": it imports no simulation, so the
readings come along as a file, made by

    python -m studies.tabulate_stage_readings

A good table: a stage without an effect is the prediction, and each effect alone leaves more than a
few micrometres.
"""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.pins import PAPER_STIFFNESS
from carrierflex.simulation.stage.effects import StageEffects
from carrierflex.simulation.stage.quasi_static import quasi_static_turn, sensor_orders
from carrierflex.simulation.stage.stage_body import StageBody
from carrierflex.simulation.stage.stage_data import BearingData, MountingData, StageData
from carrierflex.simulation.stage.stage_model import stage_model
from carrierflex.simulation.stage.statics import SteadyLoad
from carrierflex.workflows.simulation.order_one_supports import clearances
from carrierflex.workflows.simulation.stage_bodies import default_stage_body
from carrierflex.workflows.simulation.study_order_one import SENSORS
from studies.case_files import write_table

#: Torque [N m], radial load along y and z [N] of each run.
LOADS = (
    (360e3, 0.0, 0.0), (180e3, 0.0, 0.0), (360e3, 0.0, -2e5), (360e3, 1e5, 1e5), (270e3, 0.0, 5e4),
    (90e3, -5e4, 0.0),
)  # fmt: skip
#: Element edge length of the shipped table [m]: the diagnosis has curves of another mesh.
TABLE_SIZE = 0.06
#: Orders of the table, and carrier angles of a turn.
HIGHEST_ORDER, _ANGLES = 7, 24
#: Supports by name: housing on its bushings; these stiff axially and at its centre; housing held;
#: a sun that is held, as a floating one shares the load wherever the pins stand.
_SUPPORTS = {
    "free": ({}, {}),
    "stiff": ({"axial_stiffness": 20.2e6, "x": 0.5}, {}),
    "held": (dict.fromkeys(("radial_stiffness", "axial_stiffness", "tilt_stiffness"), 1e13), {}),
    "sun held": ({}, {"sun_radial": 1e9}),
}  # fmt: skip
#: Carrier angle of the kink's axis [rad].
_AXIS = 1.0


@dataclass(frozen=True, eq=False)
class StageTruth:
    """A stage and what departs from it.

    Parameters
    ----------
    support : str
        Support of housing and sun.
    sizes : mapping of str to float
        Size by effect id: share of the published clearances, kink [rad], play of the pins [rad],
        place of pin 1 [m], motion of the flange at full torque [m].
    """

    support: str
    sizes: dict[str, float] = field(default_factory=dict)

    def data(self) -> StageData:
        """Stage with these clearances."""
        mounting, bearings = _SUPPORTS[self.support]
        loose = clearances(self.sizes.get("bearing_clearance", 0.0))
        return StageData(
            bearings=BearingData(**bearings, **loose), mounting=MountingData(**mounting)
        )

    def effects(self) -> StageEffects:
        """What departs from the nominal stage."""
        size = self.sizes.get
        flange = size("ring_pass", 0.0) / 360e3
        return StageEffects(
            phi_PLC=size("carrier_tilt", 0.0),
            theta_PLC=_AXIS,
            pin_offset=(size("unequal_load_sharing", 0.0), 0.0, 0.0),
            pin_fit_play=size("pin_clearance", 0.0),
            ring_pass_offset=(0.6 * flange, 0.2 * flange),
            ring_pass_tilt=tuple(np.array([0.5, 0.0, 0.0, 0.5]) * flange / 0.412),
        )


_SINGLES = {
    "bearing_clearance": (("free", 0.5), ("free", 1.0), ("stiff", 1.0)),
    "carrier_tilt": (("held", 0.2e-3), ("held", 0.58e-3), ("held", 1.2e-3)),
    "pin_clearance": (("free", 0.25e-3), ("free", 0.5e-3), ("free", 0.75e-3)),
    "unequal_load_sharing": (
        ("sun held", 50e-6),
        ("sun held", 150e-6),
        ("sun held", 400e-6),
    ),
    "ring_pass": (("free", 10e-6), ("free", 30e-6), ("free", 60e-6)),
}
#: Pairs with their support. A pin out of place and a kink make one signal, and clearances beside a
#: held sun another one than beside a floating one: they are no pairs.
_PAIRS = {
    ("bearing_clearance", "carrier_tilt"): "stiff",
    ("bearing_clearance", "pin_clearance"): "free",
    ("bearing_clearance", "ring_pass"): "free",
    ("carrier_tilt", "pin_clearance"): "held",
    ("carrier_tilt", "ring_pass"): "held",
    ("pin_clearance", "ring_pass"): "free",
    ("unequal_load_sharing", "pin_clearance"): "sun held",
    ("unequal_load_sharing", "ring_pass"): "sun held",
}
_PAIR_SIZES = {
    "bearing_clearance": 0.5, "carrier_tilt": 0.58e-3, "pin_clearance": 0.5e-3,
    "unequal_load_sharing": 150e-6, "ring_pass": 30e-6,
}  # fmt: skip


def stage_truths() -> dict[str, StageTruth]:
    """Stages by name: nominal ones, each effect at three sizes, and pairs."""
    truths = {f"nominal {support}": StageTruth(support) for support in _SUPPORTS}
    for effect, cases in _SINGLES.items():
        for number, (support, size) in enumerate(cases, start=1):
            truths[f"{effect} {number}"] = StageTruth(support, {effect: size})
    for pair, support in _PAIRS.items():
        sizes = {effect: _PAIR_SIZES[effect] for effect in pair}
        truths[" + ".join(sorted(pair))] = StageTruth(support, sizes)
    return truths


def readings(body: StageBody, truth: StageTruth) -> NDArray[np.complex128]:
    """Orders of the sensors' signals [m], shape (n_loads, n_sensors, n_orders), zeroed at rest."""
    model = stage_model(body, truth.data(), effects=truth.effects(), speed=0.0)
    at_rest, *loaded = (
        sensor_orders(
            model, quasi_static_turn(model, SteadyLoad(torque, y, z), _ANGLES), SENSORS
        ).amplitudes[:, : HIGHEST_ORDER + 1]
        for torque, y, z in ((0.0, 0.0, 0.0), *LOADS)
    )
    signals = np.array(loaded)
    signals[:, :, 0] -= at_rest[:, 0]
    return signals


def main(*, out: Path, size: float = TABLE_SIZE) -> dict[str, StageTruth]:
    """Write the table of readings.

    Parameters
    ----------
    out
        CSV file.
    size
        Element edge length of carrier and pins [m].
    """
    body, truths = default_stage_body(PAPER_STIFFNESS, size), stage_truths()
    columns = ["c0", *(f"{name}{n}" for n in range(1, HIGHEST_ORDER + 1) for name in "cs")]
    lines = [
        "# Readings of four axial sensors of the planetary stage under six loads, zeroed at rest.",
        "# s = c0 + sum over n of cn cos(n theta) + sn sin(n theta), theta the carrier angle; nm.",
        f"# Elements of {size} m; studies.tabulate_stage_readings",
        ",".join(["case", "support", "run", "sensor", *columns]),
    ]
    for name, truth in truths.items():
        for run, sensors in enumerate(readings(body, truth), start=1):
            for sensor, orders in zip(SENSORS, sensors, strict=True):
                pairs = np.stack([orders.real, -orders.imag], axis=1).ravel()
                cells = np.delete(pairs, 1) * 1e9
                row = [name, truth.support, str(run), sensor.name, *(f"{v:.0f}" for v in cells)]
                lines.append(",".join(row))
    write_table(out, lines)
    return truths


if __name__ == "__main__":
    main(out=Path(__file__).parents[1] / "blind_check" / "data" / "stage_readings.csv")
