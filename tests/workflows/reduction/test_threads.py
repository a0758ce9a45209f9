"""One thread or two: the same body, whatever order the sums were taken in."""

import os
import subprocess
import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.reduction.body_files import read_body

pytestmark = pytest.mark.long

BODIES = {
    "whole": {"body": "carrier", "modes": 12, "symmetry": False},
    "half_sector": {"body": "carrier", "modes": 12},
    "pin": {"body": "pin", "modes": 8},
}
SCRIPT = """
import sys
from pathlib import Path
from carrierflex.workflows.reduction import reduce_body
for name, options in eval(sys.argv[2]).items():
    reduce_body.main(
        out=Path(sys.argv[1]) / f"{name}.h5", size=0.1, cache=False, quiet=True, **options
    )
"""


def reduced(folder, n_threads):
    folder.mkdir()
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
    threads = dict.fromkeys(names, str(n_threads)) | {"MKL_DYNAMIC": "FALSE"}
    arguments = [sys.executable, "-P", "-c", SCRIPT, str(folder), repr(BODIES)]
    subprocess.run(arguments, check=True, env=os.environ | threads)
    return {name: read_body(folder / f"{name}.h5") for name in BODIES}


@pytest.fixture(scope="module")
def pairs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("threads")
    one, two = (reduced(folder / str(n), n) for n in (1, 2))
    return {name: (one[name], two[name]) for name in BODIES}


@pytest.mark.parametrize("name", ["whole", "half_sector"])
def test_entries_of_a_sector_meshs_body_agree(pairs, name):
    one, two = pairs[name]
    assert two.labels == one.labels
    for letter in "KMD":
        expected = getattr(one, letter)
        diagonal = np.where(expected.diagonal() > 0.0, expected.diagonal(), 1.0)
        scale = np.sqrt(np.outer(diagonal, diagonal))
        result = getattr(two, letter)
        assert_allclose(result / scale, expected / scale, rtol=0.0, atol=1e-10, err_msg=letter)
    size = np.abs(one.sensor_rows).max()
    assert_allclose(two.sensor_rows / size, one.sensor_rows / size, rtol=0.0, atol=1e-10)


def frequency_response(model, hz):
    m = 6 * len(model.pilots)
    scale = 1.0 / np.sqrt(model.K.diagonal()[:m])
    omega = 2.0 * np.pi * hz
    H = np.linalg.inv(model.K + 1j * omega * model.D - omega**2 * model.M)[:m, :m]
    return H / np.outer(scale, scale)


def test_frequencies_and_responses_of_a_free_mesh_agree(pairs):
    """Bending modes of a pin's free mesh come in pairs split by the mesh.

    Either partner may be another.
    """
    one, two = pairs["pin"]
    m = 6 * len(one.pilots)
    assert_allclose(two.K.diagonal()[m:], one.K.diagonal()[m:], rtol=1e-10)
    for hz in (500.0, 5000.0, 12000.0):
        expected = frequency_response(one, hz)
        assert_allclose(
            frequency_response(two, hz), expected, rtol=0.0, atol=1e-9 * np.abs(expected).max()
        )
