"""What the case file of a carrier holds: rig, sensors, runs with the true motion of the carrier."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from carrierflex.files.toml_values import (
    Count,
    Expected,
    FileStem,
    NotNegative,
    Number,
    Planets,
    Positive,
    Text,
    TomlTable,
    different,
    key,
)
from carrierflex.simulation.plan_tables import PlanTable

Share = Annotated[float, Field(ge=0, lt=1), Expected("a share, 0 <= share < 1")]
Ripple = Annotated[float, Field(ge=0, lt=0.2), Expected("a relative ripple, 0 <= ripple < 0.2")]
Quantity = Annotated[
    Literal["axial_displacement", "radial_displacement"],
    Expected("one of axial_displacement, radial_displacement"),
]


class RigTable(TomlTable):
    """Nominal facts of the carrier's rig."""

    nominal_torque: Positive = key("Torque on the main shaft that counts as 100 %", "N m")
    sensor_radius: Positive = key("Radius of the points that the sensors look at", "m")
    n_planets: Planets = key("Number of planets, 3 to 8")


class SensorTable(TomlTable):
    """One displacement sensor fixed to the housing."""

    name: Text = key("Column name of its signal")
    quantity: Quantity = key("What it measures")
    angle_deg: Number = key("Housing angle about x from the z axis", "deg")


class MotionTable(TomlTable):
    """True motion of the carrier in one run."""

    d_x: Number = key("Axial offset", "m")
    phi_H: Number = key("Tilt of the housing", "rad")
    theta_H_deg: Number = key("Housing angle of the tilt's axis", "deg")
    phi_PLC: Number = key("Tilt of the carrier against the main shaft", "rad")
    theta_PLC_deg: Number = key("Carrier-frame angle of the tilt's axis", "deg")
    rim_order3_amplitude: NotNegative = key(
        "Amplitude at the rim of the planets' order (3 of three planets) at the run's torque",
        "m",
    )
    stiff_share: Share = key("Share of the stiff deflection curve, rho_s / (rho_s + rho_f)")
    saddle: Number = key("Static saddle over the four axial sensors", "m")


class RunTable(TomlTable):
    """One run."""

    name: FileStem = key("Name of the run, also of its file")
    condition: Text = key("Free text, equal for repeats")
    torque: Number = key("Mean torque on the main shaft about +x", "N m")
    ntl_y: Number = key("Radial load at the dynamometer coupling along y", "N")
    ntl_z: Number = key("Radial load at the dynamometer coupling along z", "N")
    motion: MotionTable = key("True motion of the carrier")


class CarrierCaseDocument(TomlTable):
    """Load cases of the planet carrier with the carrier's true motion.

    SI units unless a key's name says otherwise.
    """

    format: Literal["carrierflex-case"] = key("Kind of the file")
    version: Literal[1] = key("Version of the format")
    name: Text = key("Title")
    seed: Count = key("Seed of the random generator for ripple and noise")
    noise_std: NotNegative = key("Standard deviation of the noise of every sensor", "m")
    sample_rate_hz: Positive = key("Samples a second", "1/s")
    duration: Positive = key("Length of every run", "s")
    speed_rpm: Number = key("Mean speed of the carrier", "rev/min")
    speed_ripple: Ripple = key("Standard deviation of the speed's slow ripple over the mean")
    torque_ripple: Ripple = key("Standard deviation of the torque's slow ripple over the mean")
    rig: RigTable = key("Nominal facts of the rig")
    sensors: Annotated[list[SensorTable], Field(min_length=1), different("sensor name")] = key(
        "Sensors",
    )
    runs: Annotated[list[RunTable], Field(min_length=1), different("run name")] = key("Runs")
    plan: PlanTable | None = key("Costs and limits of additions to the campaign", default=None)

    @model_validator(mode="after")
    def _has_samples(self) -> "CarrierCaseDocument":
        if self.duration * self.sample_rate_hz < 2.0:
            described = f"duration {self.duration} s at {self.sample_rate_hz} samples a second"
            raise ValueError(f"{described} gives fewer than two samples")
        return self
