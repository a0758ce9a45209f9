"""Contradicting dimensions are refused.

The message names the parameter, what was found and what is expected.
"""

import math
import re
from dataclasses import fields

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.geometry.parameter_files import StageParameters
from carrierflex.geometry.parameters import CarrierParameters, GearData, PinParameters
from carrierflex.geometry.pins import pin_angles

CARRIER_CONTRADICTIONS = [
    (
        {"pin_hole_diameter": 0.26},
        r"pin_hole_diameter is 0.26 m: the hole reaches radius 0.438 m and leaves the plate",
    ),
    (
        {"hub_outer_diameter": 0.47},
        r"hub_outer_diameter is 0.47 m and covers the pin holes, .* expected at most 0.466 m",
    ),
    ({"seat_outer_diameter": 0.47}, r"seat_outer_diameter is 0.47 m and covers the pin holes"),
    (
        {"web_inner_radius": 0.435},
        r"web_inner_radius is 0.435 m; expected less than outer_radius 0.435 m",
    ),
    (
        {"web_inner_radius": 0.155},
        r"web_inner_radius is 0.155 m; expected more than the radius of the central bores, 0.16 m",
    ),
    (
        {"planet_clearance_radius": 0.30},
        r"planet_clearance_radius is 0.3 m: the webs touch the planet, .* 0.2788 m",
    ),
    (
        {"planet_clearance_radius": 0.08},
        r"planet_clearance_radius is 0.08 m; expected more than the pin hole's radius",
    ),
    (
        {"hub_inner_diameter": 0.46},
        r"hub_inner_diameter is 0.46 m; expected less than hub_outer_diameter 0.46 m",
    ),
    (
        {"seat_inner_diameter": 0.40},
        r"seat_inner_diameter is 0.4 m; expected less than seat_outer_diameter 0.4 m",
    ),
    (
        {"upwind_bearing_width": 0.12},
        r"upwind_bearing_width is 0.12 m; expected less than hub_length 0.12 m",
    ),
    (
        {"sensor_radius": 0.435},
        r"outer_radius is 0.435 m: the rim ends inside the sensor radius 0.435 m",
    ),
    (
        {"sensor_radius": 0.388},
        r"sensor_radius is 0.388 m: the measured circle crosses the pin holes",
    ),
]


@pytest.mark.parametrize(("changed", "message"), CARRIER_CONTRADICTIONS)
def test_contradicting_carrier_dimensions_are_refused(changed, message):
    with pytest.raises(ValueError, match=rf"^(\d problems: \(1\) )?\[carrier\] {message}"):
        CarrierParameters(**changed)


@pytest.mark.parametrize("name", ["hub", "seat"])
def test_a_shaft_end_as_wide_as_the_plate_is_refused(name):
    # With holes of usual size the hole's edge is met first; only a needle's hole lets the plate's
    # edge come before it.
    needle = {"pin_hole_diameter": 0.002, "centre_distance": 0.433}
    with pytest.raises(
        ValueError,
        match=rf"{name}_outer_diameter is 0.872 m; expected less than twice outer_radius",
    ):
        CarrierParameters(**needle, **{f"{name}_outer_diameter": 0.872})


#: Tables of the file of dimensions.
TABLES = {CarrierParameters: "carrier", PinParameters: "pin", GearData: "gear"}


@pytest.mark.parametrize("kind", TABLES)
@pytest.mark.parametrize("value", [0.0, -0.1, math.nan, math.inf, "0.1", None])
def test_every_parameter_must_be_a_positive_number(kind, value):
    for field in fields(kind):
        if (field.name, value) == ("helix_angle", 0.0):
            continue  # spur gears
        with pytest.raises(
            ValueError,
            match=rf"^\[{TABLES[kind]}\] {field.name} is .*; expected a positive number$",
        ):
            kind(**{field.name: value})


def test_a_pin_of_another_diameter_than_the_hole_is_refused(carrier):
    with pytest.raises(
        ValueError,
        match=r"\[pin\] diameter is 0.159 m; expected the carrier's pin_hole_diameter",
    ):
        PinParameters(diameter=0.159).check_fits(carrier)


def test_a_bearing_as_wide_as_the_plate_gap_is_refused(carrier):
    with pytest.raises(
        ValueError,
        match=r"\[pin\] bearing_width is 0.24 m; expected less than .* plate_gap 0.24",
    ):
        PinParameters(bearing_width=0.24).check_fits(carrier)


def test_tooth_numbers_that_do_not_mesh_are_refused():
    with pytest.raises(
        ValueError, match=r"\[gear\] ring_teeth is 98; expected sun_teeth \+ 2 planet_teeth = 99"
    ):
        GearData(ring_teeth=98)


def test_tooth_numbers_that_cannot_be_assembled_are_refused():
    with pytest.raises(
        ValueError,
        match=r"\[gear\] sun_teeth is 22; expected ring_teeth \+ sun_teeth divisible by 3",
    ):
        StageParameters(gear=GearData(ring_teeth=100, sun_teeth=22))
    gear = GearData(ring_teeth=99, planet_teeth=33, sun_teeth=33)
    assert not list(gear.assembly_conflicts(4))
    assert any("divisible by 5" in text for text in gear.assembly_conflicts(5))


def test_planets_that_touch_are_refused(gear):
    assert not list(gear.assembly_conflicts(4))
    # 2 x 308 sin(36 deg) = 362 mm from one to the next.
    (message,) = gear.assembly_conflicts(5)
    assert "planet_tip_diameter is 0.4212 m: planets are 0.3621 m apart and touch" in message


@pytest.mark.parametrize("n_planets", [2, 9, 3.0, True])
def test_a_number_of_planets_that_no_carrier_has_is_refused(n_planets):
    with pytest.raises(
        ValueError, match=r"n_planets is (2|9|3\.0|True); expected a whole number from 3 to 8"
    ):
        CarrierParameters(n_planets=n_planets)


def test_pins_that_overlap_are_refused():
    with pytest.raises(
        ValueError,
        match=r"n_planets is 8: neighbouring pin holes of pin_hole_diameter 0.24 m are 0.2357 m",
    ):
        CarrierParameters(
            n_planets=8, pin_hole_diameter=0.24, hub_outer_diameter=0.35, seat_outer_diameter=0.35,
            hub_inner_diameter=0.2, outer_radius=0.6, sensor_radius=0.5,
        )  # fmt: skip


def test_working_pitch_diameter_and_ratio_are_those_of_the_paper(gear):
    # 2 x 308 x 39 / 60 and 1 + 99 / 21; the paper prints 400.4 mm and 5.71.
    assert_allclose(gear.planet_pitch_diameter, 0.4004, rtol=1e-12)
    assert_allclose(gear.ratio, 120.0 / 21.0, rtol=1e-12)


def test_pins_stand_at_increasing_angles_from_the_first():
    assert_allclose(np.rad2deg(pin_angles(3)), [0.0, 120.0, 240.0], rtol=1e-15)
    assert_allclose(np.rad2deg(pin_angles(4)), [0.0, 90.0, 180.0, 270.0], rtol=1e-15)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"pressure_angle": 20.0}, "pressure_angle is 20.0; expected an angle in radians"),
        ({"helix_angle": 7.5}, "helix_angle is 7.5; expected an angle in radians"),
        ({"sun_teeth": 22.5, "ring_teeth": 100.5}, "ring_teeth is 100.5; expected a whole number"),
    ],
)
def test_gear_data_in_degrees_or_with_parts_of_teeth_are_refused(wrong, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        GearData(**wrong)


def test_dimensions_in_millimetres_are_refused():
    with pytest.raises(
        ValueError, match=r"outer_radius is 435\.0 m; expected dimensions in metres"
    ):
        CarrierParameters(outer_radius=435.0)


@pytest.mark.parametrize(
    ("kind", "wrong"),
    [
        (CarrierParameters, {"upwind_plate_thickness": 65.0}),
        (CarrierParameters, {"hub_length": 120.0}),
        (CarrierParameters, {"plate_gap": 0.88}),
        (GearData, {"planet_width": 227.5}),
        (GearData, {"module": 10.5}),
    ],
)
def test_one_length_in_millimetres_is_refused_by_its_name(kind, wrong):
    ((name, value),) = wrong.items()
    with pytest.raises(ValueError, match=rf"{name} is {value} m; expected .*dimensions in metres"):
        kind(**wrong)
