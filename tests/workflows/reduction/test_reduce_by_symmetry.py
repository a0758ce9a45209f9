"""carrierflex reduce: the body file of the whole carrier, computed from a sixth of it."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.reduction.body_files import (
    read_body,
    read_certificate,
    read_shapes,
    read_stresses,
)
from carrierflex.workflows.reduction.half_sector_bodies import serves_half_sector
from carrierflex.workflows.reduction.reduce_body import main

#: Coarse: what is compared is one path with the other on the same mesh.
SIZE = 0.08
_DEFAULTS = {
    "body": "carrier",
    "symmetry": True,
    "residual_vectors": False,
    "coupling": "rbe3",
    "interface": "fixed",
    "assembly": "compiled",
}


@pytest.mark.long
@pytest.mark.parametrize("more", [{"modes": 9}, {"frf_tolerance": 0.1, "up_to": 600.0}])
def test_the_body_file_holds_what_the_whole_carrier_gives(more, tmp_path):
    arguments = {"body": "carrier", "size": SIZE, "cache": False, "quiet": True}
    arguments |= {"shapes": True, "stresses": True}
    main(out=tmp_path / "sixth.h5", **arguments, **more)
    main(out=tmp_path / "whole.h5", symmetry=False, **arguments, **more)
    sixth, full = read_body(tmp_path / "sixth.h5"), read_body(tmp_path / "whole.h5")
    assert "by_symmetry" in sixth.provenance
    assert "by_symmetry" not in full.provenance
    assert sixth.labels == full.labels
    # Entries that symmetry makes zero hold rounding alone.
    assert_allclose(sixth.K, full.K, rtol=1e-8, atol=1e-9 * full.K.max())
    shapes, expected = (read_shapes(tmp_path / name) for name in ("sixth.h5", "whole.h5"))
    m = 6 * len(full.pilots)
    # Files keep them in single precision.
    assert_allclose(shapes.T[:, :, :m], expected.T[:, :, :m], rtol=0.0, atol=1e-6)
    stresses, expected = (read_stresses(tmp_path / name).S for name in ("sixth.h5", "whole.h5"))
    size = np.abs(expected[:, :, :m]).max(axis=(0, 1))
    assert_allclose(stresses[:, :, :m] / size, expected[:, :, :m] / size, rtol=0.0, atol=1e-6)
    certificate, of_whole = (read_certificate(tmp_path / name) for name in ("sixth.h5", "whole.h5"))
    assert certificate.met
    for check, other in zip(certificate.checks, of_whole.checks, strict=True):
        assert (check.name, check.wanted, check.met) == (other.name, other.wanted, other.met)
        # Those of rounding have no figure in common.
        if other.reached > 1e-6:
            assert_allclose(check.reached, other.reached, rtol=1e-5, err_msg=check.name)


@pytest.mark.parametrize(
    ("change", "files_given"),
    [
        ({"body": "pin"}, False),
        ({"coupling": "rbe2"}, False),
        ({"interface": "free"}, False),
        ({"assembly": "scikit-fem"}, False),
        ({"residual_vectors": True}, False),
        ({"symmetry": False}, False),
        ({}, True),
    ],
)
def test_what_needs_the_whole_body_is_reduced_from_it(change, files_given):
    assert serves_half_sector(_DEFAULTS, files_given=False)
    assert not serves_half_sector(_DEFAULTS | change, files_given=files_given)
