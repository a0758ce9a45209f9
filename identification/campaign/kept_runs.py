"""Runs of a campaign as they are read: in memory, those of a large campaign on disk."""

from carrierflex.files.temporary_store import TemporaryStore
from carrierflex.identification.campaign.records import Run

#: Bytes of all records up to which they are kept in memory.
_IN_MEMORY = 200_000_000


class KeptRuns:
    """Runs that are added one by one.

    As long as they are few they stay in memory. Where all of them, as large as the first, or those
    that were added take more, the signals are in a file of the temporary folder and are read where
    they are asked for, unless that is full.
    """

    def __init__(self, expected: int = 1, in_memory: int = _IN_MEMORY) -> None:
        self._expected = expected
        self._in_memory = in_memory
        self._runs: list[Run] = []
        self._n_bytes = 0
        self._store: TemporaryStore | None = None

    @property
    def runs(self) -> tuple[Run, ...]:
        """All runs, in the order in which they were added."""
        return tuple(self._runs)

    def add(self, run: Run) -> None:
        """Add a run.

        Raises
        ------
        OSError
            Where the temporary folder is full.
        """
        size = sum(values.nbytes for values in (run.time, *run.columns().values()))
        self._n_bytes += size
        foreseen = max(self._n_bytes, size * self._expected if not self._runs else 0)
        if self._store is None and foreseen > self._in_memory and TemporaryStore.has_room(foreseen):
            self._store = TemporaryStore()
            self._runs = [own.on_disk(self._store) for own in self._runs]
        self._runs.append(run.on_disk(self._store) if self._store else run)
