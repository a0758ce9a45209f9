"""Deflection curves of the carrier's rim: displacement over the carrier-frame angle, per unit load.

``delta_s`` and ``delta_f`` of the 2012 paper (figures 7 and 8) are the axial curves of the carrier
with bonded pins (stiff) and without pins (flexible) under a torque of 1 kN m; ``g_s`` and ``g_f``
are those of one pin force of 1 N on pin 1, in the direction that a positive torque loads the pins.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

#: Points of the table that long records are read from: order 180 is met to 2e-10 of its amplitude.
_TABLE_SIZE = 65536
#: Share of the largest order that is more than what a free mesh's asymmetry makes.
_NOTABLE = 0.02
#: Angles from which on the table is worth its making.
_LONG_RECORD = 100
#: An extremum between two grid points is found on a grid this many times finer than the samples.
_PEAK_REFINEMENT = 16


@dataclass(frozen=True, eq=False)
class DeflectionCurve:
    """Axial and radial displacement of a material circle of the carrier under one unit load.

    Parameters
    ----------
    name : str
        ``delta_s``, ``delta_f``, ``g_s`` or ``g_f``.
    radius : float
        Radius of the material circle [m].
    unit_load : float
        The load the displacements belong to: 1000 N m for a torque curve, 1 N for a pin curve.
    axial, radial : ndarray, shape (n,)
        Displacement along +x and along e(angle) [m] at the n carrier-frame angles ``2 pi k / n``, k
        = 0..n-1.
    mesh_error : float
        Error of its largest wave by the mesh, over that wave; zero where it is not known.

    Raises
    ------
    ValueError
        Where the two arrays differ in length or hold fewer than eight samples or a value that is
        not finite.
    """

    name: str
    radius: float
    unit_load: float
    axial: NDArray[np.float64]
    radial: NDArray[np.float64]
    mesh_error: float = 0.0

    def __post_init__(self) -> None:
        if self.axial.shape != self.radial.shape or self.axial.ndim != 1 or self.axial.size < 8:
            raise ValueError(
                f"deflection curve {self.name}: axial {self.axial.shape} and radial "
                f"{self.radial.shape} must be one-dimensional, equally long and hold at least "
                "eight samples"
            )
        if not (np.isfinite(self.axial).all() and np.isfinite(self.radial).all()):
            raise ValueError(f"deflection curve {self.name}: every displacement must be finite")

    @cached_property
    def angle(self) -> NDArray[np.float64]:
        """Carrier-frame angles of the samples [rad], shape (n,)."""
        return 2.0 * np.pi * np.arange(self.axial.size) / self.axial.size

    def axial_at(self, angle: ArrayLike) -> NDArray[np.float64]:
        """Axial displacement [m] at any carrier-frame angle [rad]; same shape as `angle`."""
        return self._at("axial", np.asarray(angle, dtype=np.float64))

    def radial_at(self, angle: ArrayLike) -> NDArray[np.float64]:
        """Radial displacement [m] at any carrier-frame angle [rad]; same shape as `angle`."""
        return self._at("radial", np.asarray(angle, dtype=np.float64))

    def _at(self, direction: str, angle: NDArray[np.float64]) -> NDArray[np.float64]:
        """Trigonometric interpolation; of long records by a fine table of it."""
        if angle.size < _LONG_RECORD:
            return _fourier_series(getattr(self, direction), angle)
        if direction not in self._tables:
            self._tables[direction] = _table_of(getattr(self, direction))
        # Where help is asked for, no compiler is needed.
        from carrierflex.fe.curve_look_up import values_at

        return values_at(self._tables[direction], angle.ravel()).reshape(angle.shape)

    @cached_property
    def _tables(self) -> dict[str, NDArray[np.float64]]:
        """Tables of the directions that were asked for."""
        return {}

    def axial_order(self, order: int) -> complex:
        """Complex amplitude c of ``Re(c exp(j order angle))`` in the axial curve [m].

        An odd curve (sines only) has negative imaginary amplitudes: ``b sin(n angle) = Re(-j b
        exp(j n angle))``.
        """
        return complex(order_amplitudes(self.axial)[order])

    @property
    def rms(self) -> float:
        """RMS of the axial curve [m]; of orders N, 2 N, 3 N ... its mean is zero."""
        return float(np.sqrt(np.mean(self.axial**2)))

    @property
    def is_of_torque(self) -> bool:
        """Whether the load is a torque, on all pins alike; else the force on one pin."""
        return self.name.startswith("delta")

    def main_orders(self, n_planets: int) -> tuple[int, ...]:
        """Orders that make the curve: N, 2 N, 3 N for a torque, 1 to 3 for one pin's force."""
        step = n_planets if self.is_of_torque else 1
        return step, 2 * step, 3 * step

    def axial_order_content(self) -> NDArray[np.float64]:
        """Magnitude of every order 0, 1, 2, ... of the axial curve [m], shape (n // 2 + 1,)."""
        return np.abs(order_amplitudes(self.axial))

    @property
    def first_order(self) -> int:
        """Lowest order that the axial curve has a part of worth telling: the number of planets.

        Where the load is the same on all pins.
        """
        content = self.axial_order_content()[1:]
        return (
            int(np.flatnonzero(content > _NOTABLE * content.max())[0]) + 1 if content.any() else 1
        )

    def peak_angles(self) -> NDArray[np.float64]:
        """Carrier-frame angles of the local maxima of the axial curve [rad], ascending.

        Shape (n_peaks,).
        """
        n_fine = _PEAK_REFINEMENT * self.axial.size
        fine_angle = 2.0 * np.pi * np.arange(n_fine) / n_fine
        fine = self.axial_at(fine_angle)
        is_peak = (fine > np.roll(fine, 1)) & (fine >= np.roll(fine, -1))
        return fine_angle[is_peak]


def resampled(curve: DeflectionCurve, n: int) -> DeflectionCurve:
    """The same curve at n angles; its orders are below n / 2."""
    axial, radial = (
        np.fft.irfft(np.fft.rfft(values) * (n / values.size), n)
        for values in (curve.axial, curve.radial)
    )
    return replace(curve, axial=axial, radial=radial)


def amplitudes_along(
    axial: NDArray[np.float64], nominal: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Amplitude of every order of a curve along that of a nominal one, in its phase."""
    phase = np.exp(-1j * np.angle(order_amplitudes(nominal)))
    return np.asarray((order_amplitudes(axial) * phase).real)


def order_amplitudes(samples: NDArray[np.float64]) -> NDArray[np.complex128]:
    """Complex amplitude of every order of equally spaced samples of one turn.

    Orders 0 and n / 2 count once.

    Parameters
    ----------
    samples : ndarray, shape (..., n)
        Values over the last axis.

    Returns
    -------
    ndarray, shape (..., n // 2 + 1)
        ``c`` of ``Re(c exp(j order angle))``.
    """
    n = samples.shape[-1]
    amplitude = np.asarray(2.0 * np.fft.rfft(samples) / n)
    amplitude[..., 0] /= 2.0
    if n % 2 == 0:
        amplitude[..., -1] /= 2.0
    return amplitude


def _table_of(samples: NDArray[np.float64]) -> NDArray[np.float64]:
    """Cubics through value and slope of the trigonometric interpolation of one turn.

    They lie on a fine grid of angles: coefficients by cell, the highest power first.
    """
    width = 2.0 * np.pi / _TABLE_SIZE
    amplitude = order_amplitudes(samples)
    amplitude[1:] /= 2.0
    order = np.arange(amplitude.size)
    value, slope = (
        np.fft.irfft(spectrum, _TABLE_SIZE) * _TABLE_SIZE
        for spectrum in (amplitude, 1j * order * amplitude)
    )
    secant = (np.roll(value, -1) - value) / width
    end_slope = np.roll(slope, -1)
    c2 = (3.0 * secant - 2.0 * slope - end_slope) / width
    c3 = (slope + end_slope - 2.0 * secant) / width**2
    return np.stack([c3, c2, slope, value], axis=1)


def _fourier_series(
    samples: NDArray[np.float64], angle: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Trigonometric interpolation of equally spaced `samples` of one turn, at `angle` [rad].

    The series is a polynomial in ``exp(j angle)``: its powers are products, one exponential serves
    all orders. It ends with the last order whose amplitude is above rounding.
    """
    amplitude = order_amplitudes(samples)
    orders = np.flatnonzero(np.abs(amplitude) > 1e-14 * np.abs(amplitude).max(initial=0.0))
    series = amplitude[: orders.max(initial=0) + 1]
    powers = np.vander(np.exp(1j * angle.ravel()), series.size, increasing=True)
    return np.asarray((powers @ series).real.reshape(angle.shape))
