"""From the command's functions to a body file that can be trusted, and one that cannot."""

import json

import h5py
import numpy as np
import pytest

from carrierflex.reduction.body_files import read_body, read_certificate
from carrierflex.workflows.fe import compare_couplings
from carrierflex.workflows.reduction import check_certificate, reduce_body

COARSE = 0.06


@pytest.fixture(scope="module")
def body(tmp_path_factory):
    path = tmp_path_factory.mktemp("bodies") / "carrier.h5"
    reduce_body.main(body="carrier", out=path, modes=12, size=COARSE, quiet=True)
    return path


def test_a_reduced_carrier_carries_a_certificate_that_is_met(body, tmp_path):
    certificate = check_certificate.main(body, json=tmp_path / "certificate.json")
    assert certificate.met
    assert certificate.cut_off_hz > 100.0
    assert '"met": true' in (tmp_path / "certificate.json").read_text(encoding="utf-8")


def test_damaged_matrices_are_found_when_the_certificate_is_shown(body, tmp_path):
    damaged = tmp_path / "damaged.h5"
    damaged.write_bytes(body.read_bytes())
    with h5py.File(damaged, "r+") as file:
        file["M"][...] = 1.01 * file["M"][...]
    assert read_certificate(damaged).met
    certificate = check_certificate.main(damaged)
    assert not certificate.met
    assert "mass" in next(check.name for check in certificate.checks if not check.met)


def test_a_body_without_certificate_is_refused(body, tmp_path):
    bare = tmp_path / "bare.h5"
    bare.write_bytes(body.read_bytes())
    with h5py.File(bare, "r+") as file:
        del file["certificate"]
    with pytest.raises(ValueError, match="written without a certificate"):
        check_certificate.main(bare)


def test_cut_off_frequency_keeps_the_modes_below_it(tmp_path):
    path = tmp_path / "pin.h5"
    reduce_body.main(body="pin", out=path, max_frequency=12_000.0, size=COARSE, quiet=True)
    frequencies = [
        float(label.split("(")[1].split(" ")[0])
        for label in read_body(path).labels
        if "mode" in label
    ]
    assert frequencies
    assert max(frequencies) < 12_000.0
    with pytest.raises(ValueError, match="expected one of them"):
        reduce_body.main(body="pin", out=path, modes=3, max_frequency=1.0, quiet=True)


def test_rigid_couplings_bound_the_stiffness_from_above(tmp_path):
    # Five solutions a carrier: coarser than the others.
    brackets = compare_couplings.main(out=tmp_path, size=0.1, quiet=True)
    for bracket in brackets.values():
        soft, rigid = bracket.stiffness
        assert np.all(rigid > soft)
    # Without pins the bores' own deformation makes half of the rim's three waves: a rigid bore
    # takes it away.
    distributing, stiff = (curve.axial_order_content()[3] for curve in brackets["flexible"].curves)
    assert stiff < 0.7 * distributing
    assert [bracket.curve_name for bracket in brackets.values()] == ["delta_f", "delta_s"]
    # The bores alone make more of the change than the seats or the face, and none of them all of
    # it.
    changes = [
        brackets["flexible"].curve_change(part)
        for part in ("shaft face", "bearing seats", "pins", "everything")
    ]
    assert 0.0 < changes[0] < changes[1] < changes[2] < changes[3] < 1.0
    assert brackets["flexible"].curve_change("nothing") == 0.0
    # With bonded pins the load enters at the pins: what holds the shaft face hardly matters.
    assert (
        brackets["stiff"].curve_change("shaft face") < 0.02 < brackets["stiff"].curve_change("pins")
    )
    written = json.loads((tmp_path / "couplings.json").read_text())
    assert written["curve_change"]["delta_f"]["pins"] == brackets["flexible"].curve_change("pins")
