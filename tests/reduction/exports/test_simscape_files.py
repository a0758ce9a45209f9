"""Simscape data come back from MATLAB's format as they went in."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.io
import scipy.linalg

from carrierflex.reduction.exports.simscape_files import write_simscape
from tests.reduction.exports.shuffled import shuffled


def read_mat(path):
    return scipy.io.loadmat(str(path), simplify_cells=True)["body"]


@pytest.mark.parametrize("body", ["pin", "flexible"])
def test_a_body_comes_back_with_its_words(tmp_path, request, body):
    model = request.getfixturevalue(f"{body}_reduction").model
    write_simscape(model, tmp_path / "body.mat")
    result = read_mat(tmp_path / "body.mat")
    assert (result["P"] == np.array(list(model.pilots.values()))).all()
    for name, matrix in (("K", model.K), ("M", model.M), ("C", model.D)):
        assert (result[name] == result[name].T).all()
        assert (result[name] == (matrix + matrix.T) / 2.0).all()
    assert list(result["pilots"]) == list(model.pilots)
    assert tuple(result["coordinates"]) == model.labels
    assert result["units"] == "SI units: m, kg, s, N, rad"
    assert result["frame"].startswith("body frame: x downwind")


def test_six_rigid_motions_remain(tmp_path, pin_reduction):
    write_simscape(pin_reduction.model, tmp_path / "body.mat")
    result = read_mat(tmp_path / "body.mat")
    squares = scipy.linalg.eigh(result["K"], result["M"], eigvals_only=True)
    assert np.abs(squares[:6]).max() < 1e-6 * squares[6]


def test_matrices_are_symmetrised_and_pilots_come_first(tmp_path, pin_reduction):
    model = pin_reduction.model
    K = model.K.copy()
    K[0, 1] += 2.0
    write_simscape(shuffled(replace(model, K=K)), tmp_path / "body.mat")
    result = read_mat(tmp_path / "body.mat")["K"]
    assert (result == (K + K.T) / 2.0).all()


def test_another_suffix_is_refused(tmp_path, pin_reduction):
    with pytest.raises(ValueError, match=r"body\.m: suffix '\.m'; expected \.mat"):
        write_simscape(pin_reduction.model, tmp_path / "body.m")
