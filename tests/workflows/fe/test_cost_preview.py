"""The preview tells what the work costs before it begins.

It is right about the number of unknowns.
"""

import pytest
from numpy.testing import assert_allclose

from carrierflex.geometry.mesh_files import write_mesh
from carrierflex.geometry.parameter_files import StageParameters
from carrierflex.workflows.fe import compute_curves, cost_preview
from carrierflex.workflows.fe.cost_preview import curves_cost, estimated_dofs, reduction_cost
from carrierflex.workflows.geometry import write_cad
from carrierflex.workflows.geometry.carrier_files import CarrierFiles
from carrierflex.workflows.reduction import reduce_body

STAGE, NONE = StageParameters(), CarrierFiles()


@pytest.mark.parametrize(
    ("name", "size", "counted"),
    [
        ("flexible_carrier", 0.1, 17235),
        pytest.param("flexible_carrier", 0.03, 125946, marks=pytest.mark.long),
        ("stiff_carrier", 0.06, 41715),
        pytest.param("stiff_carrier", 0.03, 152883, marks=pytest.mark.long),
        ("pin", 0.022, 19239),
        ("main_shaft", 0.03, 138600),
    ],
)
def test_unknowns_at_usual_sizes_are_those_of_the_mesh(name, size, counted):
    assert estimated_dofs(name, STAGE, size, NONE) == counted


@pytest.mark.parametrize(
    ("name", "size", "counted"),
    [
        pytest.param("flexible_carrier", 0.016, 580860, marks=pytest.mark.long),
        ("stiff_carrier", 0.022, 310284),
        ("pin", 0.016, 40455),
    ],
)
def test_a_coarser_mesh_tells_a_finer_ones_unknowns_within_a_tenth(
    name, size, counted, monkeypatch
):
    # Fewer are counted than otherwise: the test is quicker, and all are scaled.
    monkeypatch.setattr(cost_preview, "_MOST_COUNTED", counted // 2)
    estimate = estimated_dofs(name, STAGE, size, NONE)
    assert estimate != counted
    assert_allclose(estimate, counted, rtol=0.1)


def test_counts_behind_the_estimate_are_those_of_the_meshes(stiff_mesh, tmp_path):
    assert 3 * len(stiff_mesh.points) == 41715
    write_mesh(stiff_mesh, tmp_path / "stiff.msh")
    assert (
        estimated_dofs(
            "stiff_carrier", STAGE, 1.0, CarrierFiles(meshes={"stiff": tmp_path / "stiff.msh"})
        )
        == 41715
    )


@pytest.mark.long
def test_a_coarser_mesh_tells_a_cad_models_unknowns_within_a_tenth(tmp_path, monkeypatch):
    """Whatever the elements at its inner edges add, which the formula knows nothing of."""
    write_cad.main(out=tmp_path)
    cad = CarrierFiles(step=tmp_path / "carrier.step", surfaces=tmp_path / "surfaces.toml")
    counted = 3 * len(cad.mesh("flexible", 0.06).points)
    monkeypatch.setattr(cost_preview, "_MOST_COUNTED_CAD", 10_000)
    estimate = estimated_dofs("flexible_carrier", STAGE, 0.06, cad)
    assert estimate != counted
    assert_allclose(estimate, counted, rtol=0.1)


@pytest.mark.long
def test_costs_grow_with_fineness_and_modes_and_meet_the_measured_points(monkeypatch):
    monkeypatch.setattr(cost_preview, "slowness", lambda: 1.0)
    coarse, fine = (
        reduction_cost("flexible_carrier", STAGE, size, n_modes=20, files=NONE)
        for size in (0.03, 0.02)
    )
    assert coarse.n_dofs < fine.n_dofs
    assert coarse.seconds < fine.seconds
    assert coarse.memory_gb < fine.memory_gb
    assert (
        reduction_cost("flexible_carrier", STAGE, 0.03, n_modes=80, files=NONE).seconds
        > 2.0 * coarse.seconds
    )
    by_symmetry = reduction_cost(
        "flexible_carrier", STAGE, 0.03, n_modes=20, files=NONE, by_symmetry=True
    )
    assert by_symmetry.n_dofs == coarse.n_dofs
    assert by_symmetry.seconds < coarse.seconds / 2.0
    assert by_symmetry.memory_gb < coarse.memory_gb / 2.0
    assert "by symmetry" in str(by_symmetry)
    assert curves_cost(STAGE, 0.03, NONE).seconds < coarse.seconds
    for points in (cost_preview._CURVES, cost_preview._REDUCTION, cost_preview._BY_SYMMETRY):
        for n, seconds in zip(points["n"], points["seconds"], strict=True):
            assert_allclose(
                cost_preview._at(points["n"], points["seconds"], int(n)), seconds, rtol=1e-9
            )


def test_a_machine_of_half_the_speed_takes_twice_the_time(monkeypatch):
    seconds = []
    for slowness in (1.0, 2.0):
        monkeypatch.setattr(cost_preview, "slowness", lambda slowness=slowness: slowness)
        seconds.append(reduction_cost("pin", STAGE, 0.022, n_modes=20, files=NONE).seconds)
    assert seconds[1] == pytest.approx(2.0 * seconds[0], rel=1e-12)
    assert 0.05 < cost_preview.slowness() < 100.0


@pytest.mark.long
def test_preview_alone_computes_and_writes_nothing(tmp_path):
    for text in (
        compute_curves.main(out=tmp_path / "curves", preview=True),
        reduce_body.main(body="carrier", out=tmp_path / "body" / "carrier.h5", preview=True),
    ):
        assert "degrees of freedom, " in str(text)
        assert "GB, " in str(text)
    assert not list(tmp_path.iterdir())


def test_it_is_said_on_a_terminal_only(capsys, monkeypatch):
    preview = curves_cost(STAGE, 0.06, NONE)

    def not_made():
        raise AssertionError

    cost_preview.tell(not_made, quiet=False)
    assert capsys.readouterr().err == ""
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    cost_preview.tell(not_made, quiet=True)
    assert capsys.readouterr().err == ""
    cost_preview.tell(lambda: preview, quiet=False)
    assert "deflection curves: about " in capsys.readouterr().err
