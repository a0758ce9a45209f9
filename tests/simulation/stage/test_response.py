"""The stage in time: integrator's order, energy, power, mesh frequency, contact loss, refusals."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.simulation.stage.linearised import linearised_modes
from carrierflex.simulation.stage.modal_form import (
    grouped,
    modal_stage,
    resolved,
    step_matrices,
)
from carrierflex.simulation.stage.part_loads import part_loads
from carrierflex.simulation.stage.response import (
    StageDivergedError,
    joined_records,
    quasi_static_start,
    run_stage,
    steady_drive,
)
from carrierflex.simulation.stage.stage_data import BearingData, MeshData, StageData
from carrierflex.simulation.stage.stage_model import stage_model
from carrierflex.simulation.stage.statics import SteadyLoad, static_coordinates
from tests.simulation.stage.conftest import SPEED

TORQUE = 360e3
LOAD = SteadyLoad(TORQUE)


def run(model, drive, start, *, duration=0.2, sample_rate=500.0, step=5e-4):
    chunks = run_stage(model, drive, start, duration=duration, sample_rate=sample_rate, step=step)
    return joined_records(list(chunks))


def with_torque(model, factor):
    """Steady drive whose torque is multiplied by a function of time."""
    steady = steady_drive(model, LOAD)

    def drive(time):
        rows = steady(time)
        rows[:, 0] *= factor(time)
        return rows

    return drive


@pytest.fixture(scope="module")
def start(nominal_stage):
    return quasi_static_start(nominal_stage, LOAD)


@pytest.mark.long
def test_error_falls_with_the_square_of_the_step(nominal_stage, start):
    drive = with_torque(nominal_stage, lambda t: 1.0 + 0.2 * np.sin(10.0 * np.pi * t) ** 2)
    rows = [
        0,
        nominal_stage.labels.index("housing Tz [m]"),
        nominal_stage.labels.index("generator Rx [rad]"),
    ]
    steps = np.array([2.5e-4, 1.25e-4, 6.25e-5])
    reference, *runs = (
        run(nominal_stage, drive, start, duration=0.1, step=h).c[:, rows]
        for h in (1.5625e-5, *steps)
    )
    errors = np.array([np.abs(c - reference).max(axis=0) for c in runs])
    slopes = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert (slopes > 1.9).all(), slopes
    assert (slopes < 2.15).all(), slopes  # the reference's own error adds 0.05


@pytest.mark.long
def test_modes_that_a_step_does_not_resolve_answer_statically(nominal_stage, start, request):
    drive = with_torque(nominal_stage, lambda t: 1.0 + 0.2 * np.sin(10.0 * np.pi * t) ** 2)
    settings = {"duration": 0.4, "sample_rate": 100.0, "step": 1e-3}
    record = run(nominal_stage, drive, start, **settings)
    assert len(resolved(modal_stage(nominal_stage), 1e-3).omega) < 90
    request.getfixturevalue("all_modes")
    complete = run(nominal_stage, drive, start, **settings)
    teeth = nominal_stage.channels.B[:, nominal_stage.channels.meshes]
    error = np.abs((record.c - complete.c) @ teeth).max(axis=0)
    # To a force at 110 Hz a mode from 1.6 kHz on answers by 0.5 % too little.
    assert (error < 0.005 * np.ptp(complete.c @ teeth, axis=0)).all(), error


@pytest.mark.parametrize("n_groups", [1, 3])
def test_a_step_takes_the_modes_that_damping_couples_together(nominal_stage, n_groups):
    stage = modal_stage(nominal_stage)
    group = np.arange(len(stage.omega)) % n_groups
    apart = group[:, None] != group
    stage = grouped(replace(stage, D=np.where(apart, 0.0, stage.D)))
    h = 1e-3
    k = step_matrices(stage, h, 9.81)
    assert len(k.groups) >= n_groups
    A = np.diag(2.0 / h + 0.5 * h * stage.omega**2) + stage.D
    known = np.sqrt(A.diagonal()) * np.random.default_rng(0).normal(size=len(A))
    answer, packed = np.empty_like(known), 0
    for first, size in k.groups:
        modes = slice(first, first + size)
        answer[modes] = k.A_inverse[packed : packed + size**2].reshape(size, size).T @ known[modes]
        packed += size**2
    # Ten times the damping over critical that is none.
    assert_allclose(A @ answer, known, rtol=0.0, atol=1e-10 * np.abs(known).max())


@pytest.mark.long
def test_energy_balances_and_power_passes_through(nominal_stage, start):
    record = run(
        nominal_stage,
        steady_drive(nominal_stage, LOAD),
        start,
        duration=2.0,
        sample_rate=50.0,
        step=1e-3,
    )
    assert np.abs(record.imbalance).max() < 1e-9 * record.energy[-1, 0]
    # What the torque gives the generator takes, but for structural damping, the ringing of the
    # start and weight that turns.
    into, out = record.energy[-1, :2]
    assert_allclose(into, TORQUE * SPEED * 2.0, rtol=1e-3)
    assert_allclose(-out, into, rtol=1e-3)
    dissipated = record.energy[:, 4]
    assert (np.diff(dissipated) > 0.0).all()
    # Speed ratio over the run: angle of the generator over angle of the carrier.
    generator = nominal_stage.labels.index("generator Rx [rad]")
    turned = nominal_stage.data.ratio * record.c[:, 0] + record.c[:, generator]
    assert_allclose(
        (turned[-1] - turned[0]) / (record.c[-1, 0] - record.c[0, 0]), 81.4907, rtol=1e-4
    )


@pytest.mark.parametrize("n_slices", [1, 2])
def test_energy_balances_through_contact_loss_and_clearance(stage_body, n_slices):
    bearings = replace(BearingData(), upwind_clearance=0.14e-3, downwind_clearance=0.12e-3)
    data = StageData(bearings=bearings, mesh=MeshData(n_slices=n_slices))
    model = stage_model(stage_body, data, speed=SPEED)
    drive = with_torque(model, lambda t: np.cos(12.0 * np.pi * t))
    record = run(model, drive, quasi_static_start(model, LOAD), duration=0.4)
    force = part_loads(model, record.c).mesh_force
    assert (force[:, :6].min(axis=0) == 0.0).all()  # every drive flank lifts off
    assert (force[:, 6:].max(axis=0) > 1e3).all()  # and every coast flank takes over
    work = np.abs(np.diff(record.energy[:, 0])).sum()
    assert np.abs(record.imbalance).max() < 1e-6 * work


def test_mesh_frequency_stands_in_the_tooth_forces(nominal_stage, start):
    record = run(
        nominal_stage,
        steady_drive(nominal_stage, LOAD),
        start,
        duration=4.0,
        sample_rate=500.0,
        step=1e-3,
    )
    force = part_loads(nominal_stage, record.c).mesh_force[1000:, 0]
    spectrum = np.abs(np.fft.rfft(force * np.hanning(len(force))))
    frequency = np.fft.rfftfreq(len(force), 1.0 / 500.0)
    near = (frequency > 30.0) & (frequency < 45.0)
    # 99 teeth pass at 22.1 rpm: 36.465 Hz; two seconds resolve 0.5 Hz.
    assert_allclose(frequency[near][spectrum[near].argmax()], 36.465, atol=0.5)
    assert spectrum[near].max() > 10.0 * np.median(spectrum[near])


def test_the_static_answer_of_an_unchanging_stage_stays(stage_body):
    model = stage_model(stage_body, StageData(mesh=MeshData(n_harmonics=0)), speed=SPEED)
    load = SteadyLoad(TORQUE, gravity=0.0)
    rest = static_coordinates(model, load)
    rate = np.zeros_like(rest)
    rate[0] = SPEED
    chunks = run_stage(
        model,
        steady_drive(model, load),
        (rest, rate),
        duration=0.2,
        sample_rate=50.0,
        step=1e-3,
        gravity=0.0,
    )
    record = joined_records(list(chunks))
    assert_allclose(
        record.c[:, 1:], np.tile(rest[1:], (10, 1)), rtol=0.0, atol=1e-7 * np.abs(rest[1:]).max()
    )
    assert_allclose(record.c[:, 0], SPEED * record.time, rtol=1e-9)


def test_a_small_torsional_swing_has_the_linear_frequency_and_damping(stage_body):
    model = stage_model(stage_body, StageData(mesh=MeshData(n_harmonics=0)), speed=0.01)
    modes = linearised_modes(modal_stage(model))
    load = SteadyLoad(TORQUE, gravity=0.0)
    rest = static_coordinates(model, load)
    swing = np.real(modes.shape[:, 0]) * 1e-4
    root = 2.0 * np.pi * modes.frequency_hz[0] / np.sqrt(1.0 - modes.damping_ratio[0] ** 2)
    root = root * (-modes.damping_ratio[0] + 1j * np.sqrt(1.0 - modes.damping_ratio[0] ** 2))
    rate = np.real(root * modes.shape[:, 0]) * 1e-4
    rate[0] += model.speed
    steady = steady_drive(model, load)
    record = joined_records(
        list(
            run_stage(
                model,
                steady,
                (rest + swing, rate),
                duration=1.0,
                sample_rate=50.0,
                step=1e-3,
                gravity=0.0,
            )
        )
    )
    expected = rest + 1e-4 * np.real(np.exp(root * record.time)[:, None] * modes.shape[:, 0])
    generator = model.labels.index("generator Rx [rad]")
    assert_allclose(record.c[:, generator], expected[:, generator], rtol=0.0, atol=3e-4 * 1e-4)


def test_stiffest_modes_do_not_grow_at_the_largest_step(nominal_stage, start):
    # 0.74 ms against a fastest mode of 15 kHz: 70 rad a step.
    record = run(
        nominal_stage,
        steady_drive(nominal_stage, LOAD),
        start,
        duration=2.0,
        sample_rate=100.0,
        step=1.5e-3,
    )
    assert np.abs(record.c[:, 1:]).max() < 3.0
    assert np.abs(record.c_rate[-20:, 0] / SPEED - 1.0).max() < 0.02


def test_bad_runs_are_refused_before_they_start(nominal_stage, start):
    steady = steady_drive(nominal_stage, LOAD)
    with pytest.raises(
        ValueError,
        match=r"step is 0\.01 s, too large for the mesh period of 0\.02742 s; expected at most",
    ):
        run(nominal_stage, steady, start, step=0.01)
    with pytest.raises(
        ValueError, match=r"sample rate 0\.0 1/s and step 0\.001 s must be positive"
    ):
        run(nominal_stage, steady, start, sample_rate=0.0, step=1e-3)
    with pytest.raises(ValueError, match="torque is not finite"):
        run(nominal_stage, with_torque(nominal_stage, lambda t: np.full_like(t, np.nan)), start)
    with pytest.raises(ValueError, match="contains no sample"):
        run(nominal_stage, steady, start, duration=1e-4)


def test_a_runaway_stops_with_time_and_coordinate_and_keeps_what_it_had(nominal_stage, start):
    def runaway(time):
        rows = steady_drive(nominal_stage, LOAD)(time)
        rows[:, 2] += np.where(time > 1.1, 1e16, 0.0)
        return rows

    records = []

    def collect():
        for record in run_stage(
            nominal_stage, runaway, start, duration=2.0, sample_rate=500.0, step=1e-3
        ):
            records.append(record)

    with pytest.raises(
        StageDivergedError, match=r"at t = 1\.1\d* s in '.+'; use a smaller step"
    ) as caught:
        collect()
    assert 1.1 <= caught.value.time < 1.2
    # Whether a contact or a coordinate fails first, rounding decides.
    labels = nominal_stage.channels.labels if not caught.value.settled else nominal_stage.labels
    assert caught.value.coordinate in labels
    assert_allclose(joined_records(records).time[-1], 1.1, atol=0.02)
    assert np.isfinite(joined_records(records).c).all()
