"""Sizes that follow from a case: refused before anything is computed or taken from memory."""

from collections.abc import Mapping

#: Numbers that the runs of a case may hold where they are in memory: 0.8 GB, as much again for
#: what is made of them.
MOST_IN_MEMORY = 100_000_000
#: Numbers of one run file that is written piece by piece: what a campaign's reader takes.
MOST_IN_A_FILE = 1_000_000_000
#: Steps of one run: at ten microseconds each, three hours.
MOST_STEPS = 1_000_000_000


def refuse_size(file: str, keys: Mapping[str, float], numbers: float, most: int) -> None:
    """Refuse records that are too long.

    Parameters
    ----------
    file : str
        Case file, for the message.
    keys : mapping of str to float
        Keys that the size follows from, with their unit (``duration [s]``), and their values.
    numbers : float
        Numbers that the records would hold.
    most : int
        Largest number of them.

    Raises
    ------
    ValueError
        Where there would be more; the message tells keys and estimate.
    """
    # Not "larger than": NaN and inf are refused too.
    if not numbers <= most:
        given = ", ".join(f"'{key}' {value:.6g}" for key, value in keys.items())
        raise ValueError(
            f"{file}: keys {given} make {numbers:.3g} numbers ({8e-9 * numbers:.3g} GB); expected "
            f"at most {most:.3g}"
        )


def refuse_steps(file: str, duration: float, step: float | None) -> None:
    """Refuse a step that would keep the machine busy for hours.

    Raises
    ------
    ValueError
        Where a run of `duration` [s] takes more than a thousand million steps of `step` [s].
    """
    if step is not None and not duration / step <= MOST_STEPS:
        raise ValueError(
            f"{file}: key 'step' {step:.6g} s makes {duration / step:.3g} steps in {duration:.6g} "
            f"s; expected at most {MOST_STEPS:.3g}"
        )
