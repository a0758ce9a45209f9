"""How the unexplained force of an element grows with its deflection: the exponent of the missing law."""

from collections.abc import Sequence

import numpy as np

from diagnosis.element_model import ElementModel
from diagnosis.element_records import ElementRecord
from diagnosis.element_signatures import base_columns, known_force

#: Share of the blocks, the gentlest, that the linear element is fitted to.
_GENTLE = 1.0 / 8.0
#: Growth is told where the deflection of the blocks spans at least this factor.
_SPAN = 1.5
#: An unexplained force counts where its RMS is this many times that of the gentlest blocks.
_SEEN = 2.0
_FEWEST_POINTS = 3


def growth_exponent(model: ElementModel, records: Sequence[ElementRecord]) -> float | None:
    """Exponent p of ``unexplained force ~ deflection^p`` over the blocks.

    The baseline is fitted to the gentlest third of the blocks: fitted to all of them its stiffness and damping follow the
    largest deflections, and what they get wrong at the small ones hides the law.

    Parameters
    ----------
    model : ElementModel
        Baseline.
    records : sequence of ElementRecord
        Runs.

    Returns
    -------
    float or None
        3 for a cubic spring, 1 for a linear branch, near 0 for dry friction; None where the deflection hardly varies or the
        force does not stand out.
    """
    blocks = [(record, record.block == block) for record in records for block in range(record.n_blocks)]
    rows = {id(record): (base_columns(model, record), known_force(model, record)) for record in records}
    size = np.array([record.motion[0][own].std() for record, own in blocks])
    gentle = np.argsort(size)[: max(2, round(_GENTLE * len(blocks)))]
    design = np.concatenate([rows[id(blocks[k][0])][0][:, blocks[k][1]] for k in gentle], axis=1)
    target = np.concatenate([rows[id(blocks[k][0])][1][blocks[k][1]] for k in gentle])
    scale = np.linalg.norm(design, axis=1)
    scale[scale == 0.0] = 1.0
    solution = np.linalg.lstsq((design / scale[:, None]).T, target, rcond=1e-10)[0] / scale
    left = np.array([(rows[id(r)][1][own] - solution @ rows[id(r)][0][:, own]).std() for r, own in blocks])
    seen = left > _SEEN * np.sqrt(np.mean(left[gentle] ** 2))
    if seen.sum() < _FEWEST_POINTS or np.ptp(np.log(size[seen])) < np.log(_SPAN):
        return None
    return float(np.polyfit(np.log(size[seen]), np.log(left[seen]), 1)[0])
