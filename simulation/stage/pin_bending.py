"""Bending stress of planet pins as simply supported beams, from what planets press on them.

For pins without finite elements. Planet and pin touch in two rows side by side, each pressing
evenly over half the bearing's width; the bores carry the pin at their middles and hold no moment:

    M(x) = A (x - x_A) - Σ_i q_i / 2 [(x - a_i)₊² - (x - b_i)₊²]
    σ(x, φ) = 32 / (π d³) M(x) · n(φ)

with the forces q_i per length of the rows from a_i to b_i and the support's force A upwind, all
across the pin, and n the outward normal: the side towards which the planet presses is in tension.

References
----------
Young, Budynas, Sadegh (2012), Roark's Formulas for Stress and Strain, 8th ed., table 8.1, case 2e:
partial distributed load on supported ends. Shear and the bores' finite width are not in it.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.dihedral import rotation_about_x
from carrierflex.geometry.parameters import PinParameters
from carrierflex.simulation.stage.part_loads import PartLoads
from carrierflex.simulation.stage.stage_model import StageModel

Array = NDArray[np.float64]

#: Stations along the pin and fibres around it at which stress is looked for.
_STATIONS, _FIBRES = 60, 36


@dataclass(frozen=True)
class PinBeam:
    """A pin as beam.

    Parameters
    ----------
    upwind, midspan, downwind : float
        Middle of the upwind bore, of the planet and of the downwind bore along x [m].
    bearing_width : float
        Width over which the planet presses on the pin [m].
    diameter : float
        Diameter [m].
    distance : float
        Distance of its axis from the carrier's [m].

    Raises
    ------
    ValueError
        Where the planet's bearing does not lie between the middles of the bores.
    """

    upwind: float
    midspan: float
    downwind: float
    bearing_width: float
    diameter: float
    distance: float

    def __post_init__(self) -> None:
        half = self.bearing_width / 2.0
        if not self.upwind <= self.midspan - half < self.midspan + half <= self.downwind:
            raise ValueError(
                f"a bearing of {self.bearing_width} m about x = {self.midspan} m; expected one "
                f"between the middles of the bores, {self.upwind} and {self.downwind} m"
            )

    @property
    def stations(self) -> Array:
        """Where along x stress is looked for [m], shape (n_stations,)."""
        return np.linspace(self.upwind, self.downwind, _STATIONS + 1)

    @property
    def fibres(self) -> Array:
        """Where around the pin [rad], from the direction away from the axis, shape (n_fibres,)."""
        return 2.0 * np.pi * np.arange(_FIBRES) / _FIBRES

    def point(self, station: int, fibre: int, angle: float) -> Array:
        """Point [m] on the surface of the pin at a carrier-frame angle [rad], shape (3,)."""
        phi, r = self.fibres[fibre], self.diameter / 2.0
        # On pin 1 the radial direction is z, the tangential one -y.
        of_pin_1 = [self.stations[station], -r * np.sin(phi), self.distance + r * np.cos(phi)]
        return np.asarray(rotation_about_x(angle) @ of_pin_1)

    def bending_moment(self, loads: PartLoads) -> Array:
        """Moment M across the pin [N m], shape (N, p, n_stations, 2): radial and tangential.

        Force F and moment M of a planet are a force ``F / 2 +- x × M / h`` of each row, the middles
        of the rows ``h`` apart.
        """
        h = self.bearing_width / 2.0
        rows = loads.row_forces(h)
        middle = self.midspan + np.array([-h, h]) / 2.0
        A = np.einsum("npri,r->npi", rows, (self.downwind - middle) / (self.downwind - self.upwind))
        x = self.stations
        lever = (x[:, None] - middle + h / 2.0).clip(0.0) ** 2
        lever -= (x[:, None] - middle - h / 2.0).clip(0.0) ** 2
        pressed = np.einsum("npri,xr->npxi", rows / h, lever / 2.0)
        return np.asarray(A[:, :, None] * (x - self.upwind)[:, None] - pressed)

    def stress(self, loads: PartLoads) -> Array:
        """Axial stress on the surface [Pa], shape (N, p, n_stations, n_fibres)."""
        n = np.stack([np.cos(self.fibres), np.sin(self.fibres)])
        section = math.pi * self.diameter**3 / 32.0
        return np.asarray(self.bending_moment(loads) @ n / section)


def pin_beam(model: StageModel, pin: PinParameters) -> PinBeam:
    """Beam of a stage whose pins are joined to the carrier's bores.

    Parameters
    ----------
    model : StageModel
        The stage.
    pin : PinParameters
        Dimensions of the pins.
    """
    pilots = model.layout.body.model.pilots
    middle = pilots[model.layout.body.planet_pilots[0]]
    return PinBeam(
        upwind=float(pilots["pin_1_upwind"][0]),
        midspan=float(middle[0]),
        downwind=float(pilots["pin_1_downwind"][0]),
        bearing_width=pin.bearing_width,
        diameter=pin.diameter,
        distance=float(np.linalg.norm(middle[1:])),
    )
