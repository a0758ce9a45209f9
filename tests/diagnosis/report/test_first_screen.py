"""What a report shows first: engineers' units, the next step, the machine."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.classes.results import NO_CLASS
from carrierflex.diagnosis.comparison.overlay import Overlay, SignalComparison
from carrierflex.diagnosis.inference.results import VERDICTS, Attribution, GapReduction
from carrierflex.diagnosis.report.cause_rows import cause_rows
from carrierflex.diagnosis.report.figures import stretch_of
from carrierflex.diagnosis.report.machine_drawing import machine_figure
from carrierflex.diagnosis.report.verdict_words import next_step, verdict_heading, worth
from carrierflex.diagnosis.report.words import parameter_words, shown_unit
from carrierflex.diagnosis.results import Diagnosis
from carrierflex.identification.campaign.campaign_kinds import CARRIER, ELEMENT_BY_DRIVE, MOUNTING
from tests.diagnosis.element.element_campaigns import displacement_campaign
from tests.diagnosis.element.test_drives import decay_campaign, dry
from tests.diagnosis.report.verdict_pages import data_of, with_verdict
from tests.diagnosis.report.verdict_pages import diagnosed as diagnosed_element
from tests.identification.campaign.test_campaign_files import mounting_campaign
from tests.identification.synthetic_campaigns import carrier_campaign


def overlay(run, channel, gap, *, n=500):
    time = 0.01 * np.arange(n)
    measured = np.sin(7.0 * time)
    return Overlay(run, channel, time, "time", "s", measured, measured - gap)


def compared(channels):
    before = [overlay("A", name, 0.1 * (k + 1)) for k, name in enumerate(channels)]
    after = [overlay("A", name, 0.01) for name in channels]
    return SignalComparison(tuple(before), tuple(after))


def diagnosis(verdict, effects=("carrier_tilt",)):
    nothing = Attribution(effects, (), {}, (), "a test with radial load separates them")
    return Diagnosis("c", "carrier", verdict, "too few samples", "m", nothing)


def drawn(campaign, signals):
    return data_of(replace(diagnosis("named"), signals=signals), campaign)


def test_parameters_are_told_in_words_and_engineers_units():
    factor, unit = shown_unit("theta_PLC", "rad")
    assert_allclose(factor * np.pi, 180.0)
    assert unit == "deg"
    factor, unit = shown_unit("s_y", "m/N")
    # 1 nm/N is 100 um at 100 kN.
    assert_allclose(factor * 1e-9, 100.0)
    assert unit == "µm per 100 kN"
    assert shown_unit("phi_H", "rad") == (1e3, "mrad")
    assert shown_unit("K3", "N/m^3") == (1.0, "N/m^3")


@pytest.mark.parametrize("kind", [CARRIER, MOUNTING, *ELEMENT_BY_DRIVE.values()])
def test_every_published_parameter_has_words(kind):
    for effect, names in kind.parameters.items():
        assert [name for name in names if not parameter_words(effect, name)] == [], effect


@pytest.mark.parametrize("verdict", VERDICTS)
def test_every_verdict_has_a_next_step(verdict):
    text = next_step(diagnosis(verdict))
    assert text.endswith(".")
    assert "_" not in text.replace("--save-law", "")


def test_what_is_named_is_put_in_and_what_is_not_told_apart_is_measured_first():
    assert next_step(diagnosis("named")).startswith("Put carrier tilt into the simulation")
    aliased = next_step(diagnosis("aliased"))
    assert aliased.startswith("Do not put carrier tilt into the simulation yet. A test with")
    assert "radial load" in aliased
    assert next_step(diagnosis("not_diagnosable")) == "Measure again: too few samples."


def test_a_class_without_a_shape_is_looked_for_and_not_taken_into_the_simulation():
    line = with_verdict(diagnosis("named"), "class_named")
    assert next_step(line).startswith("Look for the source of motion at 0.47X")
    assert "--save-law" not in next_step(line)


def test_classes_that_one_frequency_mixes_are_measured_apart_and_no_unknown_cause():
    experiment = "drive at many frequencies, at the same levels"
    line = with_verdict(diagnosis("named"), "class_named")
    answer = replace(line.classes, state=NO_CLASS, classes=(), experiment=experiment)
    which = replace(line.attribution, discriminating_experiment=experiment)
    mixed = replace(line, verdict="none_of_these", classes=answer, attribution=which)
    assert next_step(mixed).endswith(
        "but not apart. Drive at many frequencies, at the same levels."
    )
    assert verdict_heading(mixed) == "These records show that an effect is missing, not which one"
    # Without one, no class explains the gap.
    unknown = replace(mixed, classes=replace(answer, experiment=""))
    assert next_step(unknown).startswith("Check the position and growth of the gap")
    assert verdict_heading(unknown) == "No known effect explains the gap"


def test_what_changes_the_size_of_an_effect_is_looked_for():
    named = with_verdict(diagnosis("named"), "class_named")
    answer = replace(
        named.classes, state=NO_CLASS, classes=(), best=("dissipation",), changes="its size changes"
    )
    line = replace(named, verdict="none_of_these", classes=answer)
    assert verdict_heading(line).startswith("An effect is missing whose size changes")
    assert next_step(line).startswith("Look for what changes the dissipation: temperature")
    # A fault of the measurement that explains it changes no dissipation.
    fault = replace(line, reason_id="wiring/clock")
    assert "temperature" not in next_step(fault)


def test_a_fault_beside_one_of_two_classes_is_an_alternative_to_both():
    classes = SimpleNamespace(
        ids=("coupled_damping", "memory"), ties=(), classes=(), state="named", experiment=""
    )
    tied = Attribution((), (("memory", "wiring/clock"),), {}, (), "")
    text = verdict_heading(replace(diagnosis("aliased"), classes=classes, attribution=tied))
    assert text == (
        "The gap is explained by coupled damping and memory. Cannot be distinguished in these "
        "records: one of coupled damping and memory; a fault of the measurement (clock)"
    )


def test_the_worth_is_the_gap_before_and_after():
    steps = (object(), object())
    fields = dict.fromkeys(GapReduction.__dataclass_fields__)
    far = GapReduction(
        **fields
        | {"rms_before": 2e-4, "rms_after": 1e-5, "noise_floor": 5e-6, "rho": 0.05, "steps": steps}
    )
    text = worth(replace(diagnosis("named"), reduction=far))
    assert text.startswith("Expected: gap 200 µm to 10 µm RMS (-95 %) on held-out records")
    assert worth(diagnosis("not_diagnosable")) == ""
    # Nothing is expected of laws that leave more than the baseline does.
    worse = replace(far, rms_after=7e-4, rho=3.5)
    assert worth(replace(diagnosis("named"), reduction=worse)).startswith("The gap is 200 µm RMS")


def test_what_a_class_explains_is_told_where_no_law_is_added():
    named = with_verdict(diagnosis("named"), "class_named")
    fields = dict.fromkeys(GapReduction.__dataclass_fields__)
    sizes = {"rms_before": 2e-4, "rms_after": 2e-4, "noise_floor": 5e-6, "rho": 1.0}
    law = GapReduction(**fields | sizes | {"steps": (object(),)})
    of_class = replace(law, rms_after=4e-5, rho=0.2)
    of_class_alone = replace(named, reduction=of_class, reduction_law=law)
    assert of_class_alone.shrinks_by_class
    assert worth(of_class_alone).startswith("Expected: gap 200 µm to 40 µm RMS (-80 %) on held-out")
    alone = replace(named, reduction=law, reduction_law=law)
    assert not alone.shrinks_by_class
    assert worth(alone).startswith("The gap is ")


def test_shares_of_causes_and_of_what_is_not_explained_are_one():
    """Also where the class of a law explains more than the law does."""
    named, campaign = diagnosed_element("element")
    far = named.reduction
    (finding,) = named.classes.classes
    high = replace(finding, share=1.0, share_ci95=(0.99, 1.0))
    with_share = replace(
        named,
        reduction=replace(far, phi=0.8, phi_ci95=(0.7, 0.9)),
        classes=replace(named.classes, classes=(high,)),
    )
    rows = cause_rows(data_of(with_share, campaign))
    assert_allclose([row.share for row in rows], [0.8, 0.2])
    # A second class that no step is of.
    second = replace(high, id="time_variation", law="", share=0.25)
    classes = replace(with_share.classes, classes=(high, second))
    rows = cause_rows(data_of(replace(with_share, classes=classes), campaign))
    assert_allclose([row.share for row in rows], [0.64, 0.16, 0.2])


def test_a_fitted_law_is_called_named_only_where_a_cause_is():
    named, campaign = diagnosed_element("element")
    assert [row.state for row in cause_rows(data_of(named, campaign))][:1] == ["named"]
    none = replace(
        named,
        verdict="none_of_these",
        attribution=replace(named.attribution, effects=()),
        classes=replace(named.classes, state=NO_CLASS, classes=()),
    )
    assert [row.state for row in cause_rows(data_of(none, campaign))] == [
        "nearest, not named",
        "unexplained",
    ]


def test_signals_are_compared_where_the_gap_is_largest():
    signals = compared(["a", "b", "c"])
    assert signals.before[signals.largest].channel == "c"
    assert_allclose(signals.by_channel()["b"], (0.2, 0.01), rtol=1e-9)
    late = replace(signals.before[0], simulated=signals.before[0].simulated.copy())
    late.simulated[420:460] += 3.0
    drawn = late.x[stretch_of(late)]
    assert drawn[0] <= 4.2
    assert drawn[-1] >= 4.59


@pytest.mark.parametrize(
    "campaign",
    [
        carrier_campaign(),
        mounting_campaign(),
        displacement_campaign(lambda q, v: 0.0 * q, n=100),
        decay_campaign(dry),
    ],
)
def test_the_machine_is_drawn_with_every_sensor(campaign):
    names = [channel.name for channel in campaign.channels]
    figure = machine_figure(drawn(campaign, compared(names)), 1)
    texts = " ".join(text.get_text() for text in figure.axes[0].texts)
    assert all(name in texts for name in names)


def test_the_pattern_at_the_rim_is_that_of_the_gap():
    campaign = carrier_campaign()
    turn = np.deg2rad(np.arange(0.0, 361.0, 2.0))
    tilt = [
        Overlay(
            "A",
            channel.name,
            np.rad2deg(turn),
            "carrier angle",
            "deg",
            1e-4 * np.cos(turn - channel.angle + 0.3),
            np.zeros(turn.size),
        )
        for channel in campaign.channels
    ]
    figure = machine_figure(drawn(campaign, SignalComparison(tuple(tilt), ())), 1)
    (dashed,) = (line for line in figure.axes[0].lines if line.get_linestyle() == "--")
    radius = np.hypot(*dashed.get_data())
    around = np.linspace(0.0, 2.0 * np.pi, radius.size)
    # One wave around the rim, largest towards the sensors' phase at the instant that is drawn.
    amplitude = np.abs(np.fft.rfft(radius[:-1] - 1.0))
    assert int(np.argmax(amplitude)) == 1
    assert amplitude[1] > 1e6 * amplitude[2]
    assert around.size == radius.size
