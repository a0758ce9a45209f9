"""Parts of a campaign's runs whose weights and products are in memory at once.

A usual campaign is one part, whose products are kept for the next step of a fit.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise

import numpy as np

from carrierflex.diagnosis.carrier.records.sums import CarrierSums, FloatArray, IntArray

#: Bytes of products of columns that are kept, and columns of a usual set.
_KEPT_BYTES = 200_000_000
_USUAL_COLUMNS = 40


@dataclass(frozen=True, eq=False)
class RunParts:
    """Parts of the runs.

    Parameters
    ----------
    records : CarrierSums
        Sums over the records.
    n_runs : int
        Runs.
    """

    records: CarrierSums
    n_runs: int

    @cached_property
    def slices(self) -> tuple[slice, ...]:
        """Runs of every part."""
        n_parts = min(-(-self._usual_bytes // _KEPT_BYTES), self.n_runs)
        edges = np.linspace(0, self.n_runs, n_parts + 1).astype(int).tolist()
        return tuple(slice(first, end) for first, end in pairwise(edges))

    @property
    def _usual_bytes(self) -> int:
        return 8 * self.records.counts.size * _USUAL_COLUMNS**2

    def segments(self, part: slice) -> slice:
        """Segments of the runs of a part."""
        first, end = np.searchsorted(self.records.run_of_segment, [part.start, part.stop])
        return slice(int(first), int(end))

    def runs(self, part: slice) -> IntArray:
        """Number of the run of every segment of a part, counted in the part."""
        return self.records.run_of_segment[self.segments(part)] - part.start

    def gram(self, columns: IntArray, part: slice) -> FloatArray:
        """Products of some columns by segment of a part and channel, shape (P, C, u, u)."""
        if len(self.slices) > 1:
            return self.records.gram(columns, self.segments(part))
        return self._kept(tuple(columns.tolist()))

    def gram_of_runs(self, columns: IntArray, part: slice) -> FloatArray:
        """Products of some columns by run of a part and channel."""
        first = np.searchsorted(self.runs(part), np.arange(part.stop - part.start))
        return np.asarray(np.add.reduceat(self.gram(columns, part), first, axis=0))

    def values(
        self, weights_in: Callable[[slice], tuple[IntArray, FloatArray]]
    ) -> tuple[IntArray, FloatArray]:
        """Numbers of the columns in use and their weights in all runs, shape (n_runs, C, u).

        Parameters
        ----------
        weights_in : callable
            The same for the runs of a part.
        """
        found = [(part, *weights_in(part)) for part in self.slices]
        columns = np.unique(np.concatenate([used for _, used, _ in found]))
        values = np.zeros((self.n_runs, self.records.counts.shape[1], columns.size))
        for part, used, of_part in found:
            values[part, :, np.searchsorted(columns, used)] = of_part
        return columns, values

    @cached_property
    def _kept(self) -> Callable[[tuple[int, ...]], FloatArray]:
        def kept(columns: tuple[int, ...]) -> FloatArray:
            """Gram matrix of the columns with these numbers, by segment and channel."""
            return self.records.gram(np.array(columns))

        return lru_cache(maxsize=max(1, _KEPT_BYTES // self._usual_bytes))(kept)
