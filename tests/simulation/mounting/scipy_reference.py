"""The mounting written a second time, plainly, in three dimensions, and integrated by scipy.

Shares no code with the model.
"""

import numpy as np
from scipy.integrate import solve_ivp


def bushing_points(rig):
    return np.array([[0.0, rig.R_x, 0.0], [0.0, -rig.R_x, 0.0]])


def accelerations(rig, forces_on_housing, theta, torque, ntl):
    """Angular accelerations about the main bearing from forces at points, by moments alone."""
    pivot = np.array([-rig.main_bearing_x, 0.0, 0.0])
    moment = np.array([torque, 0.0, 0.0])
    moment += np.cross([-rig.coupling_arm, 0.0, 0.0], ntl)
    for point, force in zip(bushing_points(rig), forces_on_housing, strict=True):
        moment += np.cross(point - pivot, force)
    bodies = (
        (rig.housing_mass, rig.housing_cg_x + rig.main_bearing_x),
        (rig.shaft_mass, rig.shaft_cg_x + rig.main_bearing_x),
        (rig.coupling_mass, -rig.coupling_arm),
    )
    arms = sum(mass * arm**2 for mass, arm in bodies)
    return moment / (np.array(rig.housing_inertia) + np.array([0.0, arms, arms]))


def rates(rig, law, t, y, loads):
    """``y = theta (3), omega (3), u_m (2 bushings, y and z)``."""
    theta = y[:3]
    omega = y[3:6]
    fluid = y[6:].reshape(2, 2)
    pivot = np.array([-rig.main_bearing_x, 0.0, 0.0])
    forces, fluid_rates = [], np.zeros((2, 2))
    for number, point in enumerate(bushing_points(rig)):
        u, v = np.cross(theta, point - pivot), np.cross(omega, point - pivot)
        force = np.array([-law["k_x"] * u[0] - law["c_x"] * v[0], 0.0, 0.0])
        for row, axis in enumerate((1, 2)):
            elastic = law["K1"] * u[axis] + law["K3"] * u[axis] ** 3 + law["K5"] * u[axis] ** 5
            damping = (law["C1"] + law["C3"] * u[axis] ** 2) * v[axis]
            branch = law["k"] * fluid[number, row]
            if law["c"] > 0.0:
                fluid_rates[number, row] = v[axis] - law["k"] / law["c"] * fluid[number, row]
            force[axis] = -(elastic + damping + branch)
        forces.append(force)
    torque, ntl_y, ntl_z = loads(t)
    carried = (1.0 - 1.0 / rig.gear_ratio) * (torque + law["P_T"] * ntl_z)
    acceleration = accelerations(rig, forces, theta, carried, np.array([0.0, ntl_y, ntl_z]))
    return np.concatenate([omega, acceleration, fluid_rates.ravel()])


def reference_signals(rig, law, inputs, *, rtol=1e-9):
    """Sensor signals (n, 6) by scipy's DOP853, restarted at every sample: a corner of the loads."""
    table = inputs.loads
    y = np.zeros(10)
    states = [y]
    for i in range(len(table) - 1):
        t0, t1 = inputs.time[i], inputs.time[i + 1]

        def loads(t, i=i, t0=t0, t1=t1):
            return table[i] + (table[i + 1] - table[i]) * (t - t0) / (t1 - t0)

        def slope(t, y, loads=loads):
            return rates(rig, law, t, y, loads)

        y = solve_ivp(slope, (t0, t1), y, method="DOP853", rtol=rtol, atol=1e-13).y[:, -1]
        states.append(y)
    theta = np.array(states)[:, :3]
    L = rig.main_bearing_x
    zeros = np.zeros(len(theta))
    motion = np.stack([zeros, L * theta[:, 2], -L * theta[:, 1], *theta.T], axis=1)
    return motion @ rig.sensor_matrix.T
