"""Elements that are released or stand on a moving base: twins with known truth."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from carrierflex.diagnosis.element.problem import element_problem
from carrierflex.diagnosis.inference.effect_fit import fit_effects
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.campaign_files import read_campaign, write_campaign
from carrierflex.identification.campaign.declarations import Baseline, Channel, InputSignal
from carrierflex.identification.campaign.records import Run
from tests.diagnosis.element.element_campaigns import DAMPING, MASS, STEP, STIFFNESS, multisine

CUBIC = 2e9
#: Decays rub less, so that they swing for the whole record: 0.6 % of critical.
DECAY_DAMPING = 1.5
NOISE = 2e-6


def cubic(q, v):
    return CUBIC * q**3


def no_law(q, v):
    return 0.0 * q


def motion(law, time, state, acceleration=lambda t: 0.0, damping=DAMPING):
    """Relative deflection of the mass; its base moves with an acceleration [m/s²]."""

    def rates(t, y):
        force = STIFFNESS * y[0] + damping * y[1] + law(y[0], y[1])
        return [y[1], -force / MASS - acceleration(t)]

    solution = solve_ivp(rates, (0.0, time[-1]), state, "DOP853", time, rtol=1e-9, atol=1e-13)
    return solution.y[0]


def dry(q, v):
    return 0.5 * np.tanh(v / 1e-4)


def decay_campaign(
    law, *, mass=None, seed=0, starts=(1e-3, 2e-3, 3e-3), damping=DECAY_DAMPING, **baseline
):
    rng = np.random.default_rng(seed)
    time = STEP * np.arange(600)
    runs = []
    for number, start in enumerate(starts):
        # Released with a speed of its own, so that neither start value is zero.
        q = motion(law, time, (start, 20.0 * start), damping=damping)
        q = q + NOISE * rng.standard_normal(time.size)
        runs.append(Run(f"R{number}", f"R{number}.csv", f"release {start}", time, {}, {"q": q}))
    rig = {"drive": "free_decay", **({} if mass is None else {"mass": mass})}
    channel = Channel("q", "displacement", "m", noise_std=NOISE)
    return Campaign("element", "decay", Baseline("model", **baseline), rig, (channel,), tuple(runs))


@cache
def base_campaign(law, *, measured="base_displacement", kind="relative", mass=MASS, seed=0):
    rng = np.random.default_rng(seed)
    runs = []
    for number, amplitude in enumerate((0.2e-3, 0.5e-3)):
        shape, n = multisine(1.0, 10 * seed + number, periods=2, lines=range(1, 60))
        time = STEP * np.arange(n)

        def u(t, amplitude=amplitude, shape=shape):
            return amplitude * shape(t)

        def acceleration(t, u=u):
            return (u(t + 1e-4) - 2.0 * u(t) + u(t - 1e-4)) / 1e-8

        q = motion(law, time, (0.0, 0.0), acceleration)
        x = q + u(time) if kind == "absolute" else q
        columns = {"base_displacement": u(time), "base_acceleration": acceleration(time)}
        runs.append(
            Run(
                f"R{number}",
                f"R{number}.csv",
                f"base {amplitude}",
                time,
                {measured: columns[measured]},
                {"x": x + NOISE * rng.standard_normal(n)},
            )
        )
    rig = {"drive": "base", **({} if mass is None else {"mass": mass})}
    channel = Channel("x", "displacement", "m", noise_std=NOISE, motion=kind)
    return Campaign("element", "base", Baseline("model"), rig, (channel,), tuple(runs))


def values_of(fit):
    return {
        (p.name if p.run is None else f"{p.name} of {p.run}"): float(value)
        for p, value in zip(fit.parameters, fit.theta, strict=True)
    }


@pytest.mark.parametrize("mass", [None, MASS])
def test_a_release_gives_stiffness_and_damping_and_its_own_start(mass):
    problem = element_problem(decay_campaign(no_law, mass=mass))
    fit = fit_effects(problem, ())
    values, scale = values_of(fit), (mass or 1.0) / MASS
    assert values["K1"] == pytest.approx(scale * STIFFNESS, rel=2e-3)
    assert values["C1"] == pytest.approx(scale * DECAY_DAMPING, rel=1e-2)
    assert "m" not in values
    for number, start in enumerate((1e-3, 2e-3, 3e-3)):
        assert values[f"q_0 of R{number}"] == pytest.approx(start, abs=4.0 * NOISE)
        assert values[f"v_0 of R{number}"] == pytest.approx(20.0 * start, abs=400.0 * NOISE)
    assert fit.cost == pytest.approx(problem.noise_square.sum(), rel=0.1)
    units = {p.name: p.unit for p in fit.parameters}
    assert units["K1"] == ("N/m" if mass else "1/s^2")
    assert units["f0"] == ("N" if mass else "m/s^2")


def pendulum_campaign():
    """One decay of a pendulum from 1.6 rad, cut in two; cube and fifth power in its baseline."""
    step, n = 0.02, 600

    def rates(t, y):
        return [y[1], -64.0 * np.sin(y[0]) - 0.06 * y[1]]

    time = step * np.arange(2 * n)
    swing = solve_ivp(rates, (0.0, time[-1]), (1.6, 0.0), "DOP853", time, rtol=1e-9, atol=1e-12)
    noise = 1e-4 * np.random.default_rng(3).standard_normal(2 * n)
    angles = np.split(swing.y[0] + noise, 2)
    runs = tuple(
        Run(f"R{k}", f"R{k}.csv", f"part {k}", time[:n], {}, {"q": angle})
        for k, angle in enumerate(angles)
    )
    channel = Channel("q", "displacement", "rad", noise_std=1e-4)
    contained = Baseline("model", ("cubic_stiffness", "quintic_stiffness"))
    return Campaign("element", "swing", contained, {"drive": "free_decay"}, (channel,), runs)


def test_the_curvature_of_a_pendulum_is_a_sixth_of_its_stiffness():
    # A spring that softens: its cube is negative, and so is where the search must start.
    values = values_of(fit_effects(element_problem(pendulum_campaign()), ()))
    assert values["K1"] == pytest.approx(64.0, rel=2e-3)
    # Least squares of three powers on the sine itself are off by 0.4 % over this swing.
    assert values["K3"] / values["K1"] == pytest.approx(-1.0 / 6.0, rel=0.01)
    assert values["K5"] / values["K1"] == pytest.approx(1.0 / 120.0, rel=0.1)


def test_the_law_of_a_release_is_found_with_its_class():
    problem = element_problem(decay_campaign(cubic))
    fit = fit_effects(problem, ("cubic_stiffness",))
    assert values_of(fit)["K3"] == pytest.approx(CUBIC / MASS, rel=0.01)
    answer = problem.class_answer()
    (result,) = answer.classes
    assert (result.id, result.law) == ("restoring_force", "cubic_stiffness")
    assert result.share > 0.98


@pytest.mark.parametrize(
    ("law", "damping", "classes"),
    [
        (no_law, 4.0, ()),
        (cubic, DAMPING, ("restoring_force",)),
        (dry, DECAY_DAMPING, ("dissipation",)),
    ],
)
def test_a_decay_shows_its_class_and_no_memory(law, damping, classes):
    # Records end in noise alone, or stuck; at 5 % of critical no two periods are of like size.
    problem = element_problem(decay_campaign(law, damping=damping))
    answer = problem.class_answer()
    assert answer.ids == classes


@pytest.mark.long
@pytest.mark.parametrize(
    ("measured", "kind"),
    [
        ("base_displacement", "relative"),
        ("base_displacement", "absolute"),
        ("base_acceleration", "relative"),
    ],
)
def test_a_moving_base_drives_the_mass_by_its_inertia(measured, kind):
    # With a mass the forces are in newtons, without one they are per mass.
    mass = MASS if kind == "absolute" else None
    problem = element_problem(base_campaign(no_law, measured=measured, kind=kind, mass=mass))
    fit = fit_effects(problem, ())
    values, scale = values_of(fit), (mass or 1.0) / MASS
    assert values["K1"] == pytest.approx(scale * STIFFNESS, rel=5e-3)
    assert values["C1"] == pytest.approx(scale * DAMPING, rel=2e-2)
    assert "m" not in values


@pytest.mark.long
def test_the_motion_of_the_channel_matters():
    relative = base_campaign(no_law, kind="absolute")
    channel = replace(relative.channels[0], motion="relative")
    wrong = fit_effects(element_problem(replace(relative, channels=(channel,))), ())
    right = fit_effects(element_problem(relative), ())
    assert wrong.cost > 100.0 * right.cost


def test_what_cannot_be_integrated_is_refused_by_name():
    campaign = base_campaign(no_law, measured="base_acceleration")
    channel = replace(campaign.channels[0], motion="absolute")
    with pytest.raises(
        ValueError, match="motion is 'absolute' together with the input 'base_accelera"
    ):
        element_problem(replace(campaign, channels=(channel,)))


CAMPAIGNS = {
    "decay": lambda: decay_campaign(no_law, starts=(1e-3,)),
    "without mass": lambda: base_campaign(no_law, mass=None),
    "acceleration": lambda: base_campaign(no_law, measured="base_acceleration"),
}


@pytest.mark.parametrize("name", CAMPAIGNS)
def test_such_campaigns_come_back_from_their_folder(tmp_path, name):
    campaign = CAMPAIGNS[name]()
    write_campaign(campaign, tmp_path / "c")
    read = read_campaign(tmp_path / "c")
    assert dict(read.rig) == dict(campaign.rig)
    assert read.channels[0].motion == campaign.channels[0].motion
    assert list(read.runs[0].inputs) == list(campaign.runs[0].inputs)
    assert "version = 2" in (tmp_path / "c" / "campaign.toml").read_text()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("version = 2", "version = 1"), "'drive' is 'base', which belongs to version 2"),
        (
            (', motion = "relative"', ""),
            "x: missing key 'motion'; expected relative",
        ),
        (
            ('"relative"', '"sideways"'),
            "'motion' is 'sideways'; expected one of relative, absolute",
        ),
        (('"base"', '"force"'), "key 'motion' is 'relative'; expected no such key where drive"),
    ],
)
def test_wrong_documents_of_a_base_are_refused(tmp_path, change, message):
    write_campaign(base_campaign(no_law), tmp_path / "c")
    path = tmp_path / "c" / "campaign.toml"
    path.write_text(path.read_text().replace(*change))
    with pytest.raises(ValueError, match=message):
        read_campaign(tmp_path / "c")


def test_a_base_in_other_units_than_the_channel_is_refused():
    campaign = base_campaign(no_law)
    inputs = (InputSignal("base_displacement", "V"),)
    with pytest.raises(ValueError, match=r"unit of 'x' is m and .* 'base_displacement' is V; expe"):
        element_problem(replace(campaign, inputs=inputs))
