"""Whole revolutions of a record: which sample belongs to which turn of the carrier."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.identification.campaign.records import Run


@dataclass(frozen=True, eq=False)
class Revolutions:
    """Samples of a record sorted into whole revolutions from its first sample.

    Parameters
    ----------
    samples : tuple of ndarray of int
        Sample numbers of each revolution, ascending; what lies beyond the last whole one is left
        out, and so is a revolution without a sample that counts (key ``use``).
    """

    samples: tuple[NDArray[np.int64], ...]

    @property
    def n_revolutions(self) -> int:
        """Number of whole revolutions."""
        return len(self.samples)


def whole_revolutions(run: Run) -> Revolutions:
    """Sort the samples of a record into whole revolutions.

    Revolution ``k`` holds the samples with ``2 pi k <= |theta - theta_0| < 2 pi (k + 1)`` in the
    direction of travel; a record that ends within one sampling step of a whole turn counts as a
    whole turn.

    Parameters
    ----------
    run : Run
        Record with the input ``carrier_angle`` [rad].

    Returns
    -------
    Revolutions
        At least one.

    Raises
    ------
    ValueError
        Where the carrier turns by less than one revolution, or none of them counts.
    """
    angle = run.inputs["carrier_angle"]
    travel = (angle - angle[0]) * np.sign(angle[-1] - angle[0])
    step = float(np.median(np.abs(np.diff(angle)))) if angle.size > 1 else 0.0
    turns = float(travel[-1]) / (2.0 * np.pi)
    # The margin of a thousandth of a step is far above rounding and far below a sample.
    n_revolutions = int(np.floor(turns + 1.001 * step / (2.0 * np.pi)))
    if n_revolutions < 1:
        raise ValueError(
            f"run {run.name}: the carrier turns by {turns:.3f} revolutions; expected at least one "
            "whole revolution"
        )
    number = np.floor(travel / (2.0 * np.pi)).astype(np.int64)
    order = np.argsort(number, kind="stable")
    bounds = np.searchsorted(number[order], np.arange(n_revolutions + 1))
    samples = [order[bounds[k] : bounds[k + 1]] for k in range(n_revolutions)]
    in_use = run.in_use
    counted = tuple(rows for rows in samples if in_use[rows].any())
    if not counted:
        raise ValueError(
            f"run {run.name}: no whole revolution has a sample in a window of 'use'; expected at "
            "least one"
        )
    return Revolutions(counted)
