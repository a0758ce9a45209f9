import re

import pytest

from carrierflex.diagnosis.comparison.effect_names import plain_name, set_name
from carrierflex.diagnosis.gap.findings import Exponent, PartGrowth
from carrierflex.diagnosis.report import words
from carrierflex.diagnosis.report.figures import inline_svg
from carrierflex.diagnosis.report.words import raised
from carrierflex.files.quantities import scaled_unit, sized

NAN, INF = float("nan"), float("inf")


@pytest.mark.parametrize(
    ("value", "std", "wanted"),
    [
        (3.9421, 0.0132, ("3.942", "0.013")),
        (5.8e-4, 1e-5, ("5.80e-4", "0.10e-4")),
        (-1.5, 40.0, ("-2", "40")),
        (2.5e6, 1.0e4, ("2.500e6", "0.010e6")),
        (0.0, 2.8e135, ("0", "not determined")),
        (1e-20, 3.0, ("1e-20", "not determined")),
        (7.0, 0.0, ("7", "–")),
        (7.0, NAN, ("7", "not determined")),
        (NAN, 1.0, ("–", "–")),
    ],
)
def test_values_have_as_many_digits_as_their_error_allows(value, std, wanted):
    assert words.with_error(value, std) == wanted


def test_sizes_take_a_prefix_where_the_unit_allows_it():
    assert sized(2.08e-4, "m") == "208 µm"
    assert sized(1.5e4, "N") == "15 kN"
    assert sized(NAN, "m") == "–"
    assert sized(3e-21, "m") == "0 m"
    assert scaled_unit(2e-9, "m") == (1e9, "nm")
    for size, unit in ((2e-4, "rad"), (2e-4, "m per kN"), (0.0, "m"), (INF, "m")):
        assert scaled_unit(size, unit) == (1.0, unit)


def test_shares_ratios_and_intervals():
    assert [words.percent(share) for share in (0.7123, 0.0512, NAN)] == ["71 %", "5.1 %", "–"]
    assert words.interval((0.1, NAN)) == "–"
    # Ends that are the same in print are no interval.
    assert words.interval((0.99999, 1.0)) == "± < 0.001"
    assert words.in_one_unit([3.14e-7, 0.0, 1.75e-4], "m") == (["0.314", "0", "175"], "µm")
    assert (words.ratio(0.0361), words.number(9.8123)) == ("0.036", "9.81")


def test_powers_are_raised_and_everything_else_is_escaped():
    assert raised("N s^2/m^-3 & <b>") == "N s<sup>2</sup>/m<sup>−3</sup> &amp; &lt;b&gt;"
    wanted = "p &lt; torque<sup>−0.5</sup>, p ≤ 1·10<sup>−9</sup>"
    assert raised("p < torque^-0.5, p <= 1e-09") == wanted
    assert raised("5.80e-4") == "5.80·10<sup>−4</sup>"
    assert raised("-2.500e6") == "-2.500·10<sup>6</sup>"
    # Names stay as they are.
    assert raised("in run 1e-3") == "in run 1e-3"
    assert raised("3.942") == "3.942"


def test_lists_and_places():
    assert [words.listed(names) for names in ([], ["a"], ["a", "b"], ["a", "b", "c"])] == [
        "",
        "a",
        "a and b",
        "a, b and c",
    ]
    assert (set_name(("sensor_zero", "ring_pass")), set_name(())) == (
        "sensor zero + planet pass",
        "baseline alone",
    )
    wanted = {
        "coulomb_friction": "Coulomb friction",
        "elasto_plastic_friction": "elasto-plastic friction",
    }
    assert {effect: plain_name(effect) for effect in wanted} == wanted
    assert (words.counted(1, "run"), words.counted(2, "run")) == ("1 run", "2 runs")
    assert words.position_of(3.0, None) == "order 3"
    for band, text in (((50.0, 50.0), "50 Hz"), ((50.0, 66.2), "50–66.2 Hz"), ((0.0, 0.0), "0 Hz")):
        assert words.position_of(3.0, band) == text


def test_figures_on_one_page_keep_their_identifiers_apart():
    from matplotlib.figure import Figure

    def draw():
        figure = Figure(figsize=(2.0, 2.0))
        figure.subplots().plot([0.0, 1.0], [0.0, 1.0], marker="o")
        return figure

    first, second = inline_svg(draw, "one", "a < b"), inline_svg(draw, "two", "b")
    assert first == inline_svg(draw, "one", "a < b")
    assert first.replace("one-", "two-").replace("a &lt; b", "b") == second
    assert '<title id="one-title">a &lt; b</title>' in first
    assert "<metadata" not in first
    identifiers = re.findall(r'\bid="([^"]+)"', first)
    assert len(identifiers) > 3
    assert all(identifier.startswith("one-") for identifier in identifiers)


def test_only_exponents_that_tell_one_law_from_another_are_listed():
    sharp, vague = Exponent(1.0, (0.9, 1.1), 1e-9, 4), Exponent(0.2, (-41.0, 41.0), 0.9, 2)
    unknown = Exponent(NAN, (NAN, NAN), NAN, 1, "one torque")
    growth = [
        PartGrowth("m=2", 0.0, "housing", {"torque": sharp, "load": vague}),
        PartGrowth("q", NAN, "", {"v": sharp}),
    ]
    growth.append(PartGrowth("m=0", 1.0, "carrier", {"torque": unknown}))
    rows = words.growth_rows(growth)
    assert rows == [("m=2, order 0", "housing", "torque", sharp), ("q", "–", "v", sharp)]


def test_a_value_is_told_with_its_interval_under_one_power_of_ten():
    def value_text(value, error, unit="N/m"):
        return words.value_words(words._ParameterRow("e", "", "k", value, error, unit, {}))

    assert value_text(0.5951, 0.0137, "mrad") == "0.595 ± 0.014 mrad"
    assert value_text(8.82e6, 0.9e6) == "(8.82 ± 0.90)·10^6 N/m"
    assert value_text(0.6119, 0.0023, "1") == "0.6119 ± 0.0023"
    assert value_text(7.0, NAN) == "7 N/m, not determined"
    assert words.pair((0.91, 1.13)) == "0.9 to 1.1"
    assert words.pair((-0.04, 0.04)) == "0.0 ± < 0.1"
