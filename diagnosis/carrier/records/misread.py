"""What declared errors of sensors and inputs do to the fit of a carrier.

An error of a sensor is an effect of the library that is not there: its derivative at zero is the
change of the reading, and stands in the sums over the records. What an input does to the columns
is in no sum; the columns of the fitted set are made once more from the input as it would be read.
"""

from dataclasses import dataclass, replace

import numpy as np

from carrierflex.diagnosis.carrier.closed_fit import sums_of_runs
from carrierflex.diagnosis.carrier.model import CarrierModel, Choice, Places
from carrierflex.diagnosis.carrier.records.run_parts import RunParts
from carrierflex.diagnosis.carrier.records.sums import accumulated_sums
from carrierflex.diagnosis.carrier.weight_table import FloatArray, IntArray, WeightTable
from carrierflex.diagnosis.comparison.declared_errors import (
    DeclaredError,
    Misreading,
    declared_errors,
)
from carrierflex.diagnosis.comparison.problem import BoolArray, Effects
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.records import Run
from carrierflex.simulation.measurement import Measurement


@dataclass(frozen=True, eq=False)
class CarrierReading:
    """Records of a carrier that may be misread.

    Parameters
    ----------
    campaign : Campaign
        Records.
    model : CarrierModel
        Weights of the columns, and what the campaign declares.
    parts : RunParts
        Products of the columns.
    """

    campaign: Campaign
    model: CarrierModel
    parts: RunParts

    def misread(self, effects: Effects, theta: FloatArray, choice: Choice) -> Misreading:
        """What every declared error does to the gradient of a fit.

        Parameters
        ----------
        effects : tuple of str
            Effects beside the baseline.
        theta : ndarray, shape (p,)
            Parameters of the set.
        choice : mapping of str to int
            Channel of every effect of one sensor.
        """
        errors = declared_errors(self.model.known)
        scores = np.zeros((len(errors), theta.size))
        of_sensors = {error.part for error in errors if not error.is_of_input}
        by_channel = {part: self._of_sensors(part, effects, theta, choice) for part in of_sensors}
        of_inputs = any(error.is_of_input for error in errors)
        as_read = self._score(self.model, self.parts, effects, theta, choice) if of_inputs else 0.0
        for e, error in enumerate(errors):
            if error.is_of_input:
                scores[e] = self._of_input(error, effects, theta, choice) - as_read
            elif error.channel is None:
                scores[e] = error.std * by_channel[error.part].sum(axis=0)
            else:
                scores[e] = error.std * by_channel[error.part][error.channel]
        return Misreading(errors, scores)

    def _of_sensors(
        self, part: Measurement, effects: Effects, theta: FloatArray, choice: Choice
    ) -> FloatArray:
        """``J.T dr/de`` of an error of every channel, shape (C, p)."""
        name = next(own.id for own in self.model.effects.values() if own.measurement is part)
        is_fitted = name in (*self.model.contained, *effects)
        with_error = effects if is_fitted else (*effects, name)
        values = theta if is_fitted else np.append(theta, 0.0)
        everywhere: Places = {**choice, name: slice(None)}
        place = int(np.flatnonzero(self._is_of(name, with_error, choice))[0])
        scores = np.zeros((len(self.campaign.channels), theta.size))
        for runs in self.parts.slices:
            fitted = self.model.weights(effects, choice, theta, runs)
            read = self.model.weights(with_error, everywhere, values, runs)
            columns = np.union1d(fitted.columns, read.columns)
            gram = self.parts.gram_of_runs(columns, runs)
            number = np.flatnonzero(read.unknowns[0] == place)[0]
            change = _widened(read, read.slopes[:, :, [number]], columns)
            slopes = _widened(fitted, fitted.slopes, columns)
            products = np.einsum("rcpk,rckl,rcl->rcp", slopes, gram, change[:, :, 0], optimize=True)
            for r, own in enumerate(fitted.unknowns):
                np.add.at(scores.T, own, products[r].T)
        return scores

    def _is_of(self, name: str, effects: Effects, choice: Choice) -> BoolArray:
        """Whether each parameter of a set is of an effect."""
        named = {**choice, name: choice.get(name, 0)}
        parameters = self.model.parameters(effects, named)
        return np.array([own.effect == name for own in parameters], dtype=bool)

    def _of_input(
        self, error: DeclaredError, effects: Effects, theta: FloatArray, choice: Choice
    ) -> FloatArray:
        """``J.T r`` where an input is read one standard deviation off, shape (p,)."""
        names = {*self.model.contained, *effects}
        source = self.model.source
        own = replace(
            source, effects={name: one for name, one in source.effects.items() if name in names}
        )
        runs = tuple(_misread_run(run, error) for run in self.campaign.runs)
        records = accumulated_sums(replace(self.campaign, runs=runs), own)
        model = replace(self.model, source=own, index=records.index)
        parts = RunParts(records, len(runs))
        return self._score(model, parts, effects, theta, choice)

    def _score(
        self,
        model: CarrierModel,
        parts: RunParts,
        effects: Effects,
        theta: FloatArray,
        choice: Choice,
    ) -> FloatArray:
        """``J.T r`` over all runs and channels, shape (p,)."""
        return sums_of_runs(model, parts.gram_of_runs, effects, choice, theta, parts.slices).slope


def _widened(table: WeightTable, rows: FloatArray, columns: IntArray) -> FloatArray:
    """Rows over the columns of a table as rows over more columns."""
    wide = np.zeros((*rows.shape[:-1], columns.size))
    wide[..., np.searchsorted(columns, table.columns)] = rows
    return wide


def _misread_run(run: Run, error: DeclaredError) -> Run:
    """Run with an input as it is read one standard deviation off."""
    return replace(
        run, inputs={**run.inputs, error.signal: error.misread(run.inputs[error.signal])}
    )
