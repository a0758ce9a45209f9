"""``curves --mesh-error``: its file, and what it is refused for."""

from pathlib import Path

import pytest

from carrierflex.workflows.fe import compute_curves
from tests.workflows.checked_documents import checked_document


@pytest.mark.long
def test_the_errors_are_those_of_the_curves_that_are_written(tmp_path):
    curves = compute_curves.main(out=tmp_path, size=0.08, mesh_error=True, cache=False, quiet=True)
    document = checked_document(tmp_path / "mesh_error.json")
    errors = {(one["curve"], one["order"]): one for one in document["errors"]}
    assert {name for name, _ in errors} == set(curves)
    for (name, order), one in errors.items():
        # Small orders are differences of large ones, in files of twelve digits.
        largest = curves[name].axial_order_content().max()
        assert abs(one["amplitude"] - abs(curves[name].axial_order(order))) < 1e-8 * largest
        assert one["error"] > 0.0


def test_files_of_one_size_have_no_limit(tmp_path):
    meshes = {f"{name}_mesh": tmp_path / f"{name}.msh" for name in ("flexible", "stiff")}
    for path in meshes.values():
        Path(path).write_text("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n", encoding="utf-8")
    with pytest.raises(ValueError, match=r"--mesh-error is given with a STEP or mesh file"):
        compute_curves.main(out=tmp_path / "out", mesh_error=True, quiet=True, **meshes)
