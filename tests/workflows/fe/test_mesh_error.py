"""``curves --mesh-error``: its file, and what it is refused for."""

from pathlib import Path

import pytest

from carrierflex.files.json_files import save_json
from carrierflex.workflows.fe import compute_curves
from carrierflex.workflows.fe.default_curves import default_curves, with_mesh_error
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


def test_a_file_beside_curves_gives_the_error_of_their_largest_wave(tmp_path):
    path = tmp_path / "mesh_error.json"
    curves = default_curves()
    # The default curves' own errors are no longer theirs once a file states others.
    assert with_mesh_error(curves, path) == curves
    rows = [("delta_f", 3, 2.0, 0.1), ("delta_f", 6, 1.0, 0.9), ("g_f", 1, 4.0, 0.1)]
    keys = ("curve", "order", "amplitude", "error")
    save_json(path, {"errors": [dict(zip(keys, row, strict=True)) for row in rows]})
    read = with_mesh_error(curves, path)
    assert {name: one.mesh_error for name, one in read.items()} == {
        "delta_f": 0.05, "g_f": 0.025, "delta_s": 0.0, "g_s": 0.0,
    }  # fmt: skip


@pytest.mark.parametrize(
    "errors",
    [7, [{}], [{"curve": "g_f", "amplitude": 0.0, "error": 1.0}], [["g_f"]], "text",
     [{"curve": [], "amplitude": 1.0, "error": 1.0}],
     [{"curve": "g_f", "amplitude": -1.0, "error": 1.0}],
     [{"curve": "g_f", "amplitude": "large", "error": 1.0}]],
)  # fmt: skip
def test_a_damaged_file_is_refused_by_its_name(tmp_path, errors):
    path = tmp_path / "mesh_error.json"
    save_json(path, {"errors": errors})
    with pytest.raises(ValueError, match=r"mesh_error.json: .*curves --mesh-error writes"):
        with_mesh_error(default_curves(), path)
