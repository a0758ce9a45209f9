"""The identified parameters with their uncertainty, as one frozen result."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

#: Scope of a parameter with one value for all runs.
SHARED = ""


@dataclass(frozen=True, eq=False)
class ParameterEstimate:
    """Parameters of one model, identified from one run or jointly from several.

    Parameters
    ----------
    model : str
        Name of the model.
    names, scopes, units : tuple of str, length m
        Symbol of each parameter, the run it belongs to ("" where all runs share it), and its unit.
    values : ndarray, shape (m,)
        Values; NaN where the data cannot see the parameter.
    covariance : ndarray, shape (m, m)
        Covariance; infinite variance where the data cannot see the parameter.
    covariance_source : str
        How the covariance was estimated: jackknife over revolutions, classical with few
        revolutions, or jackknife over runs where they disagree on what they share.
    confidence_factor : ndarray, shape (m,)
        Half width of every 95 % interval in standard deviations.
    rms : float
        RMS of the residual over all samples [m].
    rms_by_run : mapping of str to float
        RMS by run [m].
    rms_by_channel : mapping of str to mapping of str to float
        RMS by run and channel [m].
    condition_number : float
        Of the scaled design.
    undetermined : tuple of str
        What the data cannot see, in words.
    n_samples : int
        Samples used.
    n_revolutions : mapping of str to int
        Whole revolutions used, by run.
    run_coefficients : mapping of str to ndarray, shape (p,)
        Linear coefficients of the model by run: ``signal = model.design(...) @ coefficients``.
    """

    model: str
    names: tuple[str, ...]
    scopes: tuple[str, ...]
    units: tuple[str, ...]
    values: NDArray[np.float64]
    covariance: NDArray[np.float64]
    covariance_source: str
    confidence_factor: NDArray[np.float64]
    rms: float
    rms_by_run: Mapping[str, float]
    rms_by_channel: Mapping[str, Mapping[str, float]]
    condition_number: float
    undetermined: tuple[str, ...]
    n_samples: int
    n_revolutions: Mapping[str, int]
    run_coefficients: Mapping[str, NDArray[np.float64]]

    @property
    def std(self) -> NDArray[np.float64]:
        """Standard deviation of every parameter, shape (m,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def ci95(self) -> NDArray[np.float64]:
        """Ends of every 95 % interval, shape (m, 2)."""
        half = self.confidence_factor * self.std
        return np.column_stack([self.values - half, self.values + half])

    @property
    def correlation(self) -> NDArray[np.float64]:
        """Correlation of the parameters, shape (m, m); NaN beside what the data cannot see."""
        with np.errstate(invalid="ignore"):
            return self.covariance / np.outer(self.std, self.std)

    def index(self, name: str, run: str) -> int:
        """Place of a run's parameter: its own, or the one that all runs share.

        Raises
        ------
        ValueError
            Where the model has no such parameter.
        """
        for k, (parameter, scope) in enumerate(zip(self.names, self.scopes, strict=True)):
            if parameter == name and scope in (run, SHARED):
                return k
        raise ValueError(
            f"model {self.model} has no parameter '{name}' of run '{run}'; it has "
            f"{', '.join(self.names)}"
        )
