"""Parts of a campaign's runs whose weights and products are in memory at once.

A usual campaign is one part. Products are kept for the next step of a fit as long as they fit.
"""

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from carrierflex.diagnosis.carrier.records.sums import CarrierSums, FloatArray, IntArray

#: Bytes of products of columns in a part, for a usual set of so many columns, and of those that are
#: kept. Weights of a part, their derivatives and what works on them are some four times as large.
_PART_BYTES = 50_000_000
_USUAL_COLUMNS = 40
_KEPT_BYTES = 100_000_000


class _KeptProducts:
    """Products by name, columns and part, the last used of them up to a limit of bytes."""

    def __init__(self) -> None:
        self._kept: OrderedDict[tuple[str, tuple[int, ...], int], FloatArray] = OrderedDict()
        self._n_bytes = 0

    def of(
        self, name: str, columns: IntArray, part: slice, make: Callable[[], FloatArray]
    ) -> FloatArray:
        """Products that are kept, or made and kept."""
        key = (name, tuple(columns.tolist()), int(part.start))
        if key in self._kept:
            self._kept.move_to_end(key)
            return self._kept[key]
        made = make()
        self._kept[key] = made
        self._n_bytes += made.nbytes
        while self._n_bytes > _KEPT_BYTES and len(self._kept) > 1:
            self._n_bytes -= self._kept.popitem(last=False)[1].nbytes
        return made

    def let_go(self) -> None:
        """Keep none of them."""
        self._kept.clear()
        self._n_bytes = 0


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
        usual_bytes = 8 * self.records.counts.size * _USUAL_COLUMNS**2
        n_parts = min(-(-usual_bytes // _PART_BYTES), self.n_runs)
        edges = np.linspace(0, self.n_runs, n_parts + 1).astype(int).tolist()
        return tuple(slice(first, end) for first, end in pairwise(edges))

    def segments(self, part: slice) -> slice:
        """Segments of the runs of a part."""
        first, end = np.searchsorted(self.records.run_of_segment, [part.start, part.stop])
        return slice(int(first), int(end))

    def runs(self, part: slice) -> IntArray:
        """Number of the run of every segment of a part, counted in the part."""
        return self.records.run_of_segment[self.segments(part)] - part.start

    def gram(self, columns: IntArray, part: slice) -> FloatArray:
        """Products of some columns by segment of a part and channel, shape (P, C, u, u)."""
        return self._kept.of(
            "segments", columns, part, lambda: self.records.gram(columns, self.segments(part))
        )

    def gram_of_runs(self, columns: IntArray, part: slice) -> FloatArray:
        """Products of some columns by run of a part and channel."""
        first = np.searchsorted(self.runs(part), np.arange(part.stop - part.start))
        if first.size == self.runs(part).size:
            return self.gram(columns, part)
        return self._kept.of(
            "runs", columns, part, lambda: np.add.reduceat(self.gram(columns, part), first, axis=0)
        )

    def let_go(self) -> None:
        """Keep no products, before those of another problem are made: they are made again."""
        self._kept.let_go()

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
    def _kept(self) -> _KeptProducts:
        return _KeptProducts()
