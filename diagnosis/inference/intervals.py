"""95 % intervals of fitted parameters.

``h² = (t_{0.975, B-p} s)² + (1.96 theta gamma)²``: `s` is the sandwich over B blocks, `gamma` the
relative standard deviation by the declared gains of the signals. Published is ``h / 1.96``.

References
----------
.. [1] H. White, "A heteroskedasticity-consistent covariance matrix estimator and a direct test for
   heteroskedasticity", Econometrica 48 (1980) 817-838.
"""

import numpy as np
from scipy.stats import norm
from scipy.stats import t as student_t

from carrierflex.diagnosis.inference.effect_fit import EffectFit

#: Half width of a 95 % interval in standard deviations.
NORMAL_95 = float(norm.ppf(0.975))


def small_sample_factor(fit: EffectFit) -> float:
    """Factor on the sandwich's standard deviations for p parameters found from few blocks.

    ``t_{0.975, B-p} / 1.96 sqrt((B - 1) / (B - p))``: the fit takes p of the B degrees of freedom
    of the blocks' scores; the covariance of the fit counts one of them.

    Parameters
    ----------
    fit : EffectFit
        Parameters with the sums of every block.

    Returns
    -------
    float
        Not a number where there are no more blocks than free parameters.
    """
    held = np.array([parameter.lower >= parameter.upper for parameter in fit.parameters])
    n_free = int((~(held | fit.at_bound)).sum())
    n_blocks = len(fit.sums.square)
    degrees = n_blocks - max(n_free, 1)
    if degrees < 1:
        return float("nan")
    return float(student_t.ppf(0.975, degrees) / NORMAL_95 * np.sqrt((n_blocks - 1.0) / degrees))
