"""How far parameters move where they are fitted beside a discrepancy of no known form.

``F = J theta + sum_j c_j phi_j + noise``, ``c_j ~ N(0, tau_j²)`` over the columns phi of all
classes, ``tau_j² = d² / (n pi rms_j²)``: together the n columns make, beyond what the parameters
take up (the mean share pi), the mean square d² that the fit leaves above the floor. The shift of
theta against the fit without them tells how far the answer hangs on the discrepancy's form.

References
----------
.. [1] M. C. Kennedy, A. O'Hagan, "Bayesian calibration of computer models", J. R. Statist. Soc. B
   63 (2001) 425-464.
.. [2] J. Brynjarsdottir, A. O'Hagan, "Learning about physical parameters: the importance of model
   discrepancy", Inverse Problems 30 (2014) 114007: why the shift and not the posterior, which is
   drawn to a discrepancy of mean zero.
"""

import numpy as np

from carrierflex.diagnosis.classes.gram_table import GramTable
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.identification.estimation.scaled_least_squares import full_inverse, normal_inverse


def discrepancy_shift(table: GramTable, J: FloatArray, *, independent_samples: float) -> FloatArray:
    """Shift of parameters that are fitted beside a discrepancy, shape (p,).

    Parameters
    ----------
    table : GramTable
        Columns of target, baseline, classes and laws.
    J : ndarray, shape (n_columns, p)
        Derivatives of the target by the parameters, as coefficients of the columns.
    independent_samples : float
        Samples whose noise is independent, N_eff: the floor of a sample is taken N / N_eff times.

    Returns
    -------
    ndarray, shape (p,)
        Zero where the fit leaves no more than the floor, and for a parameter without a derivative.
    """
    G = table.total
    columns = np.concatenate([table.groups[name].columns for name in table.ceiling])
    columns = columns[np.diag(G)[columns] > 0.0]
    # Zero for a parameter without a derivative.
    A_inverse = normal_inverse(J.T @ G @ J)
    coupling = J.T @ G[:, columns]
    fitted = A_inverse @ (J.T @ G[:, 0])
    floor = float(table.floor.sum())
    above_floor = G[0, 0] - fitted @ (J.T @ G[:, 0]) - floor
    if not above_floor > 0.0:
        return np.zeros(J.shape[1])
    products = G[np.ix_(columns, columns)]
    energy = np.diag(products)
    left = products - coupling.T @ A_inverse @ coupling
    share_beyond = float(np.mean(np.diag(left) / energy))
    tau_square = above_floor / (columns.size * share_beyond * energy)
    ridge = floor / independent_samples / tau_square
    target = G[columns, 0] - coupling.T @ fitted
    c = full_inverse(left + np.diag(ridge)) @ target
    return np.asarray(-A_inverse @ (coupling @ c))
