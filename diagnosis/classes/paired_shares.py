"""Shares whose gains are judged block by block, by the ratio of what is left.

A class that has not been where one block goes leaves there more than in all others together. The
difference to a class that holds there then scatters as much as it is, though every single block is
in its favour. The ratio of both in each block does not.
"""

from dataclasses import dataclass

import numpy as np

from carrierflex.diagnosis.classes.held_out import HeldOutSquares
from carrierflex.diagnosis.classes.shares import Shares

#: Rounding of a block's squares, as a share of what the baseline leaves there.
_ROUNDING = 1e-12


@dataclass(frozen=True, eq=False)
class PairedShares(Shares):
    """Shares of the gap; a gain counts where the blocks agree on it.

    ``mean(log(e_worse / e_better)) > t s / sqrt(n_blocks)``, s the standard deviation over the
    blocks and t the standard errors of the limits.

    References
    ----------
    .. [1] J. M. Bland, D. G. Altman, "Transformations, means, and confidence intervals", BMJ 312
       (1996) 1079: paired data whose differences grow with their size are compared by their ratio.
    """

    def is_beyond_scatter(self, gain: float, better: HeldOutSquares, worse: HeldOutSquares) -> bool:
        """Whether the ratio of what both leave is more than its scatter over the blocks."""
        least = _ROUNDING * self.before
        ratios = np.log(np.maximum(worse.squares, least) / np.maximum(better.squares, least))
        error = float(ratios.std()) / np.sqrt(ratios.size)
        return bool(float(ratios.mean()) > self.constants.standard_errors * error)
