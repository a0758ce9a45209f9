"""The mounting in the hands of scipy's solve_ivp and of Exudyn: the same equations, in the form each is fastest with."""

import time

import exudyn as exu
import numpy as np
from exudyn.advancedUtilities import CreateSymbolicUserFunction
from exudyn.itemInterface import (
    CoordinateSpringDamper,
    LoadCoordinate,
    MarkerNodeCoordinate,
    NodeGenericODE2,
    NodePointGround,
    ObjectGenericODE2,
)
from scipy.integrate import solve_ivp

from simulation.mounting.equations import mounting_blocks
from simulation.mounting.parameters import INDEX

#: The loads of the comparison as formulas, so that no code has to look them up in a table.
TORQUE, RADIAL, RIPPLE_HZ = 80e3, -100e3, 2.0


def torque_at(t, module=np):
    return TORQUE * 0.5 * (1.0 + module.tanh(t - 10.0)) * (1.0 + 0.05 * module.sin(2.0 * np.pi * RIPPLE_HZ * t))


def radial_at(t, module=np):
    return RADIAL * 0.5 * (1.0 + module.tanh((t - 5.0) / 0.5)) * (1.0 + 0.02 * module.sin(2.0 * np.pi * 0.37 * t))


def element_coordinates(rig, parameters):
    """Matrices over the deflections of both bushings in z: the nonlinear springs then lie on single coordinates.

    The horizontal block has no load here and stays at rest; leaving it out is to the peers' advantage.
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
        force = G[:, 0] * torque_at(t) + G[:, 1] * radial_at(t) - K @ u - C @ v - u * square * (K3 + K5 * square)
        return np.concatenate([v, inverse @ force])

    start = time.perf_counter()
    solution = solve_ivp(
        rates, (times[0], times[-1]), np.zeros(4), method=method, t_eval=times, rtol=1e-6, atol=[1e-10] * 2 + [1e-8] * 2
    )
    return solution.y[:2].T, time.perf_counter() - start


def exudyn_run(rig, parameters, times, step, solver):
    """Deflections (n, 2) and wall seconds of Exudyn: generic second-order object, symbolic spring and load functions."""
    M, C, K, G, law, _ = element_coordinates(rig, parameters)
    K3, K5 = float(law[0]), float(law[1])
    container = exu.SystemContainer()
    system = container.AddSystem()
    node = system.AddNode(
        NodeGenericODE2(
            referenceCoordinates=[0.0] * 2,
            initialCoordinates=[0.0] * 2,
            initialCoordinates_t=[0.0] * 2,
            numberOfODE2Coordinates=2,
        )
    )
    system.AddObject(ObjectGenericODE2(nodeNumbers=[node], massMatrix=M, stiffnessMatrix=K, dampingMatrix=C))
    ground = system.AddMarker(
        MarkerNodeCoordinate(nodeNumber=system.AddNode(NodePointGround(referenceCoordinates=[0.0] * 3)), coordinate=0)
    )

    def spring(mbs, t, itemNumber, u, v, k, d, offset):
        return k * u * u * u + d * u * u * u * u * u

    def torque(mbs, t, load):
        return (
            load * 0.5 * (1.0 + exu.symbolic.tanh(t - 10.0)) * (1.0 + 0.05 * exu.symbolic.sin(12.566370614359172 * t))
        )

    def radial(mbs, t, load):
        rise = 0.5 * (1.0 + exu.symbolic.tanh((t - 5.0) * 2.0))
        return load * rise * (1.0 + 0.02 * exu.symbolic.sin(2.324778563656447 * t))

    kept = []
    for coordinate in range(2):
        marker = system.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate))
        if K3 or K5:
            item = system.AddObject(CoordinateSpringDamper(markerNumbers=[ground, marker], stiffness=K3, damping=K5))
            kept.append(CreateSymbolicUserFunction(system, spring, "springForceUserFunction", item))
            system.SetObjectParameter(item, "springForceUserFunction", kept[-1])
        for function, amplitude in ((torque, TORQUE * G[coordinate, 0]), (radial, RADIAL * G[coordinate, 1])):
            load = system.AddLoad(LoadCoordinate(markerNumber=marker, load=amplitude))
            kept.append(CreateSymbolicUserFunction(system, function, "loadUserFunction", load))
            system.SetLoadParameter(load, "loadUserFunction", kept[-1])
    system.Assemble()
    settings = _exudyn_settings(times, step)
    start = time.perf_counter()
    system.SolveDynamic(settings, solverType=solver)
    seconds = time.perf_counter() - start
    return system.GetNodeOutput(node, exu.OutputVariableType.Coordinates), seconds


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
    settings.parallel.numberOfThreads = 1
    return settings


def has_nonlinear_stiffness(parameters):
    return bool(parameters[INDEX["K3"]] or parameters[INDEX["K5"]])
