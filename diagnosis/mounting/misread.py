"""What declared errors of sensors and loads do to the fit of a mounting, and what its zeros do.

The zero of a run is a mean over its first samples: the noise in it stands in the whole run, in all
blocks alike, so that their scatter does not show it. It is an error of every run and channel.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from carrierflex.diagnosis.comparison.known_physics import (
    DeclaredError,
    Misreading,
    declared_errors,
)
from carrierflex.diagnosis.comparison.problem import Effects, FloatArray
from carrierflex.diagnosis.mounting.model import Choice, MountingModel
from carrierflex.diagnosis.mounting.records import MountingRecord
from carrierflex.simulation.measurement import Measurement
from carrierflex.simulation.mounting.effects import SENSOR_DELAY
from carrierflex.simulation.mounting.inputs import MountingInputs


@dataclass(frozen=True, eq=False)
class MountingReading:
    """A fitted set of effects, whose records may be misread.

    Parameters
    ----------
    model : MountingModel
        Parameters, simulator and declared errors.
    effects : tuple of str
        Effects beside the baseline.
    theta : ndarray, shape (p,)
        Parameters of the set.
    choice : mapping of str to int
        Channel of each effect of one sensor.
    """

    model: MountingModel
    effects: Effects
    theta: FloatArray
    choice: Choice

    def misread(
        self,
        records: Sequence[MountingRecord],
        slopes: Iterable[tuple[FloatArray, FloatArray]],
    ) -> Misreading:
        """What every declared error, and the zero of every run and channel, does to the gradient.

        Parameters
        ----------
        records : sequence of MountingRecord
            Runs.
        slopes : iterable of tuple of ndarray
            Residual, shape (n, C), and change of the prediction by every parameter, shape
            (p, n, C), run by run.
        """
        errors = declared_errors(self.model.known)
        scores = np.zeros((len(errors), self.theta.size))
        of_zeros = []
        for record, (_, changes) in zip(records, slopes, strict=True):
            predicted = self._predicted(record)
            by_parameter = changes.reshape(len(changes), -1)
            for e, error in enumerate(errors):
                change = self._change(record, error, predicted)
                change = np.where(np.isfinite(record.measured), change, 0.0)
                scores[e] += by_parameter @ change.ravel()
            of_channels = np.where(np.isfinite(record.measured), changes, 0.0).sum(axis=1)
            of_zeros.append((of_channels * np.sqrt(record.zero_noise)).T)
        return Misreading(errors, np.concatenate([scores, *of_zeros]))

    def _change(
        self, record: MountingRecord, error: DeclaredError, predicted: FloatArray
    ) -> FloatArray:
        """Change of the residual where a signal is read one standard deviation off, (n, C)."""
        if error.is_of_input:
            inputs = record.inputs.columns()
            inputs[error.signal] = error.misread(inputs[error.signal])
            return predicted - self._predicted(replace(record, inputs=MountingInputs(**inputs)))
        if error.part is Measurement.DELAY:
            late = replace(
                self,
                effects=(*self.effects, SENSOR_DELAY.id),
                theta=np.append(self.theta, error.std),
            )
            return late._predicted(record) - predicted
        change = np.zeros(record.measured.shape)
        signal = record.measured[:, error.channel]
        change[:, error.channel] = error.misread(signal) - signal
        return change

    def _predicted(self, record: MountingRecord) -> FloatArray:
        return self.model.predicted(record, self.effects, self.theta, self.choice)
