"""What a run of the stage computed beside the sensors, as named columns.

Loads of teeth, pins and bearings, shares of the planets, motion of the housing, speeds of the
shafts, generator torque, energies.
"""

import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.stage.coordinate_layout import SHAFTS
from carrierflex.simulation.stage.part_loads import PartLoads, mesh_misalignment, spring_load
from carrierflex.simulation.stage.response import StageRecord
from carrierflex.simulation.stage.stage_data import RollerBearingData
from carrierflex.simulation.stage.stage_model import StageModel

#: Bearings whose loads are told: name of the spring, name of the column.
BEARINGS = {
    "main_bearing": "main_bearing",
    "upwind_seat": "bearing_A",
    "downwind_seat": "bearing_B",
    "sun": "sun_support",
}
#: Motion of the housing's centre in the fixed frame: displacements [m], rotations [rad].
HOUSING_COLUMNS = (
    "housing_d_x",
    "housing_d_y",
    "housing_d_z",
    "housing_theta_x",
    "housing_theta_y",
    "housing_theta_z",
)
_ENERGIES = (
    "energy_torque",
    "energy_generator",
    "energy_loads",
    "energy_mount",
    "energy_dissipated",
    "energy_stored",
)


def load_columns(
    model: StageModel, record: StageRecord, loads: PartLoads
) -> dict[str, NDArray[np.float64]]:
    """Loads, speeds and energies over time by column name.

    Parameters
    ----------
    model : StageModel
        The stage.
    record : StageRecord
        N instants.
    loads : PartLoads
        Loads of teeth and pins at the same instants.

    Returns
    -------
    dict of str to ndarray, shape (N,)
        ``sun_mesh_i``, ``ring_mesh_i``: force along the tooth normal, coast flanks negative [N],
        and ``_slope``, the misalignment of the mesh in the plane of action [rad];
        ``pin_i_force_*``, ``pin_i_moment_*``: planet on pin, axial, radial and tangential [N, N m];
        ``share_i``: of the tangential pin forces; ``load_sharing_factor``: the largest share times
        the number of planets; ``pin_load_factor``: the largest load across a pin over their mean;
        ``pin_i_upwind_row``, ``pin_i_downwind_row``: load of a planet's bearing rows [N];
        ``bearing_A_y`` ...: force on the rotating part in the fixed frame
        [N] and ``_my``, ``_mz`` its moment [N m]; ``housing_*`` as :data:`HOUSING_COLUMNS`;
        ``*_speed`` [rad/s], planets' against the fixed
        frame; ``generator_torque`` on the generator about +x [N m]; ``energy_*`` since the start,
        and ``energy_imbalance``, what the balance leaves over [J].
    """
    columns = {"carrier_angle": record.c[:, 0], "torque": record.drive[:, 0]}
    n_planets = model.layout.n_planets
    n_meshes, planets = 2 * n_planets, range(n_planets)
    slopes = mesh_misalignment(model, record.c)
    net = loads.mesh_force[:, :n_meshes] - loads.mesh_force[:, n_meshes:]
    for i, name in enumerate(f"{mate}_mesh_{p + 1}" for mate in ("sun", "ring") for p in planets):
        columns[name] = net[:, i]
        columns[f"{name}_slope"] = slopes[:, i]
    for pin in planets:
        for i, direction in enumerate(("axial", "radial", "tangential")):
            columns[f"pin_{pin + 1}_force_{direction}"] = loads.pin_force[:, pin, i]
            columns[f"pin_{pin + 1}_moment_{direction}"] = loads.pin_moment[:, pin, i]
    share = loads.load_share
    columns |= {f"share_{pin + 1}": share[:, pin] for pin in planets}
    columns["load_sharing_factor"] = n_planets * share.max(axis=1)
    pins = loads.pin_load
    columns["pin_load_factor"] = pins.max(axis=1) / pins.mean(axis=1)
    rows = loads.row_load((model.data.planet_rollers or RollerBearingData()).row_spacing)
    for pin in planets:
        for i, side in enumerate(("upwind", "downwind")):
            columns[f"pin_{pin + 1}_{side}_row"] = rows[:, pin, i]
    for spring, name in BEARINGS.items():
        force = -_in_fixed_frame(record.c[:, 0], spring_load(model, spring, record.c))
        for i, component in zip((0, 1, 2, 4, 5), ("x", "y", "z", "my", "mz"), strict=True):
            columns[f"{name}_{component}"] = force[:, i]
    motion = _in_fixed_frame(record.c[:, 0], record.c @ model.channels.B[:, model.channels.housing])
    columns |= {name: motion[:, i] for i, name in enumerate(HOUSING_COLUMNS)}
    columns |= _speeds(model, record)
    chain = model.data.chain
    wanted, speed = record.drive[:, 1], columns["generator_speed"]
    columns["generator_torque"] = chain.generator_constant * (wanted - speed)
    columns |= {name: record.energy[:, i] for i, name in enumerate(_ENERGIES)}
    columns["energy_imbalance"] = record.imbalance
    return columns


def _speeds(model: StageModel, record: StageRecord) -> dict[str, NDArray[np.float64]]:
    """Speeds about x of carrier, planets, sun and the parallel stages [rad/s]."""
    rows = model.layout.rows
    planets = [f"planet_{pin + 1}" for pin in range(model.layout.n_planets)]
    where = {planet: rows[planet][3] for planet in planets}
    where |= {"sun": rows["sun"][3]} | {shaft: rows[shaft][0] for shaft in SHAFTS}
    speeds = {"carrier_speed": record.c_rate[:, 0]}
    return speeds | {f"{name}_speed": record.c_rate @ model.L[row] for name, row in where.items()}


def _in_fixed_frame(angle: NDArray[np.float64], load: NDArray[np.float64]) -> NDArray[np.float64]:
    """Loads or small motions of the carrier frame, shape (N, 6), seen from the fixed one."""
    fixed = load.copy()
    c, s = np.cos(angle), np.sin(angle)
    for y, z in ((1, 2), (4, 5)):
        fixed[:, y] = c * load[:, y] - s * load[:, z]
        fixed[:, z] = s * load[:, y] + c * load[:, z]
    return fixed
