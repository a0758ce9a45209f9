"""What errors of sensors, inputs and curves do to the fit of a carrier.

A gain of a sensor adds a share of its reading, a zero a constant. For the position of a sensor
(angle and radius), a delay, an input or a deflection curve the columns of the fitted set are made
once more from what would be read.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np

from carrierflex.diagnosis.carrier.model import CarrierModel, Choice
from carrierflex.diagnosis.carrier.records.columns import (
    ColumnSource,
    RunColumns,
    SampleColumns,
)
from carrierflex.diagnosis.comparison.known_physics import (
    DeclaredError,
    Misreading,
    declared_errors,
)
from carrierflex.diagnosis.comparison.problem import Effects, FloatArray
from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import TOLERANCES
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign.revolutions import whole_revolutions
from carrierflex.identification.estimation.resampling import NORMAL_95
from carrierflex.simulation.carrier.effects.deflection import FLEXIBLE_PINS, STIFF_PINS
from carrierflex.simulation.carrier.rim import CarrierRig
from carrierflex.simulation.measurement import Measurement
from carrierflex.simulation.sensing import delayed, delayed_angle

#: Relative standard deviation of a wave beside the largest of its curve, of a carrier with pins
#: that give way and with stiff ones: order 6 over order 3, and order 3 over order 6, of the default
#: mesh against the finest one (0.0889 and 0.0865; 0.894 and 0.939; docs/cad.md).
_STD = {"f": 0.027, "s": 0.048}
#: Curve whose size an effect fits.
_SIZES_OF_CURVES = {FLEXIBLE_PINS.id: "delta_f", STIFF_PINS.id: "delta_s"}
#: Waves below this share of the largest one of their curve move nothing.
_NOTABLE = 0.01
#: Samples of a run on which a change of the curves shows, and of a revolution over which it is
#: summed: products of columns hold no order near half of it.
_SAMPLES = 48
_SAMPLES_PER_TURN = 72


@dataclass(frozen=True, eq=False)
class CarrierReading:
    """A fitted set of effects, whose records may be misread."""

    campaign: Campaign  # Records
    model: CarrierModel  # Weights of the columns, and what the campaign declares
    effects: Effects  # Effects beside the baseline
    theta: FloatArray  # Parameters of the set, shape (p,)
    choice: Choice  # Channel of every effect of one sensor

    def misread(self) -> Misreading:
        """What every declared error, then every error of the curves, does to the gradient."""
        errors = declared_errors(self.model.known)
        model = self.model.of_set(self.effects)
        as_read = cache(lambda: self._scores(self.campaign, model))
        moved = cache(lambda quantity: self._scores(self._moved(errors, quantity), model)[0])
        scores = []
        for error in errors:
            quantity, channel = error.quantity, error.channel
            if channel is None:
                runs = tuple(_misread_run(run, error) for run in self.campaign.runs)
                made = self._scores(replace(self.campaign, runs=runs), model)
                change = (made - as_read())[0].sum(axis=0)
            elif quantity is Measurement.GAIN:
                change = error.std * as_read()[1, channel]
            elif quantity is Measurement.ZERO:
                change = error.std * as_read()[2, channel]
            else:
                change = moved(quantity)[channel] - as_read()[0, channel]
            scores.append(change)
        scores += [change.sum(axis=0) for change in self._of_curves(model)]
        table = np.array(scores).reshape(len(scores), self.theta.size)
        return Misreading(errors, table, "deflection curve", self._words_of_curves())

    def _words_of_curves(self) -> str:
        """Whether intervals hold the error of the curves' size; empty where none is fitted."""
        free = [p for p in self.model.parameters(self.effects, self.choice) if p.is_free]
        curves = self.model.source.rig.curves
        sizes = [p for p in free if p.effect in _SIZES_OF_CURVES]
        errors = {p.name: curves[_SIZES_OF_CURVES[p.effect]].mesh_error for p in sizes}
        if not all(errors.values()):
            return "the error of the curves by their mesh (curves --mesh-error) is not included"
        listed = ", ".join(f"{name} {share:.1%}" for name, share in errors.items())
        return f"intervals hold the error of the curves by their mesh ({listed})" if errors else ""

    def _moved(self, errors: Sequence[DeclaredError], quantity: Measurement) -> Campaign:
        """Campaign whose sensors are declared less far on or out by a standard deviation."""
        channels = list(self.campaign.channels)
        late: dict[str, float] = {}
        for error in errors:
            if error.quantity is quantity and error.channel is not None:
                name, channel = error.quantity.value, channels[error.channel]
                moved = {name: getattr(channel, name) - error.std}
                channels[error.channel] = replace(channel, **moved)
                # Waves of a prediction turn with the carrier: a sensor further on reads them later.
                if quantity is Measurement.ANGLE:
                    late[channel.name] = -error.std / self.model.source.speed
        runs = tuple(_with_late_predictions(run, late) for run in self.campaign.runs)
        return replace(self.campaign, channels=tuple(channels), runs=runs)

    def _of_curves(self, model: CarrierModel) -> Iterator[FloatArray]:
        """Change of ``J.T r`` by channel by each wave of the curves, a standard deviation off."""
        source = model.source
        rigs = list(_rigs_of_curve_errors(source.rig))
        # With tolerances the orders of the curves are free themselves.
        if TOLERANCES not in self.campaign.rig:
            rigs += _rigs_of_mesh_errors(source.rig)
        shows = _shows_curves_of(self.campaign, source)
        others = [one for one in (replace(source, rig=rig) for rig in rigs) if shows(one)]
        if not others:
            return
        turns = [whole_revolutions(run).samples for run in self.campaign.within_use().runs]
        fewest = min(samples.size for of_run in turns for samples in of_run)
        every = max(1, fewest // _SAMPLES_PER_TURN)
        campaign = self.campaign.thinned(every)
        as_read = self._scores(campaign, model)
        for other in others:
            made = self._scores(campaign, replace(model, source=other))
            yield every * (made - as_read)[0]

    def _scores(self, campaign: Campaign, model: CarrierModel) -> FloatArray:
        """``J.T x`` by channel over the records of a campaign, shape (3, C, p).

        x is what the fit leaves, what it predicts before gain and zero of a sensor, and one.
        """
        of_reading = [
            model.effects[p.effect].measurement in (Measurement.GAIN, Measurement.ZERO)
            for p in model.parameters(self.effects, self.choice)
        ]
        thetas = self.theta, np.where(of_reading, 0.0, self.theta)
        scores = np.zeros((3, len(campaign.channels), self.theta.size))
        every_block = model.blocks(campaign, self.effects, self.choice, *thetas)
        for c, block, (table, without_reading) in every_block:
            rows = block.present[table.columns]
            weights = np.array([table.residual[0, c], without_reading.values[0, c]])
            x = np.vstack([weights @ rows, np.ones(rows.shape[1])])
            scores[:, c, table.unknowns[0]] += (x @ rows.T) @ table.slopes[0, c].T
        return scores


def _misread_run(run: Run, error: DeclaredError) -> Run:
    """Run with an input, or with all channels' delay, one standard deviation off."""
    if error.quantity is not Measurement.DELAY:
        misread = error.misread(run.inputs[error.signal])
        return replace(run, inputs={**run.inputs, error.signal: misread})
    # Channels that are late show a carrier that has turned further.
    turned = delayed_angle(run.time, run.inputs["carrier_angle"], -error.std)
    run = replace(run, inputs={**run.inputs, "carrier_angle": turned})
    return _with_late_predictions(run, dict.fromkeys(run.predictions, -error.std))


def _with_late_predictions(run: Run, delays: Mapping[str, float]) -> Run:
    """Run whose predictions by another simulator are later by some delays [s], by channel."""
    late = {
        name: delayed(run.time, run.predictions[name], delay)
        for name, delay in delays.items()
        if name in run.predictions
    }
    return replace(run, predictions={**run.predictions, **late}) if late else run


def _curves_of(rig: CarrierRig, pins: str) -> dict[str, DeflectionCurve]:
    """Curves of a carrier with some pins, under torque and under the force of one pin."""
    names = (f"delta_{pins}", f"g_{pins}")
    return {name: rig.curves[name] for name in names if name in rig.curves}


def _rigs_of_curve_errors(rig: CarrierRig) -> Iterator[CarrierRig]:
    """Rigs with one wave of the curves one standard deviation larger."""
    for pins, std in _STD.items():
        curves = _curves_of(rig, pins)
        waves = {name: _waves(curve) for name, curve in curves.items()}
        largest = {orders[0] for orders in waves.values() if orders}
        for order in sorted(set().union(*waves.values()) - largest):
            shown = (name for name, orders in waves.items() if order in orders)
            changed = {name: _larger(curves[name], order, std) for name in shown}
            yield replace(rig, curves={**rig.curves, **changed})


def _rigs_of_mesh_errors(rig: CarrierRig) -> Iterator[CarrierRig]:
    """Rigs with larger curves: the error of their largest wave by the mesh ends 95 %."""
    for pins in _STD:
        curves = _curves_of(rig, pins)
        if any(curve.mesh_error for curve in curves.values()):
            changed = {
                name: _larger(curve, slice(None), curve.mesh_error / NORMAL_95)
                for name, curve in curves.items()
            }
            yield replace(rig, curves={**rig.curves, **changed})


def _shows_curves_of(campaign: Campaign, source: ColumnSource) -> Callable[[ColumnSource], bool]:
    """Tells whether any column is another one with the curves of another source."""
    run = campaign.runs[0]
    some = np.linspace(0, run.time.size - 1, _SAMPLES).astype(int)

    def rows_of(one: ColumnSource) -> Iterator[FloatArray]:
        columns = SampleColumns([(RunColumns(run, one), some)], one.effects)
        for channel in campaign.channels:
            yield from columns.rows(channel).values()

    rows = list(rows_of(source))
    return lambda other: not all(map(partial(np.array_equal, equal_nan=True), rows, rows_of(other)))


def _waves(curve: DeflectionCurve) -> list[int]:
    """Orders of the notable waves of a curve, the largest first."""
    sizes = curve.axial_order_content()
    sizes[0] = 0.0
    order = np.argsort(-sizes, kind="stable")
    return [int(n) for n in order if sizes[n] > _NOTABLE * sizes.max()]


def _larger(curve: DeflectionCurve, order: int | slice, std: float) -> DeflectionCurve:
    """Curve with one wave, or all, larger by a share."""

    def larger(samples: FloatArray) -> FloatArray:
        """Samples of one turn with that wave larger."""
        spectrum = np.fft.rfft(samples)
        spectrum[order] *= 1.0 + std
        return np.asarray(np.fft.irfft(spectrum, samples.size))

    return replace(curve, axial=larger(curve.axial), radial=larger(curve.radial))
