"""Verdicts on simulated elements.

Named, at the floor, none of these, aliased, and what cannot be diagnosed.
"""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.diagnosis.element.problem import element_problem
from carrierflex.diagnosis.kinds import problem_of
from carrierflex.diagnosis.report.diagnosis_files import diagnosis_document
from carrierflex.diagnosis.report.gap_words import where_text
from tests.diagnosis.element.element_campaigns import displacement_campaign, force_campaign, no_law
from tests.identification.synthetic_campaigns import carrier_campaign


def diagnosis_of(campaign):
    problem = problem_of(campaign)
    return diagnose(
        problem,
        campaign=campaign.name,
        kind=campaign.kind,
        floor_is_measured=problem.noise_is_measured,
    )


def cubic(q, v):
    return 8e8 * q**3


@pytest.fixture(scope="module")
def cubic_diagnosis():
    return diagnosis_of(force_campaign(cubic))


def test_a_cubic_spring_is_named_and_its_size_found(cubic_diagnosis):
    assert cubic_diagnosis.verdict == "named"
    assert cubic_diagnosis.attribution.effects == ("cubic_stiffness",)
    estimate = cubic_diagnosis.attribution.parameters["cubic_stiffness"]["K3"]
    assert_allclose(estimate.value, 8e8, rtol=5e-3)
    assert estimate.unit == "N/m^3"
    far = cubic_diagnosis.reduction
    assert far.rho < 0.02
    assert far.rho_ci95[0] <= far.rho <= far.rho_ci95[1]
    assert 0.97 < far.floor_multiple < 1.05
    assert far.phi > 0.999
    assert [step.added for step in far.steps] == ["baseline", "cubic_stiffness"]


def test_the_gap_map_tells_growth_and_parity_of_the_law(cubic_diagnosis):
    text = where_text(cubic_diagnosis)
    assert "on odd lines: the missing law is odd" in text
    assert "in R2" in text or "in every run" in text
    exponent = float(text.split("deflection^")[1].split(" ")[0])
    assert_allclose(exponent, 3.0, atol=0.3)
    shares = sum(cell.share for cell in cubic_diagnosis.reduction.cells_before)
    assert_allclose(shares, 1.0, rtol=1e-9)


@pytest.mark.acceptance
def test_an_even_law_stands_on_even_lines():
    assert "on even lines: the missing law is even" in where_text(
        diagnosis_of(force_campaign(lambda q, v: 2e5 * q**2))
    )


@pytest.mark.long
def test_nothing_missing_is_at_the_noise_floor():
    diagnosis = diagnosis_of(force_campaign(no_law))
    assert diagnosis.verdict == "at_noise_floor"
    assert diagnosis.attribution.effects == ()


@pytest.mark.long
def test_dry_friction_is_named_with_its_class():
    diagnosis = diagnosis_of(displacement_campaign(lambda q, v: 0.4 * np.sign(v), n=2000))
    assert diagnosis.verdict == "named"
    assert diagnosis.attribution.effects == ("coulomb_friction",)
    # Laws of more parameters that hold it are fitted too, and are no better.
    assert {"stribeck_friction"} <= {
        law for row in diagnosis.attribution.ranking for law in row.effects
    }
    assert_allclose(
        diagnosis.attribution.parameters["coulomb_friction"]["Fc"].value, 0.4, rtol=0.05
    )


@pytest.mark.acceptance
def test_two_effects_are_both_named():
    diagnosis = diagnosis_of(
        displacement_campaign(lambda q, v: 5e8 * q**3 + 0.4 * np.sign(v), n=2000)
    )
    assert diagnosis.verdict in ("named", "named_with_remainder")
    assert set(diagnosis.attribution.effects) == {"cubic_stiffness", "coulomb_friction"}
    assert len(diagnosis.reduction.steps) == 3
    assert diagnosis.reduction.steps[2].rms < diagnosis.reduction.steps[1].rms


@pytest.mark.long
def test_a_law_outside_the_library_is_none_of_these():
    # A force that waves over the deflection ten times.
    diagnosis = diagnosis_of(
        displacement_campaign(lambda q, v: 0.5 * np.cos(2.0 * np.pi * q / 2e-4), n=2000)
    )
    assert diagnosis.verdict == "none_of_these"
    assert diagnosis.attribution.effects == ()
    assert "are refused" in diagnosis.reason


@pytest.mark.long
def test_mixed_up_forces_destroy_the_score():
    campaign = displacement_campaign(lambda q, v: 5e8 * q**3, n=2000)
    forces = [run.signals["F"] for run in campaign.runs]
    turned = tuple(
        replace(run, signals={"F": np.random.default_rng(3).permutation(force)})
        for run, force in zip(campaign.runs, forces, strict=True)
    )
    diagnosis = diagnosis_of(replace(campaign, runs=turned))
    assert diagnosis.verdict not in ("named", "named_with_remainder")


@pytest.mark.long
@pytest.mark.slow
def test_what_the_baseline_contains_is_no_candidate():
    diagnosis = diagnosis_of(force_campaign(cubic, effects=("cubic_stiffness",)))
    assert diagnosis.verdict == "at_noise_floor"
    assert "cubic_stiffness" in diagnosis.attribution.parameters
    assert all("cubic_stiffness" not in ranked.effects for ranked in diagnosis.attribution.ranking)


@pytest.mark.long
@pytest.mark.slow
def test_one_condition_is_scored_by_blocks():
    diagnosis = diagnosis_of(force_campaign(cubic, amplitudes=(4.0,)))
    assert diagnosis.verdict == "named"
    assert diagnosis.attribution.effects == ("cubic_stiffness",)
    assert np.isnan(diagnosis.reduction.extrapolation_rho)


def test_too_short_a_record_says_what_is_missing():
    campaign = force_campaign(cubic, amplitudes=(4.0,), settle=0)
    short = replace(
        campaign,
        rig={"drive": "force"},
        runs=tuple(
            replace(
                r,
                time=r.time[:180],
                inputs={"force": r.inputs["force"][:180]},
                signals={"q": r.signals["q"][:180]},
            )
            for r in campaign.runs
        ),
    )
    diagnosis = diagnosis_of(short)
    assert diagnosis.verdict == "not_diagnosable"
    assert diagnosis.reduction is None
    how_far = diagnosis_document(diagnosis)["how_far"]
    assert how_far.pop("held_out")
    assert set(map(str, how_far.values())) == {"None", "[None, None]"}
    # A tenth at either end carries no derivatives.
    assert (
        diagnosis.attribution.discriminating_experiment
        == "run R0 holds 144 samples that count; expected at least 200"
    )


def test_signals_that_say_nothing_are_refused():
    campaign = force_campaign(cubic, amplitudes=(1.0,))
    (run,) = campaign.runs

    def with_signal(values):
        return replace(campaign, runs=(replace(run, signals={"q": values}),))

    with pytest.raises(
        ValueError, match=r"run R0: column 'q' holds 0 measured samples; expected a signal"
    ):
        problem_of(with_signal(np.full(run.time.size, np.nan)))
    with pytest.raises(
        ValueError, match=r"run R0: column 'q' is 0.25 throughout; expected a signal that changes"
    ):
        problem_of(with_signal(np.full(run.time.size, 0.25)))
    idle = replace(campaign, runs=(replace(run, inputs={"force": np.zeros(run.time.size)}),))
    with pytest.raises(ValueError, match=r"run R0: column 'force' is 0.0 throughout"):
        problem_of(idle)
    volts = replace(campaign, channels=(replace(campaign.channels[0], unit="V"),))
    with pytest.raises(
        ValueError, match=r"unit of 'q' is V and that of the input 'force' is N; expected both"
    ):
        problem_of(volts)


def test_a_kind_without_a_plant_is_refused(monkeypatch):
    monkeypatch.setattr(
        "carrierflex.diagnosis.kinds.PROBLEM_BUILDERS", {"element": element_problem}
    )
    with pytest.raises(ValueError, match=r"is of kind carrier; diagnose knows the kinds element"):
        problem_of(carrier_campaign())
