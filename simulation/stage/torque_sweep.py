"""Torsional stiffness of main shaft and gearbox under a torque that grows.

From the whole stage (2011 paper, section 5.2).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.mounting.torsional_train import TorqueSweep
from carrierflex.simulation.stage.stage_model import StageModel
from carrierflex.simulation.stage.statics import SteadyLoad, static_coordinates


@dataclass(frozen=True, eq=False)
class StageSweeps:
    """Torque and rotation of the members in series (figure 11).

    Parameters
    ----------
    main_shaft : TorqueSweep
        Rotation of the hub's end of the shaft against the carrier's.
    gearbox : TorqueSweep
        Rotation of the carrier's end of the shaft with housing and generator held.
    """

    main_shaft: TorqueSweep
    gearbox: TorqueSweep


def stage_sweeps(model: StageModel, torques: NDArray[np.float64]) -> StageSweeps:
    """Static rotation of shaft and gearbox under torques at the hub, the generator holding them.

    The rotation of the gearbox is that of the carrier less what generator and housing turned by,
    seen from the carrier: with the ratio i and ``theta_G = i theta_C - (i - 1) theta_H`` of rigid
    gears, ``theta_C - (theta_G + (i - 1) theta_H) / i``. Meshes have their mean stiffness, weight
    is left out.

    Parameters
    ----------
    model : StageModel
        The stage, on its mounting or held.
    torques : ndarray, shape (n,)
        Torques on the main shaft about +x [N m], two or more.

    Returns
    -------
    StageSweeps
        Torque and rotation of both members.

    Raises
    ------
    ValueError
        Where fewer than two torques are given or one is not positive: without torque the teeth lift
        off.
    NotConvergedError
        Where the contact at rest does not settle.

    References
    ----------
    .. [1] "Modeling of Wind Turbine Gearbox Mounting", Modeling, Identification and Control 32(4),
    2011, section 5.2.
    """
    if len(torques) < 2 or not (np.isfinite(torques).all() and (torques > 0.0).all()):
        raise ValueError(
            f"torque sweep: torques are {torques} N m; expected two or more positive numbers"
        )
    layout = model.layout
    loads = [SteadyLoad(float(torque), gravity=0.0) for torque in torques]
    q = np.array([model.L @ static_coordinates(model, load, mean_stiffness=True) for load in loads])
    coordinates = layout.body.model.coordinates_of
    hub, carrier = q[:, coordinates(layout.hub)[3]], q[:, coordinates("shaft_face")[3]]
    generator, housing = q[:, layout.rows["generator"][0]], q[:, layout.rows["housing"][3]]
    ratio = float(layout.drive_motion[layout.rows["generator"][0]])
    output = (generator + (ratio - 1.0) * housing) / ratio
    return StageSweeps(TorqueSweep(torques, hub - carrier), TorqueSweep(torques, carrier - output))
