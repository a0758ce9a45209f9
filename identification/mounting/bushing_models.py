"""The three bushing models as sets of unknowns, and a mounting campaign's residuals for one set.

Each model contains the one before it: linear within nonlinear within hydro-dynamic. The paper's
nonlinear bushing has no linear damper and its hydro-dynamic one no damper beside the fluid branch;
here both keep it, as ``C0``, so that a richer model can never be the worse one (the paper's table
2, where it is, tells of a search that had not converged).
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.simulation.fit_parameter import FitParameter
from carrierflex.simulation.mounting.inputs import MountingInputs
from carrierflex.simulation.mounting.parameter_arrays import parameter_array
from carrierflex.simulation.mounting.parameters import INDEX, PARAMETERS
from carrierflex.simulation.mounting.rig import HOUSING_MOTION, SENSORS, MountingRig
from carrierflex.simulation.mounting.simulate import simulate

Array = NDArray[np.float64]

#: Published name and name in the simulator's parameter set, by model; P_T belongs to all. The fluid
#: mass m of the paper has no influence (its root is at -3.5e5 1/s) and stays zero.
_LINEAR = {"K1": "K1", "C1": "C1"}
_NONLINEAR = {"K1": "K1", "C0": "C1", "K3": "K3", "K5": "K5", "C1": "C3"}
_HYDRODYNAMIC = {**_NONLINEAR, "k": "k", "c": "c", "Kp": "Kp", "Fy": "Fy"}
_UNITS = {
    "K1": "N/m", "C0": "N s/m", "K3": "N/m^3", "K5": "N/m^5", "k": "N/m", "c": "N s/m",
    "Kp": "N/m", "Fy": "N", "P_T": "m", "K_x": "N/m", "C_x": "N s/m",
}  # fmt: skip
#: Spring and damper of each bushing along the axis: the paper fitted them beside the radial ones
#: and did not print them. They act where the housing yaws.
AXIAL = {"K_x": "k_x", "C_x": "c_x"}

#: Deflection at which the nonlinear terms are scaled [m]: the trunnions move by several millimetres
#: in use.
_DEFLECTION = 5e-3
#: Axial over radial stiffness of a bushing on whose pin the housing slides, for scales only.
_AXIAL_SHARE = 0.05
#: Angular frequency at which a damper is weighed against a spring [rad/s]: of the order of the
#: drive train's 1.4 Hz.
_FREQUENCY = 9.0


@dataclass(frozen=True, eq=False)
class BushingModel:
    """One model of both bushings.

    Parameters
    ----------
    name : str
        Name on the command line.
    simulated : mapping of str to str
        Simulator's parameter by published name.
    """

    name: str
    simulated: Mapping[str, str]

    @property
    def names(self) -> tuple[str, ...]:
        """Published names of the unknowns."""
        return tuple(self.simulated)

    def free(self, rig: MountingRig) -> tuple[FitParameter, ...]:
        """Unknowns with physical bounds, scaled by the rig's nominal stiffness."""
        free = (_free(name, self.unit(name), rig.bushing_radial_stiffness) for name in self.names)
        return tuple(
            _within_simulator(one, simulated_name)
            for one, simulated_name in zip(free, self.simulated.values(), strict=True)
        )

    def with_axial(self, names: Iterable[str]) -> "BushingModel":
        """Copy with axial constants among its unknowns.

        Parameters
        ----------
        names : iterable of str
            Of :data:`AXIAL`.
        """
        return replace(self, simulated={**self.simulated, **{name: AXIAL[name] for name in names}})

    @property
    def axial(self) -> tuple[str, ...]:
        """Axial constants among the unknowns."""
        return tuple(name for name in AXIAL if name in self.simulated)

    def unit(self, name: str) -> str:
        """Unit of an unknown; the paper gives two quantities the symbol C1."""
        if name == "C1":
            return "N s/m" if self.simulated["C1"] == "C1" else "N s/m^3"
        return _UNITS[name]

    def simulator_values(self, values: Array) -> dict[str, float]:
        """Parameter set of the simulator; what the model does not have is switched off."""
        return {
            "C1": 0.0,
            **dict(zip(self.simulated.values(), (float(v) for v in values), strict=True)),
        }

    def values_of(self, simulated: Mapping[str, float]) -> dict[str, float]:
        """Published values from the simulator's parameter set; only those that it holds."""
        return {name: simulated[key] for name, key in self.simulated.items() if key in simulated}


LINEAR = BushingModel("linear_bushing", {**_LINEAR, "P_T": "P_T"})
NONLINEAR = BushingModel("nonlinear_bushing", {**_NONLINEAR, "P_T": "P_T"})
HYDRODYNAMIC = BushingModel("hydrodynamic_bushing", {**_HYDRODYNAMIC, "P_T": "P_T"})
#: From the simplest to the richest.
BUSHING_MODELS = (LINEAR, NONLINEAR, HYDRODYNAMIC)


@dataclass(frozen=True, eq=False)
class MountingResiduals:
    """Residuals of a mounting campaign, all runs one after the other, for values of one model.

    Parameters
    ----------
    rig : MountingRig
        The rig.
    model : BushingModel
        What is fitted.
    inputs : tuple of MountingInputs
        Loads of every run.
    signals : tuple of ndarray, shape (n, n_sensors)
        Measured displacements [m] of every run, NaN where missing.
    sensors : tuple of str
        Sensors in the order of the columns.
    weight : ndarray, shape (n_rows, n_sensors)
        Residuals are ``weight @ (measured - simulated)``: the inverse noise of every sensor, or, by
        equation 12, the square roots of the weights of the housing's motion times ``T^-1``.
    """

    rig: MountingRig
    model: BushingModel
    inputs: tuple[MountingInputs, ...]
    signals: tuple[Array, ...]
    sensors: tuple[str, ...]
    weight: Array

    def __call__(self, values: Array) -> Array:
        """Residuals, shape (n_residuals,); missing samples are zero."""
        parameters = parameter_array(self.rig, self.model.simulator_values(values))
        columns = [SENSORS.index(sensor) for sensor in self.sensors]
        gaps = []
        for inputs, measured in zip(self.inputs, self.signals, strict=True):
            gap = (
                measured - simulate(self.rig, parameters, inputs).signals[:, columns]
            ) @ self.weight.T
            gaps.append(np.nan_to_num(gap, nan=0.0).ravel())
        return np.concatenate(gaps)

    def blocks(self, seconds: float) -> NDArray[np.int64]:
        """Number of the time block of every residual; blocks of different runs differ."""
        numbers, first = [], 0
        for inputs in self.inputs:
            blocks = ((inputs.time - inputs.time[0]) // seconds).astype(np.int64)
            numbers.append(np.repeat(first + blocks, len(self.weight)))
            first += int(blocks[-1]) + 1
        return np.concatenate(numbers)

    def counted(self) -> Array:
        """Residuals that hold a measured value, by run and row: shape (n_runs, n_rows)."""
        finite = [np.isfinite(signals @ self.weight.T).sum(axis=0) for signals in self.signals]
        return np.array(finite, dtype=np.float64)


def mounting_residuals(
    campaign: Campaign, model: BushingModel, weights: Mapping[str, float] | None = None
) -> MountingResiduals:
    """Residuals of a campaign of kind mounting.

    Parameters
    ----------
    campaign : Campaign
        What was measured.
    model : BushingModel
        What is fitted.
    weights : mapping of str to float, optional
        Weights of the housing's motion (d_x ... theta_z) in the objective of equation 12; without
        them the sensors themselves are compared, each over its declared noise or all alike.

    Returns
    -------
    MountingResiduals
        Callable of the model's values.

    Raises
    ------
    ValueError
        Where the campaign is of another kind, a weight is unknown or negative, or sensors for the
        motion are missing.
    """
    if campaign.kind != "mounting":
        raise ValueError(
            f"campaign '{campaign.name}' is of kind {campaign.kind}; "
            f"model {model.name} is for kind mounting only"
        )
    rig = MountingRig.from_table(campaign.rig)
    sensors = tuple(str(channel.sensor) for channel in campaign.channels)
    if weights:
        weight = _motion_weight(rig, sensors, weights)
    else:
        noise = [channel.noise_std for channel in campaign.channels]
        known = [value for value in noise if value is not None]
        weight = np.diag(
            [1.0 / value for value in known] if len(known) == len(noise) else np.ones(len(noise))
        )
    return MountingResiduals(
        rig=rig,
        model=model,
        inputs=tuple(MountingInputs.from_columns(run.time, run.inputs) for run in campaign.runs),
        signals=tuple(
            np.column_stack([run.signals[channel.name] for channel in campaign.channels])
            for run in campaign.within_use().runs
        ),
        sensors=sensors,
        weight=weight,
    )


def _motion_weight(rig: MountingRig, sensors: Sequence[str], weights: Mapping[str, float]) -> Array:
    for name, value in weights.items():
        if name not in HOUSING_MOTION:
            raise ValueError(f"weight of '{name}'; expected one of {', '.join(HOUSING_MOTION)}")
        if not (np.isfinite(value) and value >= 0.0):
            raise ValueError(f"weight of {name} is {value}; expected a number >= 0")
    if set(sensors) != set(SENSORS):
        missing = ", ".join(sensor for sensor in SENSORS if sensor not in sensors)
        raise ValueError(f"weights of the housing's motion need all six sensors; missing {missing}")
    T = rig.sensor_matrix[[SENSORS.index(sensor) for sensor in sensors]]
    rows = [HOUSING_MOTION.index(name) for name in weights]
    return np.sqrt(list(weights.values()))[:, None] * np.linalg.inv(T)[rows]


def _within_simulator(free: FitParameter, simulated: str) -> FitParameter:
    """Copy with bounds that the simulator accepts."""
    known = PARAMETERS[INDEX[simulated]]
    return replace(free, lower=max(free.lower, known.lower), upper=min(free.upper, known.upper))


def _free(name: str, unit: str, K: float) -> FitParameter:
    """Bounds and scale of one unknown for a bushing of about stiffness K."""
    u, damping = _DEFLECTION, K / _FREQUENCY
    lower, upper, scale = {
        "K1": (0.01 * K, 20.0 * K, K),
        "K3": (-2.0 * K / u**2, 20.0 * K / u**2, K / u**2),
        "K5": (0.0, 50.0 * K / u**4, K / u**4),
        "C0": (0.0, 10.0 * damping, 0.1 * damping),
        "C1": (0.0, 10.0 * damping, 0.1 * damping)
        if unit == "N s/m"
        else (0.0, 100.0 * damping / u**2, damping / u**2),
        "k": (0.0, 20.0 * K, K),
        "c": (0.0, 100.0 * damping, damping),
        "Kp": (0.0, 20.0 * K, K),
        "Fy": (0.0, 2.0 * K * u, 0.5 * K * u),
        "P_T": (-1.0, 1.0, 0.1),
        "K_x": (0.0, 20.0 * K, _AXIAL_SHARE * K),
        "C_x": (0.0, 10.0 * damping, 0.1 * _AXIAL_SHARE * damping),
    }[name]
    return FitParameter(name, unit, lower, upper, scale)
