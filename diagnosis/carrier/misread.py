"""What errors of sensors, inputs and curves do to the fit of a carrier.

A gain or a zero of a sensor is an effect of the library that is not there: its derivative at zero
is the change of the reading, and is in the sums over the records. What the position of a sensor
(angle and radius), a delay, an input or a deflection curve does to the columns is in no sum, or of
some effects alone and about a sensor at its declared angle; the columns of the fitted set are made
once more from what would be read.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import product

import numpy as np

from carrierflex.diagnosis.carrier.model import CarrierModel, ChannelChoice, Choice, WeightTable
from carrierflex.diagnosis.carrier.records.columns import (
    ColumnSource,
    RunColumns,
    blocks_of_runs,
    columns_of_campaign,
    delay_nodes,
    groups_of_runs,
    inputs_at,
    inputs_of,
)
from carrierflex.diagnosis.carrier.records.sums import MOST_BLOCKS, CarrierSums
from carrierflex.diagnosis.comparison.known_physics import (
    DeclaredError,
    Misreading,
    declared_errors,
)
from carrierflex.diagnosis.comparison.problem import Effects, FloatArray, IntArray
from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import TOLERANCES
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign.revolutions import whole_revolutions
from carrierflex.identification.carrier.models import rim_sensor
from carrierflex.identification.estimation.resampling import NORMAL_95
from carrierflex.simulation.carrier.effects.deflection import FLEXIBLE_PINS, STIFF_PINS
from carrierflex.simulation.carrier.rim import CarrierRig
from carrierflex.simulation.measurement import Measurement
from carrierflex.simulation.sensing import delayed_angle

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
    records: CarrierSums  # Products of the columns
    effects: Effects  # Effects beside the baseline
    theta: FloatArray  # Parameters of the set, shape (p,)
    choice: Choice  # Channel of every effect of one sensor

    def misread(self) -> Misreading:
        """What every declared error, then every error of the curves, does to the gradient."""
        errors = declared_errors(self.model.known)
        as_read = self._scores()
        of_sensors, of_prediction = cache(self._of_sensors), cache(self._of_prediction)
        moved = cache(lambda quantity: self._of_positions(errors, quantity) - as_read)
        scores = []
        for error in errors:
            quantity, channel = error.quantity, error.channel
            if channel is None:
                runs = tuple(_misread_run(run, error) for run in self.campaign.runs)
                (made,) = self._by_source(replace(self.campaign, runs=runs))
                change = (made - as_read).sum(axis=0)
                if quantity is Measurement.DELAY:
                    change += error.std * of_prediction(quantity).sum(axis=0)
            elif quantity in (Measurement.ANGLE, Measurement.RADIUS):
                # Errors of a sensor's position: the columns of the set are made again.
                change = moved(quantity)[channel]
                if quantity is Measurement.ANGLE:
                    change = error.std * of_prediction(quantity)[channel] + change
            else:
                change = error.std * of_sensors(quantity)[channel]
            scores.append(change)
        scores += [change.sum(axis=0) for change in self._of_curves()]
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

    def _of_positions(self, errors: Sequence[DeclaredError], quantity: Measurement) -> FloatArray:
        """``J.T r`` by channel, each further on or out than is declared, shape (C, p)."""
        channels = list(self.campaign.channels)
        for error in errors:
            if error.quantity is quantity and error.channel is not None:
                name, channel = error.quantity.value, channels[error.channel]
                moved = {name: getattr(channel, name) - error.std}
                channels[error.channel] = replace(channel, **moved)
        return self._by_source(replace(self.campaign, channels=tuple(channels)))[0]

    def _of_curves(self) -> Iterator[FloatArray]:
        """Change of ``J.T r`` by channel by each wave of the curves, a standard deviation off."""
        source = self._source_of_set()
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
        as_read, *made = self._by_source(campaign, [source, *others])
        yield from (every * (scores - as_read) for scores in made)

    def _by_source(
        self, campaign: Campaign, sources: Sequence[ColumnSource] = ()
    ) -> list[FloatArray]:
        """``J.T r`` by channel with the columns of the set from each source, (C, p).

        Without sources with those of the set itself, made from other records.
        """
        sources = sources or [self._source_of_set()]
        runs = campaign.within_use().runs
        index = columns_of_campaign(runs[0], campaign.channels[0], sources[0])
        scores = [np.zeros((len(campaign.channels), self.theta.size)) for _ in sources]
        model = replace(self.model, source=sources[0], index=index)
        for numbers in groups_of_runs(runs):
            columns = [RunColumns(runs[r], sources[0]) for r in numbers]
            # A long run is made in pieces.
            most_blocks = MOST_BLOCKS if len(columns) == 1 else 1
            blocks = [of_run.blocks(most_blocks) for of_run in columns]
            every = slice(numbers.start, numbers.stop)
            table = model.weights(self.effects, self.choice, self.theta, every)
            for (c, channel), (of_source, source) in product(
                enumerate(campaign.channels), zip(scores, sources, strict=True)
            ):
                of_runs = blocks_of_runs(columns, channel, blocks, source.effects, source)
                for r, block in ((r, block) for r, run in enumerate(of_runs) for block in run):
                    rows = block.rows[table.columns][:, block.all_present]
                    residual = table.residual[r, c] @ rows
                    of_source[c, table.unknowns[r]] += table.slopes[r, c] @ (rows @ residual)
        return scores

    def _source_of_set(self) -> ColumnSource:
        """Columns of the fitted set alone, at moved sensors and later where it moves or delays."""
        source = self.model.source
        fitted = {name: source.effects[name] for name in (*self.model.contained, *self.effects)}
        quantities = {one.measurement for one in fitted.values()}
        effects = {
            name: replace(
                one,
                follows_sensor=one.follows_sensor and Measurement.ANGLE in quantities,
                follows_delay=one.follows_delay and Measurement.DELAY in quantities,
            )
            for name, one in fitted.items()
        }
        return replace(source, effects=effects)

    def _scores(self) -> FloatArray:
        """``J.T r`` by channel over all runs, shape (C, p)."""
        scores = np.zeros((len(self.campaign.channels), self.theta.size))
        for runs in self.records.slices:
            table = self.model.weights(self.effects, self.choice, self.theta, runs)
            gram = self.records.gram_of_runs(table.columns, runs)
            products = np.einsum(
                "rcpk,rckl,rcl->rcp", table.slopes, gram, table.residual, optimize=True
            )
            _add_by_unknown(scores, table.unknowns, products)
        return scores

    def _of_prediction(self, quantity: Measurement) -> FloatArray:
        """``J.T dr/de`` by channel of an angle or a delay, of another simulator's prediction."""
        if not self.model.index.has_prediction:
            return np.zeros((len(self.campaign.channels), self.theta.size))
        still = {
            name: replace(one, follows_sensor=False, follows_delay=False)
            for name, one in self.model.source.effects.items()
        }
        source = replace(self.model.source, effects=still)
        return replace(self, model=replace(self.model, source=source))._of_sensors(quantity)

    def _of_sensors(self, quantity: Measurement) -> FloatArray:
        """``J.T dr/de`` of an error of every channel, shape (C, p)."""
        effects, theta = self.effects, self.theta
        name = next(e.id for e in self.model.effects.values() if e.measurement is quantity)
        is_fitted = name in (*self.model.contained, *effects)
        with_error = effects if is_fitted else (*effects, name)
        values = theta if is_fitted else np.append(theta, 0.0)
        everywhere: ChannelChoice = {**self.choice, name: slice(None)}
        named = {**self.choice, name: self.choice.get(name, 0)}
        first = [p.effect for p in self.model.parameters(with_error, named)].index(name)
        scores = np.zeros((len(self.campaign.channels), theta.size))
        for runs in self.records.slices:
            fitted = self.model.weights(effects, self.choice, theta, runs)
            read = self.model.weights(with_error, everywhere, values, runs)
            columns = np.union1d(fitted.columns, read.columns)
            gram = self.records.gram_of_runs(columns, runs)
            number = np.flatnonzero(read.unknowns[0] == first)[0]
            change = _widened(read, read.slopes[:, :, [number]], columns)
            slopes = _widened(fitted, fitted.slopes, columns)
            products = np.einsum("rcpk,rckl,rcl->rcp", slopes, gram, change[:, :, 0], optimize=True)
            _add_by_unknown(scores, fitted.unknowns, products)
        return scores


def _add_by_unknown(scores: FloatArray, unknowns: IntArray, products: FloatArray) -> None:
    """Add products of every run to the scores of its unknowns, in place."""
    for numbers, of_run in zip(unknowns, products, strict=True):
        np.add.at(scores.T, numbers, of_run.T)


def _widened(table: WeightTable, rows: FloatArray, columns: IntArray) -> FloatArray:
    """Rows over the columns of a table as rows over more columns."""
    wide = np.zeros((*rows.shape[:-1], columns.size))
    wide[..., np.searchsorted(columns, table.columns)] = rows
    return wide


def _misread_run(run: Run, error: DeclaredError) -> Run:
    """Run with an input, or with all channels' delay, one standard deviation off."""
    if error.quantity is Measurement.DELAY:
        # Channels that are late show a carrier that has turned further.
        name = "carrier_angle"
        values = delayed_angle(run.time, run.inputs[name], -error.std)
    else:
        name = error.signal
        values = error.misread(run.inputs[name])
    return replace(run, inputs={**run.inputs, name: values})


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
    some = inputs_at(inputs_of(run), np.linspace(0, run.time.size - 1, _SAMPLES).astype(int))
    late = [some] * delay_nodes(source.rig.n_planets).size

    def rows_of(one: ColumnSource) -> Iterator[FloatArray]:
        for channel in campaign.channels:
            yield from one.rows(rim_sensor(channel), some, late, source.effects).values()

    rows = list(rows_of(source))
    return lambda other: not all(map(np.array_equal, rows, rows_of(other)))


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
