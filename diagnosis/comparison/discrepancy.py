"""What a kind of campaign tells of errors that are neither noise nor gains."""

from typing import Protocol, runtime_checkable

from carrierflex.diagnosis.comparison.problem import Effects, FloatArray


@runtime_checkable
class WithDiscrepancy(Protocol):
    """Problem whose parameters are known beside causes that it may lack."""

    @property
    def signal_square(self) -> float:
        """Sum of squares of the measured response about its mean, all runs."""
        ...

    @property
    def has_one_frequency(self) -> bool:
        """Whether one and the same frequency drives all runs."""
        ...

    def discrepancy_shift(self, effects: Effects, theta: FloatArray) -> FloatArray:
        """Shift of the parameters of a fit beside a discrepancy, shape (p,)."""
        ...

    def delay_words(self, theta: FloatArray) -> str:
        """What a delay that no record shows does to the baseline; empty where it would show."""
        ...
