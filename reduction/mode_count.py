"""How many fixed-interface modes a body needs.

By number, by cut-off frequency, or by the error of its response.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from carrierflex.fe.structural_model import StructuralModel
from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.reduction.dynamic_stiffness import full_response, modes_needed
from carrierflex.reduction.fixed_interface_modes import count_below
from carrierflex.reduction.held_structure import GroundedBody, HeldStructure

#: Fixed-interface modes kept where the user does not say.
DEFAULT_MODES = 20
#: A basis larger than this is not tried for a response error.
_MOST_MODES = 320


def chosen_mode_count(
    structure: StructuralModel, body: GroundedBody, options: Mapping[str, Any]
) -> int:
    """Number of modes by what the options ask for.

    Parameters
    ----------
    structure : StructuralModel
        The body.
    body : GroundedBody
        The same, to be factorised once for the count and the reduction.
    options : mapping
        ``modes`` (a number), ``max_frequency`` [Hz], or ``frf_tolerance`` with ``frf_up_to`` [Hz];
        None where not asked for.

    Returns
    -------
    int
        Number of fixed-interface modes.

    Raises
    ------
    ValueError
        Where a value is out of range, or more modes would be needed than are tried.
    """
    if options.get("frf_tolerance") is not None:
        return modes_for_response(
            structure, body, float(options["frf_up_to"]), float(options["frf_tolerance"])
        )
    if options.get("max_frequency") is not None:
        held = HeldStructure(body, structure.pilots)
        return count_below(
            held, structure.M, float(options["max_frequency"]), rng=np.random.default_rng(0)
        )
    return DEFAULT_MODES if options.get("modes") is None else int(options["modes"])


def modes_for_response(
    structure: StructuralModel, body: GroundedBody, frequency_hz: float, tolerance: float
) -> int:
    """Fewest modes whose frequency response at pilots and sensors is met up to a frequency.

    Parameters
    ----------
    structure : StructuralModel
        The body.
    body : GroundedBody
        Its factor.
    frequency_hz : float
        End of the band [Hz].
    tolerance : float
        Largest error allowed, as :func:`carrierflex.reduction.dynamic_stiffness.response_error`
        measures it.

    Returns
    -------
    int
        Number of modes.

    Raises
    ------
    ValueError
        Where frequency or tolerance is not positive, or 320 modes are not enough.
    """
    if not (frequency_hz > 0.0 and tolerance > 0.0):
        raise ValueError(
            f"response error {tolerance:g} up to {frequency_hz:g} Hz; expected a positive tolerance and a positive frequency"
        )
    # The series of the left-out modes converges from twice the band's end on.
    held = HeldStructure(body, structure.pilots)
    n_modes = max(
        10, count_below(held, structure.M, 2.0 * frequency_hz, rng=np.random.default_rng(0)) + 4
    )
    while True:
        response = full_response(structure, craig_bampton(structure, n_modes, body=body))
        try:
            return modes_needed(response, frequency_hz, tolerance)
        except ValueError:
            if 2 * n_modes > _MOST_MODES:
                raise
            n_modes *= 2
