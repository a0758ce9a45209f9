"""An interruption ends the block, also where a library takes it for an error of its own."""

import signal
from collections.abc import Iterator

import numpy as np
import pytest

from carrierflex.workflows.interruption import (
    TerminationError,
    interruptible,
    interruption_deferred,
)

ENDED_BY = {signal.SIGINT: KeyboardInterrupt, signal.SIGTERM: TerminationError}


@pytest.fixture(autouse=True)
def handlers() -> Iterator[None]:
    """Those of the tests stand again after each."""
    before = {number: signal.getsignal(number) for number in ENDED_BY}
    signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


class _Interrupted:
    """A file that is interrupted while numpy asks whether it is the name of one."""

    def __init__(self, number: int) -> None:
        self.number = number

    @property
    def __class__(self) -> type:
        signal.raise_signal(self.number)
        return object


@pytest.mark.parametrize("number", ENDED_BY)
def test_an_interruption_ends_the_block(number):
    with pytest.raises(ENDED_BY[number]), interruptible():
        signal.raise_signal(number)


@pytest.mark.parametrize("number", ENDED_BY)
def test_what_a_library_makes_of_an_interruption_is_one(number):
    with pytest.raises(ENDED_BY[number]) as caught, interruptible():
        np.zeros(3).tofile(_Interrupted(number))
    assert isinstance(caught.value.__cause__, TypeError)


def test_an_error_of_the_block_stays_what_it_is():
    with pytest.raises(ZeroDivisionError), interruptible():
        raise ZeroDivisionError


def test_handlers_are_put_back():
    before = [signal.getsignal(number) for number in ENDED_BY]
    with interruptible():
        assert signal.getsignal(signal.SIGTERM) not in before
    assert [signal.getsignal(number) for number in ENDED_BY] == before


def test_an_interruption_that_the_shell_lets_a_job_ignore_is_ignored():
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with interruptible():
        signal.raise_signal(signal.SIGINT)


def _interrupted_while_deferred(number: int, ended: list[int]) -> None:
    with interruptible(), interruption_deferred():
        signal.raise_signal(number)
        ended.append(number)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_what_is_deferred_interrupts_behind_the_block(number):
    ended = []
    with pytest.raises(ENDED_BY[number]):
        _interrupted_while_deferred(number, ended)
    assert ended == [number]
