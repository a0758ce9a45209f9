"""The curve that follows a dimension at once: what finite elements say of a small change."""

import numpy as np
import pytest

from carrierflex.geometry.parameter_files import read_parameters
from carrierflex.workflows.app.live_curves import (
    changed_stage,
    deflection,
    dimensions,
    parameter_text,
)
from carrierflex.workflows.fe.carrier_variants import solved_carrier
from carrierflex.workflows.fe.default_curves import default_curves

#: The mesh stands a tenth off its limit, and a change of the mesh beside that of the dimension.
MOST_OFF = 0.15


def test_without_a_change_it_is_the_default_curve():
    angle, axial = deflection({})
    assert (axial == default_curves()["delta_f"].axial).all()
    assert (angle == default_curves()["delta_f"].angle).all()


@pytest.mark.long
@pytest.mark.parametrize("name", ["upwind_plate_thickness", "web_inner_radius"])
def test_a_small_change_is_that_of_finite_elements(name):
    default = dimensions()[name][0]
    ends = [flexible(changed_stage({name: factor * default})) for factor in (0.98, 1.02)]
    low, high = (deflection({name: factor * default})[1] for factor in (0.98, 1.02))
    off = np.linalg.norm((high - low) - (ends[1] - ends[0])) / np.linalg.norm(ends[1] - ends[0])
    assert off < MOST_OFF


def flexible(stage):
    solved = solved_carrier("flexible", stage, 0.04).deflection.curves["both"]
    return solved.axial_at(deflection({})[0])


def test_the_written_file_holds_the_changed_carrier_and_what_follows_it(tmp_path):
    path = tmp_path / "carrier.toml"
    for name, (value, low, high) in dimensions().items():
        assert low < value < high
        for end in (low, high):
            changes = {name: round(value + 0.98 * (end - value), 6)}
            path.write_text(parameter_text(changes), encoding="utf-8")
            assert read_parameters(path) == changed_stage(changes)
            assert getattr(changed_stage(changes).carrier, name) == changes[name]


def test_dimensions_that_contradict_are_refused():
    with pytest.raises(ValueError, match="hub_inner_diameter"):
        changed_stage({"hub_inner_diameter": 0.47})
