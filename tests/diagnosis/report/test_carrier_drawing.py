"""Dimensions that an answer names stand on the drawing of the carrier."""

from dataclasses import replace

import matplotlib.text
import pytest

from carrierflex.diagnosis.inference.results import ALIASED, NamedValue
from carrierflex.diagnosis.report.machine_drawing import carrier_figure, shown_dimensions
from carrierflex.geometry.parameters import CarrierParameters
from tests.diagnosis.report.verdict_pages import diagnosed, page_of

NAMED = ("geometry/outer_radius", "material/E", "geometry/plate_gap", "torque_tilt")


def test_every_dimension_of_the_solid_is_on_the_drawing():
    without_line = {"upwind_bearing_width", "sensor_radius", "n_planets"}
    names = [name for name in vars(CarrierParameters()) if name not in without_line]
    assert shown_dimensions(tuple(f"geometry/{name}" for name in names)) == names


def test_surfaces_materials_and_other_laws_have_no_line():
    assert shown_dimensions((*NAMED, "geometry/rim_face")) == ["outer_radius", "plate_gap"]


def test_dimension_lines_have_numbers_and_the_length_of_the_dimension():
    figure = carrier_figure(["outer_radius", "plate_gap", "pin_hole_diameter"])
    (axes,) = figure.axes
    texts = axes.findobj(matplotlib.text.Annotation)
    drawn = CarrierParameters()
    lengths = [
        ((one.xy[0] - one.xyann[0]) ** 2 + (one.xy[1] - one.xyann[1]) ** 2) ** 0.5 for one in texts
    ]
    expected = [drawn.outer_radius, drawn.plate_gap, drawn.pin_hole_diameter]
    assert lengths == pytest.approx(expected, abs=1e-3)
    numbers = [one.get_text() for one in axes.texts if one.get_text()]
    assert numbers == ["1", "2", "3"]


@pytest.mark.long
def test_the_report_shows_named_and_tied_dimensions_with_their_values():
    diagnosis, campaign = diagnosed("carrier")
    values = {
        name: {"change": NamedValue(0.012, 0.001, "m", (0.010, 0.014))} for name in NAMED[::2]
    }
    which = replace(
        diagnosis.attribution,
        effects=NAMED[:1],
        aliases=((NAMED[0], NAMED[2]),),
        parameters={NAMED[0]: values[NAMED[0]]},
        alternatives={NAMED[2]: values[NAMED[2]]},
    )
    tied = replace(diagnosis, verdict=ALIASED, attribution=which)
    page = page_of(tied, campaign)
    assert "On the drawing, not to scale: 1 outer radius" in page
    assert "; 2 plate gap" in page
    assert "On the drawing" not in page_of(diagnosis, campaign)
