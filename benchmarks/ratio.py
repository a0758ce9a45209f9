"""What a benchmark yields: ours beside a peer's from the same run, and their ratio."""

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Quantity:
    """What is measured: name, unit, and which direction is the better one."""

    name: str
    unit: str = ""
    larger_is_better: bool = False


TIME = Quantity("wall time", "s")
PROCESSOR_TIME = Quantity("processor time", "s")
#: Simulated seconds per second of wall time.
SPEED = Quantity("speed", "s/s", larger_is_better=True)
MEMORY = Quantity("peak memory", "GB")
#: Relative to the largest value of the reference.
ERROR = Quantity("error")
#: Relative difference of two codes' results.
DIFFERENCE = Quantity("difference")


@dataclass(frozen=True)
class Bound:
    """What is wanted of a number: at least, or at most, a limit."""

    comparison: Literal[">=", "<="]
    limit: float

    def met_by(self, number: float) -> bool:
        """True where the number is on the wanted side of the limit; never for nan."""
        return number >= self.limit if self.comparison == ">=" else number <= self.limit

    def __str__(self) -> str:
        number = f"{self.limit:g}" if self.limit >= 1e-2 else f"{self.limit:.0e}"
        return f"{self.comparison} {number}"


def at_least(limit: float) -> Bound:
    """Lower bound."""
    return Bound(">=", limit)


def at_most(limit: float) -> Bound:
    """Upper bound."""
    return Bound("<=", limit)


@dataclass(frozen=True)
class Ratio:
    """One measured quantity, a peer's beside it, and how many times ours is better.

    Parameters
    ----------
    case : str
        What it was measured on: a size, a model, a record.
    quantity : Quantity
        What was measured.
    value : float
        Ours, in the quantity's unit.
    peer : str
        What ours is compared with; empty where a figure stands alone.
    peer_value : float, optional
        The peer's, in the same unit; None where `value` already is the comparison, as a difference.
    wanted : Bound, optional
        Of the ratio where there is one, of the value otherwise; stated for the full sizes.
    note : str
        How the two values came about, where the case does not say it.
    """

    case: str
    quantity: Quantity
    value: float
    peer: str = ""
    peer_value: float | None = None
    wanted: Bound | None = None
    note: str = ""

    @property
    def ratio(self) -> float | None:
        """How many times ours is better: the peer's over ours, for a speed ours over the peer's."""
        if self.peer_value is None:
            return None
        better, other = self.peer_value, self.value
        if self.quantity.larger_is_better:
            better, other = other, better
        return better / other if other else float("inf")

    @property
    def met(self) -> bool | None:
        """Whether what is wanted was reached; None where nothing is wanted."""
        if self.wanted is None:
            return None
        return self.wanted.met_by(self.value if self.ratio is None else self.ratio)


@dataclass(frozen=True)
class Absent:
    """A peer that was not measured, and why: mostly a code that is not on this machine."""

    peer: str
    reason: str


@dataclass(frozen=True)
class Failed:
    """A benchmark that ended early, and why in one line."""

    reason: str


Row = Ratio | Absent | Failed
