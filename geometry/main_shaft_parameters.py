"""Dimensions of the main shaft, each default with its source.

Tags as in :mod:`carrierflex.geometry.parameters`.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from carrierflex.files.problems import refuse
from carrierflex.geometry.parameters import CarrierParameters, refuse_non_positive


@dataclass(frozen=True)
class MainShaftParameters:
    """Dimensions of the main shaft [m].

    A uniform tube from the coupling's flange to the carrier's hub.

    The elastic shaft ends just upwind of the main bearing; the hub with its coupling, far stiffer,
    is the rigid arm from there to the point where loads enter. The downwind end butts against the
    upwind face of the carrier's hub: the shrink fit inside the hub counts as part of the joint.

    Raises
    ------
    ValueError
        Where a dimension is not positive or two of them contradict each other; the message names
        the parameter.
    """

    outer_diameter: float = 0.341
    """Derived from the torsional stiffness of the 2011 paper, 50 MN m/rad.

    The uniform shaft of 2.1 m and this bore has it.
    """
    inner_diameter: float = 0.060
    """Chosen: bore for the pitch control's rods and cables."""
    bearing_to_joint: float = 2.1
    """GRC: main bearing to gearbox, drivetrain example of the 750 kW machine.

    From the bearing's centre to the carrier.
    """
    bearing_width: float = 0.180
    """GRC: main bearing 24076."""
    bearing_to_flange: float = 0.120
    """Chosen: the coupling's flange stands clear of the bearing's seat.

    Otherwise the two could not both be held rigidly.
    """
    hub_to_bearing: float = 1.22
    """GRC: hub to main bearing, same example.

    Torque and loads of the rotor or dynamometer enter there.
    """

    def __post_init__(self) -> None:
        refuse_non_positive(self, "main_shaft")
        refuse(self._conflicts())

    def _conflicts(self) -> Iterator[str]:
        if self.bearing_to_joint > 20.0:
            yield (
                f"[main_shaft] bearing_to_joint is {self.bearing_to_joint} m; expected "
                "dimensions in metres, at most 20 m"
            )
        if not self.inner_diameter < self.outer_diameter:
            yield (
                f"[main_shaft] inner_diameter is {self.inner_diameter} m; expected less "
                f"than outer_diameter {self.outer_diameter} m"
            )
        room = 2.0 * min(self.bearing_to_joint, self.bearing_to_flange)
        if not self.bearing_width < room:
            yield (
                f"[main_shaft] bearing_width is {self.bearing_width} m: the bearing reaches "
                f"an end of the shaft; expected less than {room} m, twice bearing_to_joint and "
                "bearing_to_flange"
            )
        if not self.hub_to_bearing >= self.bearing_to_flange:
            yield (
                f"[main_shaft] hub_to_bearing is {self.hub_to_bearing} m; expected at least "
                f"bearing_to_flange {self.bearing_to_flange} m: the hub is upwind of the flange"
            )

    @property
    def length(self) -> float:
        """Length of the elastic shaft, flange to carrier joint [m]."""
        return self.bearing_to_joint + self.bearing_to_flange

    def joint_x(self, carrier: CarrierParameters) -> float:
        """Axial position of the joint in the carrier's frame [m].

        It is the upwind face of the carrier's hub.
        """
        return -carrier.hub_length

    def bearing_x(self, carrier: CarrierParameters) -> float:
        """Axial position of the main bearing's centre [m]."""
        return self.joint_x(carrier) - self.bearing_to_joint

    def bearing_seat_x(self, carrier: CarrierParameters) -> tuple[float, float]:
        """Axial extent of the main bearing's seat [m]."""
        centre = self.bearing_x(carrier)
        return centre - self.bearing_width / 2.0, centre + self.bearing_width / 2.0

    def flange_x(self, carrier: CarrierParameters) -> float:
        """Axial position of the coupling's flange, the shaft's upwind end [m]."""
        return self.joint_x(carrier) - self.length

    def check_fits(self, carrier: CarrierParameters) -> None:
        """Raise ValueError where the shaft does not fit `carrier`.

        The message names the parameter.
        """
        if not carrier.hub_inner_diameter < self.outer_diameter <= carrier.hub_outer_diameter:
            raise ValueError(
                f"[main_shaft] outer_diameter is {self.outer_diameter} m; expected between "
                f"the hub_inner_diameter {carrier.hub_inner_diameter} m and the hub_outer_diameter "
                f"{carrier.hub_outer_diameter} m of the carrier, whose hub it carries"
            )
