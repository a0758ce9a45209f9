"""What an elastic ring moves at the proximity sensors, which stand on the housing.

    python -m studies.tabulate_elastic_ring --out elastic_ring

writes elastic_ring.md: orders 3 and 6 and the static saddle of sensors that stand on the ring,
over its thickness, covers and torque arms, beside the carrier's. A good answer says whether the
paper's "one order of magnitude smaller" holds, and whether the ring can make the saddle that its
tables 4 and 5 leave.
"""

from collections.abc import Iterable
from dataclasses import astuple, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.parameters import GearData
from carrierflex.geometry.pins import pin_angles
from carrierflex.identification.carrier.printed_tables import FULL_TORQUE, SENSOR_RADIUS
from carrierflex.simulation.stage.gear_meshes import flank_line
from carrierflex.simulation.stage.stage_data import MountingData, StageData
from carrierflex.workflows.outputs import prepared_folder
from carrierflex.workflows.papers.gap_posterior import ALL_SENSORS
from carrierflex.workflows.simulation.study_order_one import SENSORS
from studies.case_files import write_table
from studies.elastic_ring import PointForce, PointSpring, Ring, RingSection, ring_on_springs

#: Highest harmonic: the sensors' orders change by less than 0.1 % beyond.
HIGHEST = 40
#: Carrier angles of a turn, and points of a load that a flange brings in all around.
_ANGLES, _AROUND = 96, 96
#: Plane of the sensors upwind of the ring's middle: its face [m].
_UPWIND = -0.115
#: Trunnions downwind of the ring's middle, as in the stage: chosen, not published [m].
_ARM_X = MountingData.x - StageData().ring.x
#: Vertical load on the carrier's bearings of 200 kN at the hub [N]: 1.22 m upwind of the main
#: bearing, 2.1 m in front of the gearbox.
_BEARING_LOAD = 200e3 * 1.22 / 2.1
#: Axial springs in place of the carrier's bearings, small beside the ring [N/m].
_HOLD = 1e5
#: In-plane stiffness E t / R of a closed plate of cast iron, 15 mm (GRC: wall of the rear
#: housing) [N/m^2], and of one with a tenth of it left.
_PLATE = 169e9 * 0.015 / 0.553
_OPEN_PLATE = 0.1 * _PLATE


@dataclass(frozen=True)
class RingCase:
    """A ring, its torque arms and where teeth press."""

    name: str
    section: RingSection
    arm_x: float = _ARM_X
    """Trunnions downwind of the ring's middle [m]."""
    arm_height: float = 0.0
    """Trunnions above the axis [m]."""
    mesh_x: float = 0.0
    """Middle of the teeth's pressure downwind of the ring's middle [m]."""


_FREE, _OPEN, _CLOSED = (RingSection(cover_stiffness=k) for k in (0.0, _OPEN_PLATE, _PLATE))
_FURTHER = _ARM_X - 0.2
CASES = (
    RingCase("free ring, 60 mm", _FREE),
    RingCase("50 mm", RingSection(outer_diameter=1.147)),
    RingCase("66 mm", RingSection(outer_diameter=1.180)),
    RingCase("60 mm, teeth press 20 mm upwind", _FREE, mesh_x=-0.02),
    RingCase("60 mm, arms in the ring's middle", _FREE, arm_x=0.0),
    RingCase("60 mm, arms 0.2 m further upwind", _FREE, arm_x=_FURTHER),
    RingCase("covers with a tenth of a closed plate", _OPEN),
    RingCase("the same, arms 0.2 m further upwind", _OPEN, arm_x=_FURTHER),
    RingCase("the same, arms 157.5 mm above the axis", _OPEN, arm_height=0.1575),
    RingCase("closed covers", _CLOSED),
    RingCase("the same, arms 0.2 m further upwind", _CLOSED, arm_x=_FURTHER),
)


@dataclass(frozen=True)
class RingRow:
    """What sensors on the ring read of its bending [m]."""

    ring: str
    axial_3: float
    axial_6: float
    radial_3: float
    torque_saddle: float
    load_saddle: float


def planet_forces(
    gear: GearData, torque: float, angle: float, x: float, R: float
) -> list[PointForce]:
    """Forces of the planets on a ring at a carrier angle.

    Along the normal of the drive flanks, tangentially half of the pin load ``T / (3 a)``.

    Parameters
    ----------
    gear : GearData
        Teeth.
    torque : float
        Of the carrier [N m].
    angle : float
        Carrier angle [rad].
    x : float
        Middle of the pressure from the ring's middle [m].
    R : float
        Radius of the ring's middle [m].
    """
    line = flank_line("ring", 1, gear, 3, x=0.0, coast=False, gap=0.0)
    # Planet 1 stands on z, so that r is z and t is -y.
    n_x, n_r, n_t = -line.normal * [1.0, -1.0, 1.0] @ np.eye(3)[:, [0, 2, 1]]
    force = torque / (6.0 * gear.centre_distance) / n_t
    along = (float(force * n_x), float(force * n_r), float(force * n_t))
    at = float(line.point[2]) - R
    return [PointForce(angle + float(pin), along, x, at) for pin in pin_angles(3)]


def all_around(axial: float, around: float, vertical: float) -> list[PointForce]:
    """Forces that a flange spreads evenly: along x, around and along z, their sums [N]."""
    angles = 2.0 * np.pi * np.arange(_AROUND) / _AROUND
    return [
        PointForce(
            float(angle),
            (
                axial / _AROUND,
                vertical / _AROUND * float(np.cos(angle)),
                (around - vertical * float(np.sin(angle))) / _AROUND,
            ),
        )
        for angle in angles
    ]


def ring_of(case: RingCase, mounting: MountingData, highest: int = HIGHEST) -> Ring:
    """The ring of a case on its torque arms."""
    R = case.section.radius
    springs = [
        PointSpring(
            float(np.arctan2(-y, case.arm_height)),
            (mounting.axial_stiffness, mounting.radial_stiffness, mounting.radial_stiffness),
            case.arm_x,
            float(np.hypot(y, case.arm_height)) - R,
        )
        for y in (mounting.arm, -mounting.arm)
    ]
    # The carrier's bearings keep the housing from turning about both arms.
    springs += [PointSpring(angle, (_HOLD, 0.0, 0.0)) for angle in (0.0, np.pi)]
    return ring_on_springs(case.section, springs, highest)


def readings(
    case: RingCase, torque: float, load: float, highest: int = HIGHEST
) -> NDArray[np.float64]:
    """What sensors on the ring's upwind face read of its bending over a turn [m].

    Shape (n_angles, 6): the rim less the sensor, four axial sensors and two radial ones.

    Parameters
    ----------
    case : RingCase
        The ring.
    torque : float
        Of the carrier [N m].
    load : float
        Vertical load on the carrier's bearings [N].
    highest : int
        Highest harmonic of the ring.
    """
    R = case.section.radius
    turn = [
        planet_forces(GearData(), torque, float(angle), case.mesh_x, R)
        for angle in 2.0 * np.pi * np.arange(_ANGLES) / _ANGLES
    ]
    axial = sum(at.force[0] for at in turn[0])
    of_ring = sum(at.force[2] * (R + at.r) for at in turn[0])
    # Through the flange: the sun's thrust and the torque of the parallel stages.
    even = all_around(-axial, (torque - of_ring) / R, load)
    ring = ring_of(case, MountingData(), highest)
    answers = ring.answer([*turn, even])
    q = answers[:, :-1] + answers[:, -1:]
    signals = [
        -ring.motion(q, sensor.angle, _UPWIND, SENSOR_RADIUS - R)[0 if sensor in SENSORS else 1]
        for sensor in ALL_SENSORS
    ]
    return np.stack(signals, axis=1)


def ring_row(case: RingCase) -> RingRow:
    """Orders and saddles of a case at full torque."""
    turn, loaded = readings(case, FULL_TORQUE, 0.0), readings(case, 0.0, _BEARING_LOAD)
    order = 2.0 * np.abs(np.fft.rfft(turn, axis=0)) / _ANGLES
    n = len(SENSORS)
    by_torque, by_load = (
        of[:, :n].mean(axis=0) @ (1.0, -1.0, 1.0, -1.0) / n for of in (turn, loaded)
    )
    return RingRow(
        case.name,
        float(order[3, :n].mean()),
        float(order[6, :n].mean()),
        float(order[3, n:].mean()),
        float(by_torque),
        float(by_load),
    )


def ring_table(rows: Iterable[RingRow]) -> list[str]:
    """Table of docs/papers.md."""
    lines = [
        "| ring | order 3, axial [um] | order 6, axial [um] | order 3, radial [um] | "
        "saddle by 360 kN m [um] | saddle by 200 kN at the hub [um] |",
        "|---|---|---|---|---|---|",
    ]
    for row in rows:
        # Plus 0.0: no minus before a zero.
        numbers = (f"{round(1e6 * value, 1) + 0.0:.1f}" for value in astuple(row)[1:])
        lines.append(f"| {row.ring} | {' | '.join(numbers)} |")
    return lines


def main(*, out: Path) -> None:
    """Write elastic_ring.md.

    Parameters
    ----------
    out
        Folder.
    """
    folder = prepared_folder(out)
    write_table(folder / "elastic_ring.md", ring_table(ring_row(case) for case in CASES))


if __name__ == "__main__":
    import cyclopts

    cyclopts.run(main)
