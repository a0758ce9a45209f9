"""Files to start from: every dimension with its limits, and copies of the shipped cases."""

import tomllib
from dataclasses import replace

import pytest
from numpy.testing import assert_allclose

from carrierflex.geometry.parameter_files import StageParameters, read_parameters
from carrierflex.geometry.parameter_sources import limits, sources
from carrierflex.geometry.parameters import CarrierParameters, GearData, PinParameters
from carrierflex.workflows.geometry.write_parameters import _dimensioned_drawing
from carrierflex.workflows.geometry.write_parameters import main as write_parameters
from carrierflex.workflows.simulation.copy_cases import main as copy_cases


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    return write_parameters(out=tmp_path_factory.mktemp("p") / "carrier.toml")


def test_the_file_of_dimensions_is_that_of_the_defaults(written):
    assert read_parameters(written.path) == StageParameters()
    document = tomllib.loads(written.path.read_text(encoding="utf-8"))
    n_keys = sum(len(table) for table in document.values())
    assert n_keys == written.n_keys >= 26
    assert written.drawing.stat().st_size > 10_000


def test_a_file_that_stands_is_not_replaced(written):
    with pytest.raises(ValueError, match="exists already"):
        write_parameters(out=written.path)


@pytest.mark.parametrize("parameters", [CarrierParameters, PinParameters, GearData])
def test_every_default_has_a_source(parameters):
    names = set(parameters.__dataclass_fields__)
    assert set(sources(parameters)) == names
    assert all(sources(parameters).values())


def test_a_limit_is_where_the_stage_no_longer_fits_together():
    stage = StageParameters()
    ends = limits(stage, "carrier")
    # No length along the axis exceeds the diameter.
    assert_allclose(ends["upwind_plate_thickness"], (0.0, 2.0 * stage.carrier.outer_radius))
    low, high = ends["outer_radius"]
    # The rim ends at the sensors' circle; no carrier is larger than 5 m.
    assert_allclose([low, high], [stage.carrier.sensor_radius, 5.0], rtol=1e-6)
    replace(stage, carrier=replace(stage.carrier, outer_radius=low * 1.0001))
    with pytest.raises(ValueError, match="outer_radius"):
        replace(stage, carrier=replace(stage.carrier, outer_radius=low * 0.9999))
    # Bore and pin are one fit.
    low, high = ends["pin_hole_diameter"]
    assert_allclose([low, high], stage.carrier.pin_hole_diameter, rtol=1e-6)


def test_every_dimension_of_the_carrier_is_named_in_the_drawing():
    figure = _dimensioned_drawing(CarrierParameters())
    texts = " ".join(text.get_text() for axes in figure.axes for text in axes.texts)
    assert [name for name in CarrierParameters.__dataclass_fields__ if name not in texts] == []


def test_cases_are_listed_and_copied_whole(tmp_path):
    assert "carrier_lc1_to_lc4" in copy_cases().titles
    assert all(copy_cases().titles.values())
    copied = copy_cases("mounting_2011", out=tmp_path)
    text = (tmp_path / "mounting_2011.toml").read_text(encoding="utf-8")
    assert tomllib.loads(text)["kind"] == "mounting"
    assert text.startswith("#:schema file://")
    assert list(copied.titles) == ["mounting_2011"]
    with pytest.raises(ValueError, match="exists already"):
        copy_cases("mounting_2011", out=tmp_path)
    with pytest.raises(ValueError, match="no_such_case"):
        copy_cases("no_such_case")
