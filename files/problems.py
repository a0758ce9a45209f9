"""Several things wrong with one input, told in one error."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager

#: As many problems of one input are listed; further ones are counted.
MOST_LISTED = 20


class ProblemsError(ValueError):
    """More than one thing is wrong.

    Parameters
    ----------
    problems : tuple of str
        One text each, in the order of the input.
    about : str, optional
        The input, for the message: a file name.
    """

    def __init__(self, problems: tuple[str, ...], about: str = "") -> None:
        numbered = enumerate(problems[:MOST_LISTED], start=1)
        listed = [f"({number}) {problem}" for number, problem in numbered]
        more = len(problems) - len(listed)
        tail = f"; and {more} more" if more else ""
        where = f" in {about}" if about else ""
        super().__init__(f"{len(problems)} problems{where}: {'; '.join(listed)}{tail}")
        self.problems = problems
        self.about = about

    def __reduce__(self) -> tuple[type["ProblemsError"], tuple[tuple[str, ...], str]]:
        """What another process makes the error of: by default it would be given the message."""
        return type(self), (self.problems, self.about)


def problems_of(error: ValueError) -> tuple[str, ...]:
    """Texts of the problems that an error tells, one or several."""
    return error.problems if isinstance(error, ProblemsError) else (str(error),)


def refuse(problems: Iterable[str], about: str = "") -> None:
    """Raise where there is a problem.

    Parameters
    ----------
    problems : iterable of str
        One text each.
    about : str, optional
        The input, for the message: a file name.

    Raises
    ------
    ValueError
        One problem as it stands, several listed by :class:`ProblemsError`.
    """
    distinct = tuple(dict.fromkeys(problems))
    if len(distinct) == 1:
        raise ValueError(f"{about}: {distinct[0]}" if about else distinct[0])
    if distinct:
        raise ProblemsError(distinct, about)


def repeated_names(names: Iterable[str], what: str) -> Iterator[str]:
    """One problem for every name that stands more than once; `what` says whose names they are."""
    counts: dict[str, int] = {}
    for name in names:
        counts[name] = counts.get(name, 0) + 1
    for name, count in counts.items():
        if count > 1:
            times = "twice" if count == 2 else f"{count} times"
            yield f"{what} '{name}' occurs {times}; expected different names"


class Problems:
    """Collects what is wrong with one input, so that all of it is told at once."""

    def __init__(self) -> None:
        self.messages: list[str] = []

    @contextmanager
    def at(self, where: str = "") -> Iterator[None]:
        """Keep the ValueError of the block as problems of the place `where`; do not raise it."""
        try:
            yield
        except ValueError as error:
            before = f"{where}: " if where else ""
            self.messages += [before + problem for problem in problems_of(error)]
