"""Sizes in words: three digits, a prefix, no power of ten."""

import math

import pytest

from carrierflex.files.quantities import scaled_unit, sized


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (4.66e-5, "m", "46.6 µm"),
        (-2.5e-3, "m", "-2.5 mm"),
        (3390.0, "N s/m", "3.39 kN s/m"),
        (2.1e8, "N/m", "210 MN/m"),
        (360e3, "N m", "360 kN m"),
        (0.12, "m/s", "120 mm/s"),
        (0.3, "rad", "0.3 rad"),
        (12.0, "", "12"),
        (0.0, "N", "0 N"),
        (math.nan, "N", "–"),
    ],
)
def test_a_size_is_read_without_a_power_of_ten(value, unit, text):
    assert sized(value, unit) == text


@pytest.mark.parametrize("unit", ["m", "N s/m", "Pa", "rad", "kN", "degC"])
def test_a_scaled_size_is_the_same_size(unit):
    """The prefix and the factor cancel: 5e-4 of a unit is 500 of its millionth."""
    factor, shown = scaled_unit(5e-4, unit)
    prefix = shown.removesuffix(unit)
    assert factor == {"": 1.0, "µ": 1e6, "m": 1e3}[prefix]
