"""Laws of the library as columns along a run, by shape of the law."""

from collections.abc import Mapping

import numpy as np

from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.mounting.classes.forces import BushingSize, branches, stop_forces
from carrierflex.diagnosis.mounting.classes.maps import (
    DELAYS,
    axial_column,
    bearing_column,
    delay_columns,
    gain_column,
    load_columns,
    signals_of,
    unequal_column,
    zero_column,
)
from carrierflex.diagnosis.mounting.classes.motion import BushingMotion
from carrierflex.diagnosis.mounting.classes.rigid_body import RigidBody
from carrierflex.diagnosis.mounting.model import MountingModel
from carrierflex.simulation.force_laws import Force
from carrierflex.simulation.mounting.measured_laws.bushing_laws import bushing_forces, packed_laws

#: Relaxation times and yield deflections of the laws over the time of a step and the largest
#: deflection.
_TAUS = np.geomspace(1.5, 1500.0, 14)
_YIELDS = np.geomspace(0.01, 1.0, 14)
#: Shapes of a user's law over the scale of the card.
_USER_SHARES = (0.25, 0.5, 1.0, 2.0, 4.0)


def law_signals(
    body: RigidBody, model: MountingModel, size: BushingSize, own: BushingMotion, law: str
) -> FloatArray:
    """Signals of a law for unit amplitude, shape (n_shapes, n_columns, n_channels, n).

    Parameters
    ----------
    body : RigidBody
        Housing on the fitted linear bushings.
    model : MountingModel
        Library, with users' laws.
    size : BushingSize
        Sizes over all runs, so that shapes are the same in each.
    own : BushingMotion
        Run.
    law : str
        Effect.
    """
    channels = range(len(model.channels))
    if law == "sensor_gain":
        return np.array([gain_column(own, k) for k in channels])
    if law == "sensor_zero":
        return np.array([zero_column(own, k) for k in channels])
    if law == "sensor_delay":
        delays = np.concatenate([DELAYS, -DELAYS])
        return delay_columns(body, own, "all", delays)[:, None]
    if law == "parasitic_torque":
        return load_columns(body, own, "torque_from_load")[None, 1:]
    if law == "ntl_direction":
        return load_columns(body, own, "direction")[None, :1]
    if law == "axial_bushing_stiffness":
        return axial_column(body, own)[None]
    if law == "main_bearing_compliance":
        return bearing_column(body, own)[None]
    if law == "unequal_bushings":
        return unequal_column(body, own)[None]
    forces = law_forces(model, size, own, law)
    n_shapes, n_columns = forces.shape[:2]
    p = body.on_coordinates(forces.reshape(-1, *forces.shape[2:]))
    return signals_of(body, own, p).reshape(n_shapes, n_columns, *own.signals.shape)


def law_forces(model: MountingModel, size: BushingSize, own: BushingMotion, law: str) -> FloatArray:
    """Forces of the bushings for unit amplitude, shape (n_shapes, n_columns, 2, 2, n).

    Parameters
    ----------
    model, size, own, law
        As for :func:`law_signals`; `law` is a force of the bushings.
    """
    u, v = own.u, own.v
    simple: Mapping[str, FloatArray] = {
        "cubic_stiffness": u**3,
        "quintic_stiffness": u**5,
        "deflection_dependent_damping": u**2 * v,
    }
    if law in simple:
        return simple[law][None, None]
    if law == "fluid_branch":
        return branches(own, _TAUS * own.step)[:, None]
    if law == "elasto_plastic_friction":
        return stop_forces(own, _YIELDS * size.deflection)[:, None]
    if law in model.measured:
        laws = packed_laws([(model.measured[law], 1.0)])
        return bushing_forces(laws, u, v, own.step)[None, None]
    return _user_forces(model, model.laws[law], own, law)


def _user_forces(model: MountingModel, law: Force, own: BushingMotion, name: str) -> FloatArray:
    """Forces of a user's law at multiples of the scales of its shapes, amplitude by amplitude."""
    parameters = [p for p in model.parameters((name,)) if p.effect == name]
    amplitudes = [k for k, p in enumerate(parameters) if not p.shape]
    shares = _USER_SHARES if len(amplitudes) < len(parameters) else (1.0,)
    found = []
    for share in shares:
        rows = []
        for amplitude in amplitudes:
            values = np.array(
                [
                    float(np.clip(share * p.scale, p.lower, p.upper)) if p.shape else 0.0
                    for p in parameters
                ]
            )
            values[amplitude] = 1.0
            rows.append(_along(law, own.u, own.v, values))
        found.append(rows)
    return np.array(found)


def _along(law: Force, u: FloatArray, v: FloatArray, values: FloatArray) -> FloatArray:
    pairs = zip(u.ravel().tolist(), v.ravel().tolist(), strict=True)
    forces = [law(deflection, speed, values) for deflection, speed in pairs]
    return np.array(forces).reshape(u.shape)
