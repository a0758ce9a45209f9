"""How many modes a basis keeps: by number or by frequency, and never a part of a degenerate group.

Symmetric bodies have pairs of modes of one frequency. A basis that ends between the two answers
differently at pins that are equal, however small the pilots' static difference is.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

#: Neighbours in frequency closer than this share belong to one group. Pairs of a sector mesh agree
#: to 1e-13, those of a free mesh to about 1e-3; a group taken too large costs one mode more.
SAME_GROUP = 2e-3
#: Modes looked at beyond the number asked for.
_LOOK_AHEAD = 3
#: Modes looked for at first where only a frequency is given.
_FIRST_LOOK = 32
#: Share of the frequency of the last kept fixed-interface mode up to which a body is meant to be
#: used, and is checked.
CUT_OFF_SHARE = 0.25
#: The same of the last kept mode of a free-interface basis: its kept modes are exact.
FREE_CUT_OFF_SHARE = 0.5
#: Degrees of freedom up to which a body may keep all its modes.
_SMALL_BODY = 100
#: A basis of more modes than this is no reduction.
_MOST_MODES = 400


class Modes(Protocol):
    """Modes that were found."""

    @property
    def omega(self) -> NDArray[np.float64]:
        """Their angular frequencies [rad/s], ascending."""
        ...


SolvedModes = TypeVar("SolvedModes", bound=Modes)


class ModeRule(Protocol):
    """Says from the lowest frequencies how many modes are kept."""

    @property
    def first_look(self) -> int:
        """Number of modes to compute at first."""
        ...

    def count(self, omega: NDArray[np.float64]) -> int | None:
        """Modes to keep of a body whose lowest angular frequencies are `omega`, ascending.

        None where more of them are needed to tell.
        """
        ...


@dataclass(frozen=True)
class AtLeast:
    """A number of modes, and as many more as complete the last group."""

    n_modes: int

    def __post_init__(self) -> None:
        if self.n_modes < 0:
            raise ValueError(f"number of modes is {self.n_modes}; expected 0 or more")

    def __str__(self) -> str:
        return f"{self.n_modes} modes"

    @property
    def first_look(self) -> int:
        """Some more than the number."""
        return self.n_modes + _LOOK_AHEAD if self.n_modes else 0

    def count(self, omega: NDArray[np.float64]) -> int | None:
        """Modes up to the first gap behind the number."""
        return end_of_group(omega, self.n_modes)


@dataclass(frozen=True)
class Below:
    """All modes below a frequency [Hz], and as many more as complete the last group."""

    frequency_hz: float

    def __post_init__(self) -> None:
        if not 0.0 < self.frequency_hz < np.inf:
            raise ValueError(
                f"cut-off frequency is {self.frequency_hz} Hz; expected a positive frequency"
            )

    def __str__(self) -> str:
        return f"all modes below {self.frequency_hz:g} Hz"

    @property
    def first_look(self) -> int:
        """A usual number."""
        return _FIRST_LOOK

    def count(self, omega: NDArray[np.float64]) -> int | None:
        """Modes below, up to the first gap behind them."""
        below = int(np.count_nonzero(omega < 2.0 * np.pi * self.frequency_hz))
        return None if below == len(omega) else end_of_group(omega, below)


def rule_for_use(frequency_hz: float, share: float = CUT_OFF_SHARE) -> ModeRule:
    """Modes of a body used up to `frequency_hz` [Hz], a `share` of that of its last mode."""
    return Below(frequency_hz / share)


def rule_of(modes: int | ModeRule) -> ModeRule:
    """Rule itself, or that of a plain number."""
    return AtLeast(modes) if isinstance(modes, int) else modes


def modes_by_rule(
    rule: ModeRule, lowest_modes: Callable[[int], SolvedModes], n_dofs: int
) -> tuple[SolvedModes, int]:
    """Modes among which those are that a rule keeps, and the number of these.

    Parameters
    ----------
    rule : ModeRule
        How many.
    lowest_modes : callable
        Computes a number of lowest modes.
    n_dofs : int
        Degrees of freedom of the body.

    Raises
    ------
    ValueError
        Where the rule asks for more modes than a tenth of the degrees of freedom, or than 400; of a
        body of at most 100 degrees of freedom, for more than it has.
    """
    # Of a small body all modes are known at once, and all of them may be kept.
    most = min(n_dofs if n_dofs <= _SMALL_BODY else n_dofs // 10 - 1, _MOST_MODES)
    look = min(rule.first_look, most + _LOOK_AHEAD)
    whose = f"{n_dofs} degrees of freedom"
    while True:
        modes = lowest_modes(look)
        if len(modes.omega) < look:
            most = len(modes.omega)
            whose = "this body, which has no more modes: its other coordinates have no mass"
        count = rule.count(np.append(modes.omega, [np.inf] * (look - len(modes.omega))))
        if count is not None and count <= most:
            return modes, count
        if count is not None or look == most + _LOOK_AHEAD:
            raise ValueError(f"{rule} requested; expected at most {most} for {whose}")
        look = min(2 * look, most + _LOOK_AHEAD)


def end_of_group(omega: NDArray[np.float64], n_modes: int) -> int | None:
    """Smallest number of modes from `n_modes` on behind which a gap follows.

    Parameters
    ----------
    omega : ndarray, shape (k,)
        Lowest frequencies of the body, ascending.
    n_modes : int
        Number of modes wanted.

    Returns
    -------
    int or None
        None where no gap is seen behind the modes asked for.
    """
    if n_modes == 0:
        return 0
    gaps = np.flatnonzero(omega[n_modes:] > (1.0 + SAME_GROUP) * omega[n_modes - 1 : -1])
    return n_modes + int(gaps[0]) if len(gaps) else None
