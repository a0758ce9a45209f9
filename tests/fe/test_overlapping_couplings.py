"""Pilots on shared nodes.

Independent ones pass and are logged, dependent ones are refused with their names and nodes.
"""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.fe.assembly import assemble_mass, assemble_stiffness
from carrierflex.fe.couplings import distributing_pilot, weighted_pilot
from carrierflex.fe.materials import STEEL
from carrierflex.fe.pilot_overlaps import independence, refuse_dependent_pilots
from carrierflex.fe.rigid_couplings import rigidly_coupled
from carrierflex.fe.structural_model import StructuralModel, structural_model
from carrierflex.geometry.tet_mesh import TetMesh
from tests.fe.box_meshes import box_mesh


def box_with(**surfaces):
    """Unit cube of 2 × 2 × 2 cells with parts of its end face as further surfaces.

    Each part is chosen by a facet's middle.
    """
    mesh = box_mesh((1.0, 1.0, 1.0), (2, 2, 2))
    end = mesh.surface("end")
    middles = mesh.points[end].mean(axis=1)
    subsets = {name: end[chosen(middles)] for name, chosen in surfaces.items()}
    return TetMesh(mesh.points, mesh.tets, {**mesh.surfaces, **subsets}, mesh.bodies)


def pilots_on(mesh, *names):
    return tuple(distributing_pilot(mesh, name, np.array([1.2, 0.5, 0.5])) for name in names)


def test_the_carriers_own_pilots_are_independent(flexible_structure, stiff_structure):
    for structure in (flexible_structure, stiff_structure):
        refuse_dependent_pilots(structure.pilots, structure.points)
        n_coordinates = sum(len(pilot.components) for pilot in structure.pilots)
        rank, smallest = independence(structure.pilots)
        assert rank == n_coordinates
        # Rows of pilots that share nothing are orthonormal.
        assert smallest == pytest.approx(1.0, abs=1e-9)


def test_two_pilots_on_one_surface_are_refused():
    mesh = box_with(same=lambda x: x[:, 0] > 0.0)
    pilots = (
        pilots_on(mesh, "end")[0],
        distributing_pilot(mesh, "same", np.array([0.7, 0.1, 0.2])),
    )
    message = (
        r"pilots 'end', 'same' cannot move independently: their 12 coordinates have rank 6; "
        r"'end' and 'same' share "
        r"\d+ nodes \(\d+ at \(1, .*\) m, .*\.\.\.\); expected surfaces of their own"
    )
    with pytest.raises(ValueError, match=message):
        refuse_dependent_pilots(pilots, mesh.points)


def test_independence_is_one_apart_less_on_shared_nodes_and_zero_on_one_surface():
    mesh = box_with(low=lambda x: x[:, 1] < 0.5, high=lambda x: x[:, 1] > 0.5)
    start, low, high = pilots_on(mesh, "start", "low", "high")
    apart, sharing, same = (independence(pair) for pair in ((start, low), (low, high), (low, low)))
    assert (apart[0], sharing[0], same[0]) == (12, 12, 6)
    assert apart[1] == pytest.approx(1.0, abs=1e-12)
    assert 0.05 < sharing[1] < 0.95
    assert same[1] == pytest.approx(0.0, abs=1e-12)


def test_a_whole_and_its_two_halves_are_refused_though_every_two_of_them_would_do(caplog):
    mesh = box_with(low=lambda x: x[:, 1] < 0.5, high=lambda x: x[:, 1] > 0.5)
    low, high, union = (
        distributing_pilot(mesh, name, np.array([1.0, 0.5, 0.5])) for name in ("low", "high", "end")
    )
    with caplog.at_level("INFO", logger="carrierflex.fe.pilot_overlaps"):
        refuse_dependent_pilots((low, high), mesh.points)
        refuse_dependent_pilots((low, union), mesh.points)
    assert "'low' and 'high' share" in caplog.text
    assert "'low' and 'end' share" in caplog.text
    assert "couplings stay independent" in caplog.text
    with pytest.raises(
        ValueError, match=r"pilots 'low', 'high', 'end' cannot move independently: .* have rank 12"
    ):
        refuse_dependent_pilots((low, high, union), mesh.points)


def test_pilots_that_share_a_component_on_the_same_nodes_need_different_ones():
    mesh = box_with()
    nodes = np.unique(mesh.surface("end"))
    point = np.array([1.0, 0.5, 0.5])

    def pilot(name, components):
        return replace(
            weighted_pilot(mesh, "end", point, np.ones(len(nodes)), components=components),
            name=name,
        )

    refuse_dependent_pilots((pilot("axial", (0,)), pilot("tilt", (4, 5))), mesh.points)
    with pytest.raises(ValueError, match=r"their 3 coordinates have rank 2"):
        refuse_dependent_pilots((pilot("axial", (0,)), pilot("both", (0, 4))), mesh.points)


def test_more_coordinates_than_shared_displacements_are_refused():
    mesh = box_with()
    end = mesh.points[np.unique(mesh.surface("end"))]
    weights = (np.isin(end[:, 1:], [0.0, 1.0]).all(axis=1) & (end[:, 1:].sum(axis=1) < 1.5)).astype(
        float
    )
    assert weights.sum() == 3.0
    pilots = tuple(
        replace(
            weighted_pilot(mesh, "end", np.array([1.0, y, 0.5]), weights, components=(0, 1, 2)),
            name=f"{y}",
        )
        for y in (0.1, 0.2, 0.3, 0.4)
    )
    with pytest.raises(ValueError, match="their 12 coordinates have rank"):
        refuse_dependent_pilots(pilots, mesh.points)


def test_a_body_with_one_surface_under_two_names_or_one_name_twice_is_refused(
    flexible_mesh, carrier
):
    twin = replace(
        flexible_mesh,
        surfaces={**flexible_mesh.surfaces, "upwind_seat": flexible_mesh.surface("shaft_face")},
    )
    with pytest.raises(
        ValueError, match=r"pilots 'shaft_face', 'upwind_seat' cannot move independently"
    ):
        structural_model("twin", twin, carrier, ("shaft_face", "upwind_seat"))
    with pytest.raises(ValueError, match="pilot 'shaft_face' is given twice"):
        structural_model("twice", flexible_mesh, carrier, ("shaft_face", "shaft_face"))


def free_box(mesh, *pilots):
    materials = {"carrier": STEEL}
    return StructuralModel(
        "box",
        assemble_stiffness(mesh, materials),
        assemble_mass(mesh, materials),
        mesh.points,
        pilots,
    )


def test_a_rigid_surface_that_is_a_line_is_refused_with_its_nodes():
    mesh = box_with()
    pilot = distributing_pilot(mesh, "end", np.array([1.0, 0.5, 0.5]))
    edge = np.flatnonzero((mesh.points[:, 0] == 1.0) & (mesh.points[:, 1] == 0.0))[:3]
    line = TetMesh(mesh.points, mesh.tets, {"end": np.array([[*edge, *edge]])}, mesh.bodies)
    with pytest.raises(
        ValueError,
        match=r"rigid surface 'end' with 3 nodes \(.*\) cannot hold a pilot's .*rotation z",
    ):
        rigidly_coupled(free_box(mesh, pilot), line)


def test_a_rigid_pilot_with_fewer_than_six_components_is_refused():
    mesh = box_with()
    pilot = distributing_pilot(mesh, "end", np.array([1.0, 0.5, 0.5]), components=(0, 1, 2))
    with pytest.raises(
        ValueError, match=r"components \(0, 1, 2\) only; a rigid coupling holds all six"
    ):
        rigidly_coupled(free_box(mesh, pilot), mesh)
