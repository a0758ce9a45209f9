"""The main shaft on the command's way: reduced, certified, exported, its inputs recorded."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.reduction.body_files import read_body
from carrierflex.workflows.reduction import check_certificate, export_body, reduce_body
from carrierflex.workflows.reduction.recorded_structure import recorded_structure

COARSE = 0.12


@pytest.fixture(scope="module")
def body(tmp_path_factory):
    path = tmp_path_factory.mktemp("shaft") / "shaft.h5"
    parameters = path.with_suffix(".toml")
    parameters.write_text("[main_shaft]\nouter_diameter = 0.35\n", encoding="utf-8")
    reduce_body.main(
        body="main_shaft", out=path, modes=12, size=COARSE, parameters=parameters, quiet=True
    )
    return path


def test_the_reduced_shaft_meets_its_certificate(body):
    assert check_certificate.main(body).met


def test_the_body_file_records_the_shaft_it_was_made_from(body):
    model = read_body(body)
    _, structure, n_modes = recorded_structure(model)
    assert n_modes == 12
    assert np.hypot(structure.points[:, 1], structure.points[:, 2]).max() == pytest.approx(
        0.175, rel=1e-9
    )
    older = model.provenance["parameters"].replace('"main_shaft"', '"other"')
    _, structure, _ = recorded_structure(
        replace(model, provenance={**model.provenance, "parameters": older})
    )
    assert np.hypot(structure.points[:, 1], structure.points[:, 2]).max() == pytest.approx(
        0.1705, rel=1e-9
    )


@pytest.mark.long
@pytest.mark.parametrize(
    ("format", "suffix"),
    [("op4", ".op4"), ("dmig", ".bdf"), ("mbdyn", ".fem"), ("exudyn", ".hdf5")],
)
def test_the_shaft_is_exported(body, tmp_path, format, suffix):
    exported = export_body.main(body, format=format, out=tmp_path / f"shaft{suffix}", quiet=True)
    assert all(file.stat().st_size > 0 for file in exported.files)
    if format == "exudyn":
        assert max(exported.figures.values()) < 1e-9


def test_the_shaft_can_be_held_rigidly_too(tmp_path):
    path = tmp_path / "rigid.h5"
    model = reduce_body.main(
        body="main_shaft", out=path, coupling="rbe2", modes=4, size=COARSE, quiet=True
    )
    assert list(model.pilots) == ["coupling_flange", "main_bearing_seat", "carrier_joint"]
    assert check_certificate.main(path).checks[0].met
