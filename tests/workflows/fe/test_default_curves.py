"""The shipped curves are what the finite elements give."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.fe.curve_files import PIN_FIT, causes_of, read_derivatives
from carrierflex.fe.deflection_curves import resampled
from carrierflex.workflows.fe.compute_curves import main
from carrierflex.workflows.fe.default_curves import default_curves, with_derivatives


@pytest.mark.acceptance
def test_shipped_curves_are_those_of_the_default_carrier(tmp_path):
    fresh = main(out=tmp_path, derivatives=True, quiet=True)
    fresh |= read_derivatives(tmp_path / "deflection_curves.csv")
    for name, shipped in with_derivatives(default_curves()).items():
        # Derivatives are shipped at every third angle; a node of the rim has orders beyond those,
        # so that only values at equal angles can be compared.
        every = fresh[name].axial.size // shipped.axial.size
        for computed, expected in (
            (fresh[name].axial[::every], shipped.axial),
            (fresh[name].radial[::every], shipped.radial),
        ):
            # Another release of the mesher may move nodes: that changes a curve by less than a
            # mesh size does.
            np.testing.assert_allclose(computed, expected, atol=0.01 * np.abs(expected).max())


def test_shipped_curves_have_six_and_three_peaks():
    curves = default_curves()
    assert len(curves["delta_s"].peak_angles()) == 6
    assert len(curves["delta_f"].peak_angles()) == 3


def test_shipped_derivatives_belong_to_the_shipped_curves():
    """A modulus divides its curve: ``E d delta_f/dE = -delta_f``."""
    curves = with_derivatives(default_curves())
    assert {PIN_FIT, "delta_f/outer_radius"} < set(curves)
    assert "plate_gap" in causes_of(curves)
    of_modulus = 176e9 * resampled(curves["delta_f/E"], 360).axial
    scale = np.abs(curves["delta_f"].axial).max()
    np.testing.assert_allclose(of_modulus, -curves["delta_f"].axial, atol=2e-3 * scale)


def test_derivatives_of_another_carrier_are_not_assumed():
    curves = default_curves()
    softer = {name: replace(one, axial=1.3 * one.axial) for name, one in curves.items()}
    with pytest.raises(ValueError, match=r"1\.30 times that of the default carrier"):
        with_derivatives(softer)
