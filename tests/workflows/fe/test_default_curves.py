"""The shipped curves are what the finite elements give."""

import numpy as np
import pytest

from carrierflex.workflows.fe.compute_curves import main
from carrierflex.workflows.fe.default_curves import default_curves


@pytest.mark.acceptance
def test_shipped_curves_are_those_of_the_default_carrier(tmp_path):
    fresh = main(out=tmp_path, quiet=True)
    for name, shipped in default_curves().items():
        scale = np.abs(shipped.axial).max()
        # Another release of the mesher may move nodes: that changes a curve by less than a mesh
        # size does.
        np.testing.assert_allclose(fresh[name].axial, shipped.axial, atol=0.01 * scale)
        np.testing.assert_allclose(
            fresh[name].radial, shipped.radial, atol=0.01 * np.abs(shipped.radial).max()
        )


def test_shipped_curves_have_six_and_three_peaks():
    curves = default_curves()
    assert len(curves["delta_s"].peak_angles()) == 6
    assert len(curves["delta_f"].peak_angles()) == 3
