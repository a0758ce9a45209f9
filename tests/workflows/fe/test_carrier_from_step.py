"""A carrier from a STEP file goes the way of the parametric one: fit of its pins, stage, teeth."""

import json

import pytest
from numpy.testing import assert_allclose

from carrierflex.geometry.parameter_files import read_parameters
from carrierflex.workflows.fe.study_pin_fit import static_family
from carrierflex.workflows.geometry import write_cad
from carrierflex.workflows.geometry.carrier_files import CarrierFiles
from carrierflex.workflows.simulation import compute_torsion

pytestmark = pytest.mark.long

SIZE = 0.08


@pytest.fixture(scope="module")
def carrier_files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("own")
    write_cad.main(out=folder)
    return {"step": folder / "carrier.step", "surfaces": folder / "surfaces.toml"}


def test_the_fit_of_its_pins_is_that_of_the_same_carrier_by_parameters(carrier_files):
    stage = read_parameters(None)
    given, _ = static_family(stage, SIZE, CarrierFiles(**carrier_files))
    parametric, _ = static_family(stage, SIZE)
    for stiffness in (0.0, 1e6, 1e8):
        ours, theirs = (
            family.curve(stiffness).axial_order_content()[[3, 6]] for family in (given, parametric)
        )
        # Both meshes are coarse, each in its own way: 6 % between them at 60 mm.
        assert_allclose(ours, theirs, rtol=0.12)
    masses = [family.pin.mass_properties.mass for family in (given, parametric)]
    assert masses[0] == pytest.approx(masses[1], rel=0.03)


def test_it_turns_under_torque_as_the_same_carrier_by_parameters(carrier_files, tmp_path):
    stiffness = {}
    for name, files in {"given": carrier_files, "parametric": {}}.items():
        compute_torsion.main(out=tmp_path / name, size=SIZE, **files, quiet=True)
        document = json.loads((tmp_path / name / "torsion.json").read_text(encoding="utf-8"))
        assert set(document["inputs"]["files"]) == set(files)
        stiffness[name] = document["stiffness_nm_per_rad"]
    assert stiffness["given"]["gearbox"] == pytest.approx(
        stiffness["parametric"]["gearbox"], rel=0.01
    )
