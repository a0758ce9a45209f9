"""Nastran exports read back by pyyeti.

The superelement passes its checks, DMIG costs what its header says.
"""

import io
import re
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from pyyeti import cb, nastran
from pyyeti.nastran import bulk, op4

from carrierflex.reduction.assembly import Joint, assembled
from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.reduction.exports.dmig_files import (
    coordinate_index,
    grounding_of,
    write_dmig,
    written_matrix,
)
from carrierflex.reduction.exports.op4_files import write_op4
from carrierflex.reduction.exports.ordered_body import ordered_body
from carrierflex.reduction.rigid_body_checks import geometric_rigid_modes
from tests.reduction.exports.shuffled import shuffled
from tests.reduction.small_bar import bar


@pytest.fixture(scope="module", params=["pin", "flexible"])
def model(request):
    return request.getfixturevalue(f"{request.param}_reduction").model


def read_op4(path):
    return {name: matrix for name, (matrix, *_) in op4.OP4().load(str(path)).items()}


def checked(path, stiffness=0.0):
    """Report of cbcheck on a superelement read back, the first stiffness changed by a number."""
    matrices = read_op4(path)
    matrices["kaa"][0, 0] += stiffness
    uset, _ = nastran.bulk2uset(str(path.with_suffix(".asm")))
    b = np.arange(len(uset))
    report = io.StringIO()
    result = cb.cbcheck(
        report, matrices["maa"], matrices["kaa"], b, b[:6], uset=uset, n_freefree_modes=8
    )
    return result, report.getvalue()


def test_op4_comes_back_in_double_precision(tmp_path, model):
    write_op4(model, tmp_path / "body.op4")
    result = read_op4(tmp_path / "body.op4")
    body = ordered_body(model)
    for name, matrix in (("kaa", body.K), ("maa", body.M), ("baa", body.D)):
        assert (result[name] == result[name].T).all()
        assert_allclose(result[name], matrix, rtol=0.0, atol=1e-15 * np.abs(matrix).max())


def test_op4_passes_cbcheck(tmp_path, model):
    write_op4(model, tmp_path / "body.op4")
    result, report = checked(tmp_path / "body.op4")
    for words in (
        "Mass matrix is symmetric",
        "Mass matrix is positive-definite",
        "Stiffness matrix is symmetric",
    ):
        assert words in report
    assert report.count("Okay") == 5
    assert "Check: PASS" in report
    assert not re.search("warning|fail|bad", report, re.IGNORECASE)
    assert float(re.search(r"coordinate location error: *(\S+)", report)[1]) < 2e-8
    omega = np.sqrt(model.K.diagonal()[6 * len(model.pilots) :])
    assert_allclose(result.cb_frq, omega / (2.0 * np.pi), rtol=1e-8)
    assert_allclose(result.rbg, geometric_rigid_modes(model)[: 6 * len(model.pilots)], atol=2e-8)
    assert_allclose(result.rbe, result.rbs, atol=1e-6 * np.abs(result.rbs).max())


def test_cbcheck_notices_a_pilot_tied_to_ground(tmp_path, pin_reduction):
    write_op4(pin_reduction.model, tmp_path / "body.op4")
    _, report = checked(tmp_path / "body.op4", stiffness=1e6)
    assert "Check: PASS" not in report


def test_the_superelement_says_what_it_holds(tmp_path, pin_reduction):
    files = write_op4(pin_reduction.model, tmp_path / "body.op4")
    assert [file.suffix for file in files] == [".op4", ".asm", ".pch", ".txt"]
    assert {file.name for file in tmp_path.iterdir()} == {file.name for file in files}
    for file in files[1:]:
        text = file.read_text()
        for words in (
            "SI units: m, kg, s, N, rad",
            "body frame: x downwind",
            "Grid 2: pilot pin_1_midspan",
            "Spoint 1001:",
        ):
            assert words in text
        assert file.suffix == ".txt" or max(len(line) for line in text.splitlines()) <= 80
        assert str(tmp_path).upper() not in text.upper()
        assert "/TMP" not in text.upper()
    assert (
        "SEBULK       100  EXTOP4          MANUAL                     100" in files[1].read_text()
    )


@pytest.mark.parametrize("suffix", ["op4", "asm", "pch", "txt"])
def test_a_superelement_that_fails_leaves_nothing(tmp_path, pin_reduction, suffix):
    (tmp_path / f"body.{suffix}").mkdir()
    with pytest.raises(OSError, match=rf"body\.{suffix}: is a folder; expected the name of a file"):
        write_op4(pin_reduction.model, tmp_path / "body.op4")
    assert [file.name for file in tmp_path.iterdir()] == [f"body.{suffix}"]


def test_dmig_comes_back_to_ten_digits_with_its_grounding(tmp_path, model):
    figure = write_dmig(model, tmp_path / "body.dmig")
    text = (tmp_path / "body.dmig").read_text()
    body = ordered_body(model)
    index = coordinate_index(body)
    for name, matrix in (("KAAX", body.K), ("MAAX", body.M), ("BAAX", body.D)):
        result = written_matrix(text, name, index)
        assert_allclose(result, matrix, rtol=1e-9, atol=1e-30)
    R = geometric_rigid_modes(model)
    assert figure == pytest.approx(grounding_of(written_matrix(text, "KAAX", index), R))
    assert grounding_of(model.K, R) < 0.1 * figure < 1e-9
    assert f"as written: {figure:.2e}\n$ Grounding before writing: " in text
    assert max(len(line) for line in text.splitlines()) <= 80


def test_dmig_refers_to_the_pilots_points(tmp_path, model):
    write_dmig(model, tmp_path / "body.dmig")
    text = (tmp_path / "body.dmig").read_text()
    grids = bulk.rdgrids(io.StringIO(text))
    assert_allclose(grids[:, 3 - 1 : 5], np.array(list(model.pilots.values())), atol=1e-9)
    assert "SPOINT" in text
    assert "SI units: m, kg, s, N, rad" in text
    assert text.startswith("$ Reduced body")


def test_pilots_come_first_whatever_the_order_of_the_body(tmp_path, pin_reduction):
    write_op4(pin_reduction.model, tmp_path / "body.op4")
    write_op4(shuffled(pin_reduction.model), tmp_path / "shuffled.op4")
    first, second = read_op4(tmp_path / "body.op4"), read_op4(tmp_path / "shuffled.op4")
    for name in ("kaa", "maa", "baa"):
        assert (first[name] == second[name]).all()


def test_a_body_without_modes_is_written_too(tmp_path):
    model = craig_bampton(bar(), 0).model
    write_op4(model, tmp_path / "bar.op4")
    assert_allclose(read_op4(tmp_path / "bar.op4")["kaa"], model.K, rtol=1e-12, atol=1e-6)
    assert write_dmig(model, tmp_path / "bar.dmig") < 1e-8


def test_an_assembly_and_another_suffix_are_refused(tmp_path):
    first, second = (
        craig_bampton(bar(), 0).model,
        craig_bampton(bar(name="next", offset=0.3), 0).model,
    )
    both = assembled("both", [first, second], [Joint("bar_end", "next_start", 1e6, 1e6)])
    with pytest.raises(ValueError, match="both: pilots share coordinates; expected a single body"):
        write_op4(both, tmp_path / "both.op4")
    with pytest.raises(ValueError, match=r"body\.dat: suffix '\.dat'; expected \.op4"):
        write_op4(first, tmp_path / "body.dat")


def test_a_damping_that_is_zero_is_no_empty_matrix(tmp_path, model):
    undamped = replace(model, D=np.zeros_like(model.D))
    write_dmig(undamped, tmp_path / "body.pch")
    text = (tmp_path / "body.pch").read_text()
    assert set(bulk.rddmig(io.StringIO(text))) == {"kaax", "maax"}
    assert "BAAX" not in text
    assert "Case control: K2GG = KAAX, M2GG = MAAX\n" in text
    write_dmig(model, tmp_path / "damped.pch")
    damped = (tmp_path / "damped.pch").read_text()
    assert ("B2GG = BAAX" in damped) == ("baax" in bulk.rddmig(io.StringIO(damped)))
