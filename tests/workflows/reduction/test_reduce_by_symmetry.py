"""carrierflex reduce --by-symmetry.

The body file of the whole carrier, computed from a sixth of it.
"""

import pytest
from numpy.testing import assert_allclose

from carrierflex.reduction.body_files import read_body, read_certificate
from carrierflex.workflows.reduction.reduce_body import main

#: Coarse: what is compared is one path with the other on the same mesh.
SIZE = 0.08


@pytest.mark.long
def test_the_body_file_holds_what_the_whole_carrier_gives(tmp_path):
    arguments = {"body": "carrier", "modes": 3, "size": SIZE, "cache": False, "quiet": True}
    main(out=tmp_path / "sixth.h5", by_symmetry=True, **arguments)
    main(out=tmp_path / "whole.h5", **arguments)
    sixth, full = read_body(tmp_path / "sixth.h5"), read_body(tmp_path / "whole.h5")
    assert sixth.labels == full.labels
    # Entries that symmetry makes zero hold rounding alone.
    assert_allclose(sixth.K, full.K, rtol=1e-8, atol=1e-9 * full.K.max())
    certificate = read_certificate(tmp_path / "sixth.h5")
    assert certificate.met
    assert len(certificate.checks) < len(read_certificate(tmp_path / "whole.h5").checks)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"body": "pin"}, "--by-symmetry is for the parametric carrier; expected --body carrier"),
        (
            {"body": "carrier", "coupling": "rbe2"},
            "works on the half sector, --coupling rbe2 needs the whole body",
        ),
        (
            {"body": "carrier", "assembly": "scikit-fem"},
            "works on the half sector, --assembly scikit-fem needs the whole body",
        ),
        (
            {"body": "carrier", "frf_tolerance": 0.1, "up_to": 900.0},
            "--frf-tolerance 0.1 needs the whole body; leave one of them out",
        ),
    ],
)
def test_what_needs_the_whole_body_is_refused(tmp_path, options, message):
    with pytest.raises(ValueError, match=message):
        main(out=tmp_path / "body.h5", by_symmetry=True, size=SIZE, quiet=True, **options)
    assert not (tmp_path / "body.h5").exists()
