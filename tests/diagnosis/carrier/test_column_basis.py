"""Columns of a sensor as combinations of those that are different."""

from dataclasses import replace

import numpy as np
from numpy.testing import assert_allclose

from carrierflex.diagnosis.carrier.records import columns, sums
from carrierflex.diagnosis.carrier.records.columns import some_samples
from carrierflex.diagnosis.carrier.records.sums import (
    _column_basis,
    _every_column,
    accumulated_sums,
)
from carrierflex.simulation.carrier.effect import Effect, lengths
from tests.diagnosis.carrier.carrier_twin import CHANNELS, LOADS, twin_campaign, twin_problem


def test_products_of_all_columns_are_those_without_a_basis(monkeypatch):
    problem = twin_problem(loads=LOADS[:4], turns=3, channels=CHANNELS[2:5])
    every = np.arange(len(problem.records.index))
    assert problem.records.basis.size < 0.6 * every.size

    def no_basis(runs, channels, source):
        return _every_column(every.size - 1, len(channels))

    monkeypatch.setattr(sums, "_column_basis", no_basis)
    plain = accumulated_sums(problem.campaign, problem.model.source)
    assert plain.products.nbytes > 2 * problem.records.products.nbytes
    result, expected = problem.records.gram(every), plain.gram(every)
    length = np.sqrt(np.diagonal(expected, axis1=2, axis2=3))
    # Columns of effects are zero where their load is; those of the flexible model but for rounding.
    flexible = problem.records.index.flexible
    length[..., flexible] = length[..., flexible].max(axis=0)
    # A column that is zero at one sensor is zero there but for rounding of its size at the others.
    length = np.where(length == 0.0, length.max(axis=(0, 1)), length)
    scale = length[..., :, None] * length[..., None, :]
    assert (np.abs(result - expected) <= 1e-10 * scale).all()
    # The same where a model takes the target's place.
    some, weights = every[:9], np.random.default_rng(3).standard_normal((4, 3, 9))
    simulated = [
        source_records.with_target(some, weights).target
        for source_records in (problem.records, plain)
    ]
    assert_allclose(simulated[0][..., 0], simulated[1][..., 0], rtol=1e-10)


def test_sums_of_runs_made_together_are_those_of_each_run_alone(monkeypatch):
    problem = twin_problem(loads=LOADS[:4], turns=3, channels=CHANNELS[2:5])

    def hum(sensor, inputs, rig):
        """A user's law of the time [s], whichever run it is of."""
        return np.sin(3.0 * inputs.time)[None]

    law = Effect("hum", "sin 3 t", lengths("a"), "a line", pattern=hum)
    source = replace(problem.model.source, effects={**problem.model.effects, law.id: law})
    together = accumulated_sums(problem.campaign, source)
    monkeypatch.setattr(columns, "_CHUNK", 1)
    alone = accumulated_sums(problem.campaign, source)
    for name in ("target", "counts", "loads", "orders", "within"):
        result, expected = getattr(together, name), getattr(alone, name)
        assert_allclose(result, expected, rtol=0.0, atol=1e-12 * np.abs(expected).max())


def test_records_that_leave_the_basis_are_taken_with_all_columns():
    campaign = twin_campaign(loads=LOADS[:2], turns=3, channels=CHANNELS[:1])
    source = twin_problem(loads=LOADS[:2], turns=3, channels=CHANNELS[:1]).model.source
    basis = _column_basis(campaign.runs, campaign.channels, source)
    run = campaign.runs[0]
    # Without a radial load its columns are zero; with one they are not.
    pushed = replace(run, inputs={**run.inputs, "ntl_z": run.inputs["ntl_z"] + 1e5})
    for recorded, holds in ((run, True), (pushed, False)):
        columns = some_samples([recorded], source, 40).rows(CHANNELS[0])
        assert basis.holds(0, np.array(list(columns.values())[1:])) is holds


def test_orders_of_what_a_model_leaves_are_those_of_the_signal_less_the_model():
    problem = twin_problem(loads=LOADS[:2], turns=6, channels=CHANNELS[:2])
    theta = problem.starts((), {})[1]
    none = np.zeros_like(theta)
    measured, left = (problem._made_orders((), values) for values in (none, theta))
    assert_allclose(measured, problem.records.orders, rtol=1e-12)
    # Orders are linear in the signal, and the model is linear in its parameters.
    doubled = problem._made_orders((), 2.0 * theta)
    assert np.isfinite(left).all()
    assert_allclose(
        measured - doubled, 2.0 * (measured - left), atol=1e-12 * np.abs(measured).max()
    )
    assert np.abs(left).max() < 0.1 * np.abs(measured).max()
