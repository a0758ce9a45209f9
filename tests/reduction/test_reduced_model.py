from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
from numpy.testing import assert_allclose

from carrierflex.fe.structural_model import structural_model
from carrierflex.geometry.dihedral import rotation_about_x
from carrierflex.geometry.pins import pin_angles
from carrierflex.reduction.assembly import Joint, assembled
from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.reduction.reduced_model import turned
from carrierflex.reduction.reduced_static import pilot_compliance, static_coordinates
from tests.reduction.small_bar import LENGTH, bar


def test_a_turned_pin_equals_the_reduction_of_the_turned_mesh(pin_reduction, one_pin_mesh, carrier):
    angle = float(pin_angles(3)[1])
    points = one_pin_mesh.points @ rotation_about_x(angle).T
    surfaces = {
        name.replace("pin_1", "pin_2"): facets for name, facets in one_pin_mesh.surfaces.items()
    }
    mesh = replace(one_pin_mesh, points=points, surfaces=surfaces)
    names = ("pin_2_upwind", "pin_2_midspan", "pin_2_downwind")
    expected = craig_bampton(structural_model("pin", mesh, carrier, names), 4).model
    result = turned(pin_reduction.model, angle, {name.replace("2", "1"): name for name in names})
    assert result.labels == expected.labels
    m = 18
    for a, b in ((result.K, expected.K), (result.M, expected.M)):
        scale = np.sqrt(np.outer(b.diagonal(), b.diagonal()))
        assert_allclose(a[:m, :m] / scale[:m, :m], b[:m, :m] / scale[:m, :m], rtol=0.0, atol=1e-8)
    # Modes are found up to their sign.
    signs = np.sign(np.sum(result.M[:m, m:] * expected.M[:m, m:], axis=0))
    size = np.abs(expected.M[:m, m:]).max()
    assert_allclose(result.M[:m, m:] * signs, expected.M[:m, m:], rtol=0.0, atol=1e-6 * size)
    for name in names:
        assert_allclose(result.pilots[name], expected.pilots[name], rtol=0.0, atol=1e-12)
    assert_allclose(
        result.mass_properties.centre, expected.mass_properties.centre, rtol=0.0, atol=1e-12
    )
    assert_allclose(
        result.mass_properties.inertia, expected.mass_properties.inertia, rtol=0.0, atol=1e-9
    )


def test_turning_leaves_the_original_unchanged(pin_reduction):
    model = pin_reduction.model
    before = model.K.copy(), model.M.copy(), dict(model.pilots)
    turned(model, 1.0, {name: f"{name}_of_pin" for name in model.pilots})
    assert (model.K == before[0]).all()
    assert (model.M == before[1]).all()
    assert all((model.pilots[name] == point).all() for name, point in before[2].items())


def test_sensors_turn_with_their_body(pin_reduction):
    rng = np.random.default_rng(1)
    model = pin_reduction.model
    n = model.n_coordinates
    model = replace(model, sensor_names=("s",), sensor_rows=rng.standard_normal((1, n)))
    rename = {name: f"{name}_of_pin" for name in model.pilots}
    moved = turned(model, 1.0, rename)
    q = rng.standard_normal(n)
    turned_q = q.copy()
    for name in model.pilots:
        for three in np.split(model.coordinates_of(name), 2):
            turned_q[three] = rotation_about_x(1.0) @ q[three]
    assert_allclose(moved.sensor_rows @ turned_q, model.sensor_rows @ q, rtol=1e-12)


WRONG = [
    ({"K": np.zeros((2, 2))}, r"pin: K has shape \(2, 2\); expected \(22, 22\), one row a label"),
    ({"M": np.zeros((22, 21))}, r"pin: M has shape \(22, 21\)"),
    ({"D": np.zeros(22)}, r"pin: D has shape \(22,\)"),
    (
        {"sensor_rows": np.zeros((1, 22))},
        r"pin: sensor rows have shape \(1, 22\); expected \(0, 22\)",
    ),
    ({"pilots": {}}, r"pin: pilots and pilot coordinates do not name the same pilots"),
]


@pytest.mark.parametrize(("changed", "message"), WRONG)
def test_contradicting_parts_are_refused(pin_reduction, changed, message):
    with pytest.raises(ValueError, match=message):
        replace(pin_reduction.model, **changed)


def test_a_held_bar_deflects_as_its_compliance_says():
    model = craig_bampton(bar(), 3).model
    load = np.array([1.0, -2.0, 3.0, 0.1, 0.2, 0.5])
    q = static_coordinates(model, ["bar_start"], {"bar_end": load})
    assert not q[model.coordinates_of("bar_start")].any()
    expected = pilot_compliance(model, ["bar_start"]) @ load
    # Rounding; forces at pilots do no work on fixed-interface modes.
    assert_allclose(q[model.coordinates_of("bar_end")], expected, rtol=1e-9)
    assert_allclose(q[12:], 0.0, rtol=0.0, atol=1e-15)


def test_a_body_that_is_not_held_is_refused():
    one, other = craig_bampton(bar(), 0).model, craig_bampton(bar(name="other"), 0).model
    loose = replace(
        one,
        K=scipy.linalg.block_diag(one.K, other.K), M=np.eye(24), D=np.eye(24),
        labels=one.labels + other.labels,
        pilots={**one.pilots, **other.pilots},
        pilot_coordinates=one.pilot_coordinates
        | {pilot: dofs + 12 for pilot, dofs in other.pilot_coordinates.items()},
        sensor_rows=np.zeros((0, 24)),
    )  # fmt: skip
    load = {"other_end": np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])}
    with pytest.raises(scipy.linalg.LinAlgError, match="does not fix every motion"):
        static_coordinates(loose, ["bar_start"], load)


def test_a_part_that_can_spin_in_its_joint_is_refused():
    # One zero eigenvalue, which rounding may well make positive.
    bodies = [
        craig_bampton(bar(), 2).model,
        craig_bampton(bar(name="other", offset=LENGTH), 2).model,
    ]
    hinged = assembled("hinged", bodies, [Joint("bar_end", "other_start", 1e5, 0.0)])
    with pytest.raises(scipy.linalg.LinAlgError, match="hinged"):
        static_coordinates(
            hinged, ["bar_start"], {"other_end": np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0])}
        )


def test_unknown_pilots_are_refused_by_name():
    model = craig_bampton(bar(), 0).model
    with pytest.raises(KeyError, match="bar has no pilot 'middle'; it has bar_start, bar_end"):
        static_coordinates(model, ["middle"], {})
    with pytest.raises(KeyError, match="bar has no pilot 'middle'"):
        static_coordinates(model, ["bar_start"], {"middle": np.zeros(6)})
