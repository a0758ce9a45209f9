"""The mounting in the hands of Exudyn, in two forms: with bodies, and our condensed equations."""

import time
from collections.abc import Callable
from typing import Any

import exudyn as exu
import numpy as np
from exudyn.advancedUtilities import CreateSymbolicUserFunction
from exudyn.itemInterface import (
    CartesianSpringDamper,
    CoordinateConstraint,
    CoordinateSpringDamper,
    Force,
    LoadCoordinate,
    MarkerBodyPosition,
    MarkerBodyRigid,
    MarkerNodeCoordinate,
    NodeGenericODE2,
    NodePointGround,
    NodeRigidBodyRxyz,
    ObjectGenericODE2,
    ObjectGround,
    RigidBody,
    SensorNode,
    Torque,
)

from benchmarks.mounting_cases import (
    RADIAL,
    TORQUE,
    Array,
    element_coordinates,
    has_nonlinear_stiffness,
)
from carrierflex.simulation.mounting.equations import mounting_blocks
from carrierflex.simulation.mounting.parameter_arrays import ParameterArray
from carrierflex.simulation.mounting.parameters import INDEX
from carrierflex.simulation.mounting.rig import MountingRig


def exudyn_equations(
    rig: MountingRig, parameters: ParameterArray, times: Array, step: float, solver: Any
) -> tuple[Array, float]:
    """Sensor signals and wall seconds of our condensed equations: two coordinates, nothing else."""
    M, C, K, G, law, to_signals = element_coordinates(rig, parameters)
    system = exu.SystemContainer().AddSystem()
    zero = [0.0] * 2
    node = system.AddNode(
        NodeGenericODE2(
            referenceCoordinates=zero,
            initialCoordinates=zero,
            initialCoordinates_t=zero,
            numberOfODE2Coordinates=2,
        )
    )
    system.AddObject(
        ObjectGenericODE2(nodeNumbers=[node], massMatrix=M, stiffnessMatrix=K, dampingMatrix=C)
    )
    ground = _ground_coordinate(system)
    functions: list[Any] = []  # Exudyn holds no reference to them
    for coordinate in range(2):
        marker = system.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate))
        if has_nonlinear_stiffness(parameters):
            functions.append(_add_spring(system, [ground, marker], law))
        for formula, amplitude in ((_torque, TORQUE), (_radial, RADIAL)):
            column = 0 if formula is _torque else 1
            load = system.AddLoad(
                LoadCoordinate(markerNumber=marker, load=amplitude * G[coordinate, column])
            )
            function = CreateSymbolicUserFunction(system, formula, "loadUserFunction", load)
            system.SetLoadParameter(load, "loadUserFunction", function)
            functions.append(function)
    record, seconds = _solved(system, node, times, step, solver)
    return record[:, 1:3] @ to_signals.T, seconds


def _add_spring(system: Any, markers: list[Any], law: Array) -> Any:
    """Spring of third and fifth order between two coordinates; its function, to be kept."""

    def force(
        mbs: Any, t: Any, itemNumber: Any, u: Any, v: Any, k: Any, d: Any, offset: Any
    ) -> Any:
        return k * u * u * u + d * u * u * u * u * u

    K3, K5 = float(law[0]), float(law[1])
    item = system.AddObject(CoordinateSpringDamper(markerNumbers=markers, stiffness=K3, damping=K5))
    function = CreateSymbolicUserFunction(system, force, "springForceUserFunction", item)
    system.SetObjectParameter(item, "springForceUserFunction", function)
    return function


def exudyn_bodies(
    rig: MountingRig,
    parameters: ParameterArray,
    times: Array,
    step: float,
    solver: Any,
    loads: tuple[Array, Array] | None = None,
) -> tuple[Array, float]:
    """Sensor signals and wall seconds of the mounting as Exudyn's user would build it.

    One rigid body for all that pitches and yaws, held at the main bearing, on two Cartesian
    spring-dampers. Loads are the formulas, or `loads` (torque [N m], ntl_z [N]) at `times`.
    """
    system = exu.SystemContainer().AddSystem()
    zero = [0.0] * 6
    node = system.AddNode(NodeRigidBodyRxyz(referenceCoordinates=zero, initialVelocities=zero))
    body = _add_body(system, rig, parameters, node)
    fixed = _ground_coordinate(system)
    for coordinate in range(3):
        marker = system.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate))
        system.AddObject(CoordinateConstraint(markerNumbers=[fixed, marker]))
    functions = _add_bushings(system, rig, parameters, body)  # Exudyn holds no reference to them
    hub_position = [-rig.coupling_arm, 0.0, 0.0]
    hub = system.AddMarker(MarkerBodyRigid(bodyNumber=body, localPosition=hub_position))
    share = 1.0 - 1.0 / rig.gear_ratio
    name = "loadVectorUserFunction"
    for number, (kind, direction, size, formula) in enumerate(
        ((Torque, 0, TORQUE * share, _torque), (Force, 2, RADIAL, _radial))
    ):
        amplitude = np.zeros(3)
        amplitude[direction] = size if loads is None else (share, 1.0)[number]
        load = system.AddLoad(kind(markerNumber=hub, loadVector=amplitude))
        if loads is None:
            function = CreateSymbolicUserFunction(system, formula, name, load)
        else:
            function = _looked_up(times, loads[number])
        system.SetLoadParameter(load, name, function)
        functions.append(function)
    record, seconds = _solved(system, node, times, step, solver)
    vertical, _ = mounting_blocks(rig, parameters)
    return record[:, 4:6] @ vertical.output.T, seconds


def _add_body(system: Any, rig: MountingRig, parameters: ParameterArray, node: Any) -> Any:
    """The rigid body of housing, shaft and coupling."""
    vertical, horizontal = mounting_blocks(rig, parameters)
    inertia = [vertical.M[0, 0], vertical.M[1, 1], horizontal.M[0, 0], 0.0, 0.0, 0.0]
    mass = rig.housing_mass + rig.shaft_mass + rig.coupling_mass
    housing = rig.housing_mass * (rig.housing_cg_x + rig.main_bearing_x)
    shaft = rig.shaft_mass * (rig.shaft_cg_x + rig.main_bearing_x)
    centre = (housing + shaft - rig.coupling_mass * rig.coupling_arm) / mass
    return system.AddObject(
        RigidBody(
            nodeNumber=node,
            physicsMass=mass,
            physicsInertia=inertia,
            physicsCenterOfMass=[centre, 0.0, 0.0],
        )
    )


def _add_bushings(
    system: Any, rig: MountingRig, parameters: ParameterArray, body: Any
) -> list[Any]:
    """Both bushings between the body and the ground; the functions of their force."""
    ground = system.AddObject(ObjectGround())
    law = _bushing_law(parameters)
    functions = []
    k = [parameters[INDEX["k_x"]]] + [parameters[INDEX["K1"]]] * 2
    d = [parameters[INDEX["c_x"]]] + [parameters[INDEX["C1"]]] * 2
    for y in (rig.R_x, -rig.R_x):
        position = [rig.main_bearing_x, y, 0.0]
        markers = [
            system.AddMarker(MarkerBodyPosition(bodyNumber=b, localPosition=position))
            for b in (ground, body)
        ]
        item = system.AddObject(
            CartesianSpringDamper(markerNumbers=markers, stiffness=k, damping=d)
        )
        if has_nonlinear_stiffness(parameters):
            function = CreateSymbolicUserFunction(system, law, "springForceUserFunction", item)
            system.SetObjectParameter(item, "springForceUserFunction", function)
            functions.append(function)
    return functions


def _torque(mbs: Any, t: Any, load: Any) -> Any:
    """``mounting_cases.torque_at`` in Exudyn's symbols, which take numbers and no names."""
    rise = 0.5 * (1.0 + exu.symbolic.tanh(t - 10.0))
    return load * (rise * (1.0 + 0.05 * exu.symbolic.sin(12.566370614359172 * t)))


def _radial(mbs: Any, t: Any, load: Any) -> Any:
    """``mounting_cases.radial_at`` in Exudyn's symbols."""
    rise = 0.5 * (1.0 + exu.symbolic.tanh((t - 5.0) * 2.0))
    return load * (rise * (1.0 + 0.02 * exu.symbolic.sin(2.324778563656447 * t)))


def _bushing_law(parameters: ParameterArray) -> Callable[..., Any]:
    """Spring force of a bushing; the constants stand in it as numbers."""
    K3, K5 = float(parameters[INDEX["K3"]]), float(parameters[INDEX["K5"]])

    def force(
        mbs: Any, t: Any, itemNumber: Any, u: Any, v: Any, k: Any, d: Any, offset: Any
    ) -> Any:
        return [
            k[0] * u[0] + d[0] * v[0],
            k[1] * u[1]
            + d[1] * v[1]
            + K3 * u[1] * u[1] * u[1]
            + K5 * u[1] * u[1] * u[1] * u[1] * u[1],
            k[2] * u[2]
            + d[2] * v[2]
            + K3 * u[2] * u[2] * u[2]
            + K5 * u[2] * u[2] * u[2] * u[2] * u[2],
        ]

    return force


def _looked_up(times: Array, values: Array) -> Callable[..., Any]:
    """Load in Python that reads a measured record, as Exudyn needs it: it has no table."""
    step = float(times[1] - times[0])
    table = [*map(float, values), float(values[-1])]

    def factor(t: float) -> float:
        position = min(t / step, len(table) - 2)
        before = int(position)
        return table[before] + (table[before + 1] - table[before]) * (position - before)

    def vector(mbs: Any, t: float, load: Any) -> list[float]:
        f = factor(t)
        return [f * load[0], f * load[1], f * load[2]]

    return vector


def _ground_coordinate(system: Any) -> Any:
    node = system.AddNode(NodePointGround(referenceCoordinates=[0.0] * 3))
    return system.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=0))


def _solved(system: Any, node: Any, times: Array, step: float, solver: Any) -> tuple[Array, float]:
    """Time and coordinates of the node row by row, and the wall seconds of the solver alone."""
    output = exu.OutputVariableType.Coordinates
    sensor = system.AddSensor(
        SensorNode(nodeNumber=node, storeInternal=True, outputVariableType=output)
    )
    system.Assemble()
    settings = _settings(times, step)
    start = time.perf_counter()
    system.SolveDynamic(settings, solverType=solver)
    seconds = time.perf_counter() - start
    return system.GetSensorStoredData(sensor), seconds


def _settings(times: Array, step: float) -> Any:
    settings = exu.SimulationSettings()
    settings.timeIntegration.endTime = float(times[-1])
    settings.timeIntegration.numberOfSteps = round(times[-1] / step)
    settings.timeIntegration.verboseMode = 0
    settings.timeIntegration.generalizedAlpha.spectralRadius = 0.9
    settings.timeIntegration.newton.useModifiedNewton = True
    settings.solutionSettings.writeSolutionToFile = False
    settings.displayComputationTime = False
    settings.displayStatistics = False
    settings.solutionSettings.sensorsWritePeriod = max(float(times[1] - times[0]), step)
    settings.timeIntegration.explicitIntegration.eliminateConstraints = True
    settings.parallel.numberOfThreads = 1
    return settings
