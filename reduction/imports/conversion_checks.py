"""What can be checked of a reduced body alone, before and after it changed its format."""

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from carrierflex.reduction.dynamic_stiffness import LOSS_FACTOR
from carrierflex.reduction.modes.dense_modes import dense_modes
from carrierflex.reduction.reduced_model import ReducedModel
from carrierflex.reduction.rigid_body_checks import grounding

_SIX = 6
_FREQUENCIES = 6
#: Frequencies at which responses are compared, up to that of the third free mode.
_RESPONSES, _UP_TO_MODE = 20, 3


@dataclass(frozen=True)
class ConversionCheck:
    """One figure of a body, before and after."""

    name: str
    """Figure, with its unit."""
    before: float | None
    """Of the body as it was read; None of a comparison."""
    after: float | None
    """Of the written file read back; None where it is not."""
    difference: float | None
    """Relative difference of both; a place's over the extent of the pilots; None of rounding."""


def conversion_checks(
    before: ReducedModel, after: ReducedModel | None
) -> tuple[ConversionCheck, ...]:
    """Figures of a body, and of the same body read back from the file it was written to.

    Parameters
    ----------
    before : ReducedModel
        The body.
    after : ReducedModel or None
        The body read back; None where the format is not read.

    Returns
    -------
    tuple of ConversionCheck
        Mass, centre, principal moments, rigid motions, symmetry, definiteness, free frequencies,
        and the frequency response at the pilots that both have.
    """
    first = _figures(before)
    second = {} if after is None else _figures(after)
    checks = [
        ConversionCheck(name, value, second.get(name), _difference(name, value, second, before))
        for name, value in first.items()
    ]
    if after is not None:
        checks.append(_response(before, after))
    return tuple(checks)


def _figures(model: ReducedModel) -> dict[str, float]:
    """Figures by name; those of rounding alone are listed in :data:`_ROUNDING`."""
    mass = model.mass_properties
    squares, _ = dense_modes(model.K, model.M)
    frequencies = np.sqrt(np.abs(squares)) / (2.0 * np.pi)
    n_free = model.n_free_motions
    figures = {"pilots": float(len(model.pilots)), "coordinates": float(model.n_coordinates)}
    figures["mass [kg]"] = mass.mass
    figures |= {f"centre {axis} [m]": float(x) for axis, x in zip("xyz", mass.centre, strict=True)}
    moments = np.linalg.eigvalsh(mass.inertia)
    figures |= {f"principal moment {i} [kg m^2]": float(J) for i, J in enumerate(moments, start=1)}
    figures["free rigid motions"] = float(n_free)
    if n_free:
        figures["highest frequency of these [Hz]"] = float(frequencies[:n_free].max(initial=0.0))
    if n_free == _SIX:
        figures["grounding of the stiffness [m or rad]"] = grounding(model)
    for letter in "KM":
        A: NDArray[np.float64] = getattr(model, letter)
        figures[f"asymmetry of {letter}, max |A - A^T| / max |A|"] = float(
            np.abs(A - A.T).max() / np.abs(A).max()
        )
        s = 1.0 / np.sqrt(np.maximum(np.abs(A.diagonal()), np.finfo(float).tiny))
        figures[f"lowest eigenvalue of {letter} scaled to unit diagonal"] = float(
            scipy.linalg.eigvalsh((A + A.T) / 2.0 * np.outer(s, s), subset_by_index=[0, 0])[0]
        )
    elastic = frequencies[n_free : n_free + _FREQUENCIES]
    figures |= {f"frequency {i} [Hz]": float(f) for i, f in enumerate(elastic, start=1)}
    return figures


def _difference(
    name: str, value: float, second: dict[str, float], model: ReducedModel
) -> float | None:
    if name not in second or not name.startswith(
        ("pilots", "coordinates", "mass", "centre", "principal", "free rigid", "frequency")
    ):
        return None
    size = abs(value)
    if name.startswith("centre"):
        points = np.array([*model.pilots.values(), model.mass_properties.centre])
        size = float(np.ptp(points, axis=0).max())
    difference = abs(second[name] - value)
    return difference / size if size > 0.0 else difference


def _response(before: ReducedModel, after: ReducedModel) -> ConversionCheck:
    """Largest difference of the receptances at common pilots, over the roots of their diagonals."""
    common = [
        name
        for name in before.pilots
        if name in after.pilots and before.components_of(name) == after.components_of(name)
    ]
    if not common:
        return ConversionCheck("frequency response: no common pilot", None, None, None)
    squares, _ = dense_modes(before.K, before.M)
    last = min(before.n_free_motions + _UP_TO_MODE, len(squares)) - 1
    top = float(np.sqrt(abs(squares[last])))
    worst = 0.0
    for omega in np.linspace(0.05, 1.0, _RESPONSES) * top:
        first, second = (_receptance(model, common, omega) for model in (before, after))
        size = np.sqrt(np.abs(np.outer(first.diagonal(), first.diagonal())))
        worst = max(worst, float((np.abs(second - first) / size).max()))
    name = f"frequency response up to {top / (2.0 * np.pi):.0f} Hz, pilots: {len(common)}"
    return ConversionCheck(name, None, None, worst)


def _receptance(model: ReducedModel, pilots: list[str], omega: float) -> NDArray[np.complex128]:
    """Motion of pilots by force at them, ``[K (1 + i η) + i ω D - ω² M]⁻¹``."""
    rows = np.concatenate([model.rows_of(name) for name in pilots])
    # Scaled to unit mass or stiffness: displacements, rotations and amplitudes.
    s = 1.0 / np.sqrt(np.abs(model.M.diagonal()) * omega**2 + np.abs(model.K.diagonal()))
    Z = model.K * (1.0 + 1j * LOSS_FACTOR) + 1j * omega * model.D - omega**2 * model.M
    answer = np.linalg.solve(Z * np.outer(s, s), np.diag(s)[:, rows])
    return np.asarray(s[rows, None] * answer[rows])
