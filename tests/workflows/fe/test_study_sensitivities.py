"""The command on a coarse mesh: its files agree with one another and with known physics."""

import csv

import h5py
import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.geometry.carrier_mesh import flexible_carrier_mesh, stiff_carrier_mesh
from carrierflex.geometry.mesh_files import write_mesh
from carrierflex.geometry.shape_velocity import dimensions_of
from carrierflex.workflows.fe import study_sensitivities
from carrierflex.workflows.screen.tables import sensitivity_table
from tests.workflows.checked_documents import checked_document

pytestmark = pytest.mark.long

COARSE = 0.1


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("sensitivities")


@pytest.fixture(scope="module")
def study(folder):
    return study_sensitivities.main(out=folder, size=COARSE, modes=4, quiet=True)


def row_of(study, body, cause, quantity):
    (row,) = (
        row for row in study.rows if (row.body, row.cause, row.quantity) == (body, cause, quantity)
    )
    return row


def test_every_dimension_material_and_spring_is_there(study):
    flexible, stiff, joined = study.bodies
    assert {cause.name for cause in flexible.causes} == {
        *dimensions_of(pins=False), "carrier.E", "carrier.nu", "carrier.rho",
    }  # fmt: skip
    assert {cause.name for cause in stiff.causes} == {
        *dimensions_of(pins=True), "carrier.E", "carrier.nu", "carrier.rho",
        "pins.E", "pins.nu", "pins.rho",
    }  # fmt: skip
    assert [cause.name for cause in joined.causes] == ["pin_fit", "seat.upwind", "seat.downwind"]


def test_a_stiffer_material_takes_its_share_off_every_order(study):
    row = row_of(study, "flexible_carrier", "carrier.E", "delta_f order 3")
    assert_allclose(row.derivative, -row.nominal / row.value, rtol=1e-9)
    # Order 3 is all but all of the curve: its RMS is the amplitude over the root of two.
    assert -np.sqrt(2.0) <= row.change_percent < -1.0
    # Curves scale with the size of the mesh too little to turn a sign.
    assert row_of(study, "flexible_carrier", "carrier.upwind_plate_thickness",
                  "delta_f order 3").derivative < 0.0  # fmt: skip
    assert row_of(study, "carrier_with_pins", "pin_fit", "delta_joined order 3").derivative < 0.0


def test_files_hold_what_the_study_does(study, folder):
    with (folder / "sensitivities.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(study.rows)
    assert_allclose(
        [float(row["derivative"]) for row in rows],
        [row.derivative for row in study.rows],
        rtol=1e-8,
    )
    document = checked_document(folder / "sensitivities.json")
    assert len(document["sensitivities"]) == len(rows)
    assert (folder / "sensitivities.png").stat().st_size > 10_000
    with h5py.File(folder / "sensitivities.h5") as file:
        assert file.attrs["format"] == "carrierflex-sensitivities"
        for body in study.bodies:
            group = file[body.name]
            assert group["causes/name"].asstr()[:].tolist() == [c.name for c in body.causes]
            assert_allclose(group["dK"][:], body.dK)
            assert_allclose(group["dM"][:], body.dM)
            n = len(group["labels"])
            assert group["dK"].shape == (len(body.causes), n, n)
            for name, curve in body.curves.items():
                assert_allclose(group[f"{name}/d_axial"][:], curve.axial)
    sensitivity_table(study)


def test_an_amplitude_grows_as_the_curve_does(study):
    """The derivative of a magnitude is the change of the magnitude of a slightly changed curve."""
    curve = study.bodies[0].curves["g_f"]
    step = 1e-9
    for number in (0, 4):
        changed = DeflectionCurve(
            "g_f", 0.4, 1.0, curve.nominal.axial + step * curve.axial[number], curve.nominal.radial
        )
        for order in (1, 2):
            before, after = (abs(c.axial_order(order)) for c in (curve.nominal, changed))
            assert_allclose(
                curve.amplitude_derivative(order)[number], (after - before) / step, rtol=1e-5
            )


@pytest.mark.parametrize("stiffness", [0.0, np.inf])
def test_springs_without_a_derivative_are_refused_before_the_work(tmp_path, stiffness):
    with pytest.raises(ValueError, match=r"--pin-fit is .*; expected a positive, finite stiffness"):
        study_sensitivities.main(out=tmp_path / "out", pin_fit=stiffness, quiet=True)
    assert not (tmp_path / "out").exists()


def test_meshes_of_somebody_have_surfaces_for_dimensions(tmp_path, carrier, pin):
    for name, mesh in (
        ("flexible", flexible_carrier_mesh(carrier, COARSE)),
        ("stiff", stiff_carrier_mesh(carrier, pin, COARSE)),
    ):
        write_mesh(mesh, tmp_path / f"{name}.msh")
    study = study_sensitivities.main(
        out=tmp_path / "out",
        modes=4,
        flexible_mesh=tmp_path / "flexible.msh",
        stiff_mesh=tmp_path / "stiff.msh",
        quiet=True,
    )
    names = [cause.name for cause in study.bodies[0].causes]
    assert {"surface.shaft_face", "surface.pins_upwind", "surface.rim_face"} < set(names)
    assert len(study.bodies) == 2
    checked_document(tmp_path / "out" / "sensitivities.json")
