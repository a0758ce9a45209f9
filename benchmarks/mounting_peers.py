"""The mounting in the hands of scipy's solve_ivp and of Exudyn.

The same equations, in the form each is fastest with.
"""

import time

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
from scipy.integrate import solve_ivp

from carrierflex.simulation.mounting.equations import mounting_blocks
from carrierflex.simulation.mounting.parameters import INDEX

#: The loads of the comparison as formulas, so that no code has to look them up in a table.
TORQUE, RADIAL, RIPPLE_HZ = 80e3, -100e3, 2.0


def best_of(work, budget=2.0):
    """Shortest of the times [s] that `work` returns, tried for `budget` seconds.

    Other work on the machine only slows.
    """
    begin, times = time.perf_counter(), []
    while time.perf_counter() - begin < budget or len(times) < 3:
        times.append(work())
    return min(times)


def timed(work):
    """Wall seconds of one call."""
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def torque_at(t, module=np):
    return (
        TORQUE
        * 0.5
        * (1.0 + module.tanh(t - 10.0))
        * (1.0 + 0.05 * module.sin(2.0 * np.pi * RIPPLE_HZ * t))
    )


def radial_at(t, module=np):
    return (
        RADIAL
        * 0.5
        * (1.0 + module.tanh((t - 5.0) / 0.5))
        * (1.0 + 0.02 * module.sin(2.0 * np.pi * 0.37 * t))
    )


def element_coordinates(rig, parameters):
    """Matrices over the deflections of both bushings in z.

    The nonlinear springs then lie on single coordinates.

    The horizontal block has no load here and stays at rest; leaving it out is to the peers'
    advantage.
    """
    vertical, _ = mounting_blocks(rig, parameters)
    inverse = np.linalg.inv(vertical.rows)
    M, C, K = (inverse.T @ matrix @ inverse for matrix in (vertical.M, vertical.C, vertical.K))
    return M, C, K, inverse.T @ vertical.G[:, [0, 2]], vertical.law, vertical.output @ inverse


def scipy_run(rig, parameters, times, method):
    """Deflections (n, 2) and wall seconds of solve_ivp at its tolerance of 1e-6."""
    M, C, K, G, law, _ = element_coordinates(rig, parameters)
    inverse, (K3, K5) = np.linalg.inv(M), law[:2]

    def rates(t, y):
        u, v = y[:2], y[2:]
        square = u * u
        force = (
            G[:, 0] * torque_at(t)
            + G[:, 1] * radial_at(t)
            - K @ u
            - C @ v
            - u * square * (K3 + K5 * square)
        )
        return np.concatenate([v, inverse @ force])

    start = time.perf_counter()
    solution = solve_ivp(
        rates,
        (times[0], times[-1]),
        np.zeros(4),
        method=method,
        t_eval=times,
        rtol=1e-6,
        atol=[1e-10] * 2 + [1e-8] * 2,
    )
    return solution.y[:2].T, time.perf_counter() - start


def exudyn_equations(rig, parameters, times, step, solver):
    """Sensor signals and wall seconds of Exudyn when it is handed our condensed equations.

    Two coordinates, nothing else.
    """
    M, C, K, G, law, to_signals = element_coordinates(rig, parameters)
    K3, K5 = float(law[0]), float(law[1])
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

    def spring(mbs, t, itemNumber, u, v, k, d, offset):
        return k * u * u * u + d * u * u * u * u * u

    kept = []
    for coordinate in range(2):
        marker = system.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate))
        if K3 or K5:
            item = system.AddObject(
                CoordinateSpringDamper(markerNumbers=[ground, marker], stiffness=K3, damping=K5)
            )
            kept.append(CreateSymbolicUserFunction(system, spring, "springForceUserFunction", item))
            system.SetObjectParameter(item, "springForceUserFunction", kept[-1])
        for function, amplitude in (
            (_torque, TORQUE * G[coordinate, 0]),
            (_radial, RADIAL * G[coordinate, 1]),
        ):
            load = system.AddLoad(LoadCoordinate(markerNumber=marker, load=amplitude))
            kept.append(CreateSymbolicUserFunction(system, function, "loadUserFunction", load))
            system.SetLoadParameter(load, "loadUserFunction", kept[-1])
    record, seconds = _solved(system, node, times, step, solver)
    return record[:, 1:3] @ to_signals.T, seconds


def exudyn_bodies(rig, parameters, times, step, solver, measured=None):
    """Sensor signals and wall seconds of Exudyn with the mounting as its user would build it.

    One rigid body for all that pitches and yaws, held at the main bearing, on two Cartesian
    spring-dampers. Loads are the formulas, or `measured` (torque, ntl_z) at `times`.
    """
    vertical, horizontal = mounting_blocks(rig, parameters)
    inertia = [vertical.M[0, 0], vertical.M[1, 1], horizontal.M[0, 0], 0.0, 0.0, 0.0]
    mass = rig.housing_mass + rig.shaft_mass + rig.coupling_mass
    first = rig.housing_mass * (rig.housing_cg_x + rig.main_bearing_x) + rig.shaft_mass * (
        rig.shaft_cg_x + rig.main_bearing_x
    )
    center = (first - rig.coupling_mass * rig.coupling_arm) / mass
    system = exu.SystemContainer().AddSystem()
    zero = [0.0] * 6
    node = system.AddNode(NodeRigidBodyRxyz(referenceCoordinates=zero, initialVelocities=zero))
    body = system.AddObject(
        RigidBody(
            nodeNumber=node,
            physicsMass=mass,
            physicsInertia=inertia,
            physicsCenterOfMass=[center, 0.0, 0.0],
        )
    )
    fixed = _ground_coordinate(system)
    for coordinate in range(3):
        marker = system.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate))
        system.AddObject(CoordinateConstraint(markerNumbers=[fixed, marker]))
    ground, law, kept = system.AddObject(ObjectGround()), _bushing_law(parameters), []
    for y in (rig.R_x, -rig.R_x):
        place = [rig.main_bearing_x, y, 0.0]
        markers = [
            system.AddMarker(MarkerBodyPosition(bodyNumber=b, localPosition=place))
            for b in (ground, body)
        ]
        k = [parameters[INDEX["k_x"]]] + [parameters[INDEX["K1"]]] * 2
        d = [parameters[INDEX["c_x"]]] + [parameters[INDEX["C1"]]] * 2
        item = system.AddObject(
            CartesianSpringDamper(markerNumbers=markers, stiffness=k, damping=d)
        )
        if has_nonlinear_stiffness(parameters):
            kept.append(CreateSymbolicUserFunction(system, law, "springForceUserFunction", item))
            system.SetObjectParameter(item, "springForceUserFunction", kept[-1])
    hub = system.AddMarker(
        MarkerBodyRigid(bodyNumber=body, localPosition=[-rig.coupling_arm, 0.0, 0.0])
    )
    share = 1.0 - 1.0 / rig.gear_ratio
    for number, (kind, direction, size) in enumerate(
        ((Torque, 0, TORQUE * share), (Force, 2, RADIAL))
    ):
        amplitude = np.zeros(3)
        amplitude[direction] = size if measured is None else (share, 1.0)[number]
        load = system.AddLoad(kind(markerNumber=hub, loadVector=amplitude))
        if measured is None:
            function = CreateSymbolicUserFunction(
                system, (_torque, _radial)[number], "loadVectorUserFunction", load
            )
        else:
            function = _looked_up(times, measured[number])
        kept.append(function)
        system.SetLoadParameter(load, "loadVectorUserFunction", function)
    record, seconds = _solved(system, node, times, step, solver)
    return record[:, 4:6] @ vertical.output.T, seconds


def _torque(mbs, t, load):
    return load * (
        0.5
        * (1.0 + exu.symbolic.tanh(t - 10.0))
        * (1.0 + 0.05 * exu.symbolic.sin(12.566370614359172 * t))
    )


def _radial(mbs, t, load):
    rise = 0.5 * (1.0 + exu.symbolic.tanh((t - 5.0) * 2.0))
    return load * (rise * (1.0 + 0.02 * exu.symbolic.sin(2.324778563656447 * t)))


def _bushing_law(parameters):
    """Spring force of a bushing; the constants stand in it as numbers."""
    K3, K5 = float(parameters[INDEX["K3"]]), float(parameters[INDEX["K5"]])

    def force(mbs, t, itemNumber, u, v, k, d, offset):
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


def _looked_up(times, values):
    """Load function in Python that reads a measured record, as Exudyn needs it.

    It has no table of its own.
    """
    step, table = float(times[1] - times[0]), [*map(float, values), float(values[-1])]

    def factor(t):
        place = min(t / step, len(table) - 2)
        before = int(place)
        return table[before] + (table[before + 1] - table[before]) * (place - before)

    def vector(mbs, t, load):
        f = factor(t)
        return [f * load[0], f * load[1], f * load[2]]

    return vector


def _ground_coordinate(system):
    node = system.AddNode(NodePointGround(referenceCoordinates=[0.0] * 3))
    return system.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=0))


def _solved(system, node, times, step, solver):
    output = exu.OutputVariableType.Coordinates
    sensor = system.AddSensor(
        SensorNode(nodeNumber=node, storeInternal=True, outputVariableType=output)
    )
    system.Assemble()
    settings = _exudyn_settings(times, step)
    start = time.perf_counter()
    system.SolveDynamic(settings, solverType=solver)
    return system.GetSensorStoredData(sensor), time.perf_counter() - start


def _exudyn_settings(times, step):
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


def has_nonlinear_stiffness(parameters):
    return bool(parameters[INDEX["K3"]] or parameters[INDEX["K5"]])
