"""Main shaft, carrier and housing of the planetary stage in the hands of Exudyn.

Rigid bodies with large rotations in the fixed frame, springs between them and Exudyn's own
integrator: of this project it takes numbers alone (the stiffness of the shaft's ends among them),
no equation. Gears are left out: a floating sun makes their forces equal, so that they hold neither
tilt nor shift of the carrier.

Positions are along the carrier's axis x from the rim's face, y and z across it, z up.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import exudyn as exu
import numpy as np
from exudyn.itemInterface import (
    CartesianSpringDamper,
    Force,
    MarkerBodyPosition,
    MarkerBodyRigid,
    NodeRigidBodyRxyz,
    ObjectConnectorRigidBodySpringDamper,
    ObjectGround,
    RigidBody,
    SensorNode,
    Torque,
)
from numpy.typing import NDArray

Array = NDArray[np.float64]
_GRAVITY = 9.81


@dataclass(frozen=True, eq=False)
class RigidMass:
    """Mass [kg] at x [m], inertia about the axis and across it at its centre [kg m^2]."""

    mass: float
    x: float
    polar: float
    transverse: float


@dataclass(frozen=True, eq=False)
class CarrierBearing:
    """Bearing of the carrier in the housing.

    Parameters
    ----------
    x : float
        [m].
    axial, radial : float
        Stiffness [N/m].
    clearance : float
        Radial clearance [m].
    """

    x: float
    axial: float
    radial: float
    clearance: float


@dataclass(frozen=True, eq=False)
class StageMounting:
    """Numbers of the model.

    Parameters
    ----------
    shaft, carrier, housing : sequence of RigidMass
        Masses that move with the shaft's upwind end, with the carrier and with the housing.
    main_bearing_x, joint_x : float
        Ends of the main shaft [m].
    shaft_stiffness : ndarray, shape (6, 6)
        Of the shaft's downwind end with its upwind end clamped: x, y, z, then rotations.
    kink : ndarray, shape (2,)
        Rotation of the carrier against the shaft's end about y and z, turning with it [rad].
    main_bearing : ndarray, shape (3,)
        Stiffness along x, y, z [N/m].
    bearings : sequence of CarrierBearing
        Bearings of the carrier in the housing.
    bushing : ndarray, shape (3,)
        Stiffness of one bushing along x, y, z [N/m].
    bushing_damping : ndarray, shape (3,)
        [N s/m].
    bushing_x, bushing_arm : float
        Bushings at y = +-arm [m].
    torque, reaction : float
        On the shaft's upwind end, and on the housing [N m].
    radial_load, radial_load_x : float
        Force along z on the shaft [N], and where [m].
    speed : float
        [rad/s].
    """

    shaft: tuple[RigidMass, ...]
    carrier: tuple[RigidMass, ...]
    housing: tuple[RigidMass, ...]
    main_bearing_x: float
    joint_x: float
    shaft_stiffness: Array
    kink: Array
    main_bearing: Array
    bearings: tuple[CarrierBearing, ...]
    bushing: Array
    bushing_damping: Array
    bushing_x: float
    bushing_arm: float
    torque: float
    reaction: float
    radial_load: float
    radial_load_x: float
    speed: float


@dataclass(frozen=True, eq=False)
class RelativeMotion:
    """Motion of the rim against the housing over time.

    Parameters
    ----------
    carrier_angle : ndarray, shape (n,)
        [rad].
    axial : ndarray, shape (n,)
        [m].
    slope_y, slope_z : ndarray, shape (n,)
        Of the carrier's axis less the housing's, along y and z [rad].
    """

    carrier_angle: Array
    axial: Array
    slope_y: Array
    slope_z: Array

    def axial_signal(self, angle: float, radius: float) -> Array:
        """What a sensor at the housing angle `angle` [rad] and `radius` [m] reads [m], shape (n,).

        A plane that its normal tilts by (s_y, s_z) moves by ``-s_y y - s_z z`` along x.
        """
        y, z = -radius * np.sin(angle), radius * np.cos(angle)
        return np.asarray(self.axial - self.slope_y * y - self.slope_z * z)


def exudyn_stage(
    data: StageMounting, *, duration: float, step: float, bearing_damping: float = 2e5
) -> RelativeMotion:
    """Motion from the unloaded state on, by Exudyn's generalised-alpha.

    Parameters
    ----------
    data : StageMounting
        Numbers.
    duration, step : float
        [s].
    bearing_damping : float
        Of main and carrier bearings in contact [N s/m]; about 2 % of critical. It ends the fall
        onto the bearings and shows no more once that is over.
    """
    system = exu.SystemContainer().AddSystem()
    ground = system.AddObject(ObjectGround())
    shaft = _added(system, data.shaft, data.main_bearing_x, data.speed)
    carrier = _added(system, data.carrier, 0.0, data.speed)
    housing = _added(system, data.housing, 0.0, 0.0)

    def at(body: Any, origin: float, x: float, y: float = 0.0) -> Any:
        return system.AddMarker(
            MarkerBodyPosition(bodyNumber=body, localPosition=[x - origin, y, 0.0])
        )

    upwind = data.main_bearing_x
    damped = [bearing_damping] * 3
    system.AddObject(
        CartesianSpringDamper(
            markerNumbers=[at(ground, 0.0, upwind), at(shaft.body, upwind, upwind)],
            stiffness=list(data.main_bearing),
            damping=damped,
        )
    )
    _add_shaft_spring(system, data, shaft.body, carrier.body)
    functions = []  # Exudyn holds no reference to them
    for bearing in data.bearings:
        markers = [at(housing.body, 0.0, bearing.x), at(carrier.body, 0.0, bearing.x)]
        item = CartesianSpringDamper(markerNumbers=markers, stiffness=[0.0] * 3, damping=damped)
        item.springForceUserFunction = _bearing_law(bearing, bearing_damping)
        functions.append(item.springForceUserFunction)
        system.AddObject(item)
    for y in (-data.bushing_arm, data.bushing_arm):
        markers = [at(ground, 0.0, data.bushing_x, y), at(housing.body, 0.0, data.bushing_x, y)]
        system.AddObject(
            CartesianSpringDamper(
                markerNumbers=markers,
                stiffness=list(data.bushing),
                damping=list(data.bushing_damping),
            )
        )
    for body, torque in (
        (shaft.body, data.torque),
        (carrier.body, -data.torque),
        (housing.body, data.reaction),
    ):
        marker = system.AddMarker(MarkerBodyRigid(bodyNumber=body))
        system.AddLoad(Torque(markerNumber=marker, loadVector=[torque, 0.0, 0.0]))
    system.AddLoad(
        Force(
            markerNumber=at(shaft.body, upwind, data.radial_load_x),
            loadVector=[0.0, 0.0, data.radial_load],
        )
    )
    of_carrier, of_housing = _solved(system, (carrier.node, housing.node), duration, step)
    slopes = _axis_slopes(of_carrier) - _axis_slopes(of_housing)
    return RelativeMotion(
        of_carrier[:, 3], of_carrier[:, 0] - of_housing[:, 0], slopes[:, 0], slopes[:, 1]
    )


@dataclass(frozen=True, eq=False)
class _Added:
    """Numbers of a body and its node."""

    body: Any
    node: Any


def _added(system: Any, masses: tuple[RigidMass, ...], origin: float, speed: float) -> _Added:
    """Rigid body of some masses, its reference point at `origin`, turning at `speed` [rad/s]."""
    mass = sum(rigid.mass for rigid in masses)
    centre = sum(rigid.mass * (rigid.x - origin) for rigid in masses) / mass
    polar = sum(rigid.polar for rigid in masses)
    across = sum(rigid.transverse + rigid.mass * (rigid.x - origin) ** 2 for rigid in masses)
    node = system.AddNode(
        NodeRigidBodyRxyz(
            referenceCoordinates=[origin, 0.0, 0.0, 0.0, 0.0, 0.0],
            initialVelocities=[0.0, 0.0, 0.0, speed, 0.0, 0.0],
        )
    )
    body = system.AddObject(
        RigidBody(
            nodeNumber=node,
            physicsMass=mass,
            physicsInertia=[polar, across, across, 0.0, 0.0, 0.0],
            physicsCenterOfMass=[centre, 0.0, 0.0],
        )
    )
    at_centre = system.AddMarker(
        MarkerBodyPosition(bodyNumber=body, localPosition=[centre, 0.0, 0.0])
    )
    system.AddLoad(Force(markerNumber=at_centre, loadVector=[0.0, 0.0, -mass * _GRAVITY]))
    return _Added(body, node)


def _add_shaft_spring(system: Any, data: StageMounting, shaft: Any, carrier: Any) -> None:
    """Shaft between its upwind end, prolonged as a rigid body to the joint, and the carrier."""
    prolonged = [data.joint_x - data.main_bearing_x, 0.0, 0.0]
    markers = [
        system.AddMarker(MarkerBodyRigid(bodyNumber=shaft, localPosition=prolonged)),
        system.AddMarker(
            MarkerBodyRigid(bodyNumber=carrier, localPosition=[data.joint_x, 0.0, 0.0])
        ),
    ]
    system.AddObject(
        ObjectConnectorRigidBodySpringDamper(
            markerNumbers=markers,
            stiffness=data.shaft_stiffness,
            damping=np.zeros((6, 6)),
            offset=[0.0, 0.0, 0.0, 0.0, *data.kink],
        )
    )


def _bearing_law(bearing: CarrierBearing, damping: float) -> Callable[..., list[float]]:
    """Force of the carrier on the housing: ``k max(|r| - c, 0)`` along the radial motion r."""

    def force(
        mbs: Any, t: float, item: int, u: Any, v: Any, k: Any, d: Any, offset: Any
    ) -> list[float]:
        axial = bearing.axial * u[0]
        radius = float(np.hypot(u[1], u[2]))
        if radius <= bearing.clearance:
            return [axial, 0.0, 0.0]
        share = 1.0 - bearing.clearance / radius
        radial = bearing.radial * share
        return [axial, radial * u[1] + damping * v[1], radial * u[2] + damping * v[2]]

    return force


def _solved(system: Any, nodes: tuple[Any, ...], duration: float, step: float) -> list[Array]:
    """Coordinates of every node over time, shape (n, 6): displacements, then angles."""
    output = exu.OutputVariableType.Coordinates
    sensors = [
        system.AddSensor(SensorNode(nodeNumber=node, storeInternal=True, outputVariableType=output))
        for node in nodes
    ]
    system.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.endTime = duration
    settings.timeIntegration.numberOfSteps = round(duration / step)
    settings.timeIntegration.verboseMode = 0
    settings.timeIntegration.generalizedAlpha.spectralRadius = 0.6
    settings.timeIntegration.newton.useModifiedNewton = True
    settings.solutionSettings.writeSolutionToFile = False
    settings.solutionSettings.sensorsWritePeriod = step
    settings.parallel.numberOfThreads = 1
    system.SolveDynamic(settings)
    return [np.asarray(system.GetSensorStoredData(sensor))[:, 1:] for sensor in sensors]


def _axis_slopes(coordinates: Array) -> Array:
    """Slope of a body's x axis along y and z of the fixed frame, shape (n, 2).

    Of ``Rx(a) Ry(b) Rz(c) e_x``.
    """
    a, b, c = coordinates[:, 3:].T
    along_y = np.cos(a) * np.sin(c) + np.sin(a) * np.sin(b) * np.cos(c)
    along_z = np.sin(a) * np.sin(c) - np.cos(a) * np.sin(b) * np.cos(c)
    return np.stack([along_y, along_z], axis=1)
