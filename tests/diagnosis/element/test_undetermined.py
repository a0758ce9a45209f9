"""What records of an element do not tell of its parameters, beside hidden causes too."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.element.columns import _shapes_of, force_derivatives, law_columns
from carrierflex.diagnosis.element.problem import element_problem
from carrierflex.diagnosis.inference.effect_fit import fit_effects
from carrierflex.diagnosis.inference.named_values import _named_values, _scatter, published_values
from carrierflex.diagnosis.inference.thresholds import Thresholds
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import Baseline, Channel, InputSignal
from carrierflex.identification.campaign.records import Run
from tests.diagnosis.element.element_campaigns import (
    DAMPING,
    MASS,
    STEP,
    STIFFNESS,
    displacement_campaign,
    force_campaign,
    no_law,
)

FLOOR_RATIO = Thresholds().floor_ratio
OMEGA = 2.0 * np.pi * 5.0
#: Force over deflection of the element at 5 Hz, but for the damper.
NET = STIFFNESS - MASS * OMEGA**2
CUBIC = 5e8


def sine_campaign(*, late=0.0, seed=0, mass=None):
    """Element moved by one sine of 5 Hz at three levels; its force is written `late` [s]."""
    rng = np.random.default_rng(seed)
    time = STEP * np.arange(2000)
    runs = []
    for number, amplitude in enumerate((0.5e-3, 1e-3, 2e-3)):
        q = amplitude * np.sin(OMEGA * time)
        phase = OMEGA * (time - late)
        force = amplitude * (NET * np.sin(phase) + DAMPING * OMEGA * np.cos(phase))
        force = force + 0.05 * rng.standard_normal(time.size)
        name = f"R{number}"
        runs.append(Run(name, f"{name}.csv", name, time, {"displacement": q}, {"F": force}))
    rig = {"drive": "displacement", "settle_samples": 100, **({"mass": mass} if mass else {})}
    channel = Channel("F", "force", "N", noise_std=0.05)
    return Campaign("element", "sine", Baseline("model"), rig, (channel,), tuple(runs))


def published(campaign, effects=()):
    problem = element_problem(campaign)
    return published_values(problem, fit_effects(problem, effects), floor_ratio=FLOOR_RATIO)


def with_gains(campaign, quantity, unit):
    """Campaign that declares gains of 1 %, as rigs do."""
    return replace(
        campaign,
        channels=(replace(campaign.channels[0], gain_std=0.01),),
        inputs=(InputSignal(quantity, unit, gain_std=0.01),),
    )


def test_one_sine_tells_stiffness_less_inertia_and_neither_of_them():
    values = published(sine_campaign())
    base = values.parameters["baseline"]
    for name in ("m", "K1"):
        assert np.isnan([base[name].std, *base[name].ci95]).all()
    assert base["C1"].ci95[0] < DAMPING < base["C1"].ci95[1]
    (text,) = values.undetermined
    assert text.startswith("m and K1 are not determined one by one: these records know K1 - m w² =")
    assert "at 5 Hz" in text
    value, half = (float(word) for word in text.split(" = ")[1].split(" N/m")[0].split(" ± "))
    assert abs(value - NET) < half < 0.01 * NET


def test_a_given_mass_leaves_the_stiffness_determined():
    values = published(sine_campaign(mass=MASS))
    low, high = values.parameters["baseline"]["K1"].ci95
    assert low < STIFFNESS < high
    assert high - low < 0.02 * STIFFNESS
    assert values.undetermined == ()


@pytest.mark.parametrize("by_force", [False, True])
def test_many_frequencies_determine_mass_and_stiffness_as_before(by_force):
    if by_force:
        campaign = with_gains(force_campaign(no_law), "force", "N")
    else:
        campaign = with_gains(
            displacement_campaign(lambda q, v: 0.0 * q, n=1500), "displacement", "m"
        )
    problem = element_problem(campaign)
    fit = fit_effects(problem, ())
    values = published_values(problem, fit, floor_ratio=FLOOR_RATIO)
    before = _named_values(fit, _scatter(fit, few_blocks=True))["baseline"]["K1"]
    # A cause below the floor is small beside gains of 1 %.
    assert_allclose(values.parameters["baseline"]["K1"].std, before.std, rtol=0.03)
    assert values.undetermined == ()
    assert "one frequency" not in values.gains


@pytest.mark.parametrize("late", [-0.5 * STEP, 0.5 * STEP])
def test_a_delay_of_half_a_sample_reads_as_damping_at_one_frequency(late):
    values = published(sine_campaign(late=late))
    # A force that is late turns K1 - m w² into damping: D e^(-i w tau), w tau = 0.08.
    turned = (NET + 1j * OMEGA * DAMPING) * np.exp(-1j * OMEGA * late)
    damping = values.parameters["baseline"]["C1"].value
    assert_allclose(damping, max(turned.imag / OMEGA, 0.0), atol=0.05)
    # To first order more than the whole damping; the delay turns a little of C1 into K1 too.
    change = values.gains.split("half a sample (2.5 ms) moves C1 by ")[1].split(" N s/m")[0]
    assert float(change) == pytest.approx(0.5 * STEP * NET, rel=0.02)


def test_a_shape_between_those_of_the_table_is_the_law_itself():
    campaign = displacement_campaign(lambda q, v: 0.0 * q, n=1500)
    problem = element_problem(campaign)
    table = problem.class_table
    size, record = table.bases.size, table.records[-1]
    effect = "stribeck_friction"
    v_s = np.sqrt(np.prod(_shapes_of(effect, size)[3:5]))
    parameters = problem.parameters((effect,))
    theta = np.array([MASS, STIFFNESS, DAMPING, 0.0, 1.0, 2.0, v_s])
    J = force_derivatives(problem.model, table.table, size, parameters, theta)
    J = J * (table.table.scale / table.table.scale[0])[:, None]  # of the columns as they are
    (law,) = (law for law in table.table.laws["dissipation"] if law.id == effect)
    columns = law_columns(problem.model, record, effect, size)
    made = sum(J[numbers].T @ shape for numbers, shape in zip(law.variants, columns, strict=True))
    rise = np.tanh(record.v / size.rest_speed) * np.exp(-((record.v / v_s) ** 2))
    by_name = dict(zip([parameter.name for parameter in parameters], made, strict=True))
    # Halfway between two speeds that differ by a factor of two, where the cubic is worst: 4 % of
    # the largest. The nearest shape of the table alone is 25 % off.
    assert_allclose(by_name["Fs"], rise, atol=0.05)
    assert_allclose(
        by_name["v_s"], 2.0 * rise * 2.0 * record.v**2 / v_s**3, atol=0.1 * np.ptp(by_name["v_s"])
    )


HIDDEN = (
    lambda q, v: 0.4 * np.tanh(v / 5e-3),
    lambda q, v: 1e2 * v * np.abs(v),
    lambda q, v: 4e6 * q**2 * v,
    lambda q, v: 2e5 * q**2,
)


@pytest.mark.long
def test_intervals_hold_the_truth_beside_a_hidden_second_cause():
    hits = {"blind": [], "aware": []}
    for number, hidden in enumerate(HIDDEN):
        for seed in range(4):
            campaign = displacement_campaign(
                lambda q, v, hidden=hidden: CUBIC * q**3 + hidden(q, v),
                n=1500,
                seed=10 * number + seed,
            )
            problem = element_problem(campaign)
            fit = fit_effects(problem, ("cubic_stiffness",))
            aware = published_values(problem, fit, floor_ratio=FLOOR_RATIO).parameters
            blind = _named_values(fit, _scatter(fit, few_blocks=True))
            for name, values in (("blind", blind), ("aware", aware)):
                for effect, symbol, truth in (
                    ("baseline", "K1", STIFFNESS),
                    ("cubic_stiffness", "K3", CUBIC),
                ):
                    low, high = values[effect][symbol].ci95
                    hits[name].append(low < truth < high)
    # Section 6 of the prototype: 0.52 and 0.57 without, 0.97 and 0.98 with the shift.
    print(np.mean(hits["blind"]), np.mean(hits["aware"]))
    assert np.mean(hits["blind"]) < 0.75
    assert np.mean(hits["aware"]) >= 0.9
