"""Joined bodies: ties and springs on chains with known answers, and the refusals."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.reduction.assembly import Joint, assembled, imposed_motion
from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.reduction.reduced_static import (
    constrained_solution,
    pilot_compliance,
    static_coordinates,
)
from tests.reduction.small_bar import LENGTH, bar

STIFF = 1e12


@pytest.fixture(scope="module")
def one():
    return craig_bampton(bar(name="one"), 4).model


@pytest.fixture(scope="module")
def two():
    return craig_bampton(bar(name="two", offset=LENGTH), 4).model


@pytest.fixture(scope="module")
def three():
    return craig_bampton(bar(name="three", offset=2.0 * LENGTH), 4).model


def joint(bending=STIFF, torsional=STIFF, **options):
    return Joint("one_end", "two_start", bending, torsional, **options)


def test_joined_pilots_share_translations_and_keep_their_rotations(one, two):
    chain = assembled("chain", [one, two], [joint()])
    first, second = chain.coordinates_of("one_end"), chain.coordinates_of("two_start")
    assert (first[:3] == second[:3]).all()
    assert not set(first[3:]) & set(second[3:])
    assert chain.n_coordinates == one.n_coordinates + two.n_coordinates - 3
    for name in chain.pilots:
        # Every coordinate bears the name of the pilot that keeps it.
        shared = "one_end" if name == "two_start" else name
        assert chain.labels[chain.coordinates_of(name)[1]] == f"{shared} Ty [m]"
        assert chain.labels[chain.coordinates_of(name)[5]] == f"{name} Rz [rad]"


def test_a_sliding_joint_leaves_the_axial_translation_free(one, two):
    chain = assembled("chain", [one, two], [joint(slides=True)])
    first, second = chain.coordinates_of("one_end"), chain.coordinates_of("two_start")
    assert first[0] != second[0]
    assert (first[1:3] == second[1:3]).all()
    q = static_coordinates(
        chain, ["one_start", "two_end"], {"one_end": np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])}
    )
    assert q[first[0]] > 0.0
    assert abs(q[second[0]]) < 1e-9 * q[first[0]]


def test_springs_store_half_k_phi_squared(one, two):
    sprung = assembled("chain", [one, two], [joint(3e4, 5e4)])
    free = assembled("chain", [one, two], [joint(0.0, 0.0)])
    first, second = sprung.coordinates_of("one_end"), sprung.coordinates_of("two_start")
    for axis, stiffness in ((3, 5e4), (4, 3e4), (5, 3e4)):  # torsion is about x, the pin's axis
        q = np.zeros(sprung.n_coordinates)
        q[first[axis]], q[second[axis]] = 0.7, -0.1
        energy = q @ (sprung.K - free.K) @ q / 2.0
        assert_allclose(
            energy, stiffness * 0.8**2 / 2.0, rtol=1e-5
        )  # difference of matrices of 1e9


def test_two_stiffly_joined_bars_twist_and_bend_as_one_long_bar(one, two):
    # Exact for end moments, which bend a bar without warping its ends: the joint's springs add L /
    # k each.
    chain = assembled("chain", [one, two], [joint(2e5, 4e5)])
    for axis, stiffness in ((4, 2e5), (5, 2e5), (3, 4e5)):
        moment = np.eye(6)[axis]
        end = chain.coordinates_of("two_end")[axis]
        single = static_coordinates(one, ["one_start"], {"one_end": moment})[
            one.coordinates_of("one_end")[axis]
        ]
        result = static_coordinates(chain, ["one_start"], {"two_end": moment})[end]
        assert_allclose(result, 2.0 * single + 1.0 / stiffness, rtol=1e-9)


def test_infinite_stiffness_ties_the_rotations_and_is_the_limit_of_stiffer_springs(one, two):
    tied = assembled("chain", [one, two], [joint(np.inf, np.inf)])
    assert (tied.coordinates_of("one_end") == tied.coordinates_of("two_start")).all()
    assert tied.n_coordinates == one.n_coordinates + two.n_coordinates - 6
    limit = pilot_compliance(tied, ["one_start"])
    differences = []
    for k in (1e8, 1e9):
        sprung = pilot_compliance(assembled("chain", [one, two], [joint(k, k)]), ["one_start"])
        differences.append(np.abs(sprung - limit).max() / limit.max())
    # The springs add 1 / k: ten times stiffer, ten times nearer.
    assert differences[1] < 1e-3
    assert_allclose(differences[0] / differences[1], 10.0, rtol=0.01)


def test_only_the_infinite_direction_is_tied(one, two):
    chain = assembled("chain", [one, two], [joint(np.inf, 1e3)])
    first, second = chain.coordinates_of("one_end"), chain.coordinates_of("two_start")
    assert (first == second).tolist() == [True, True, True, False, True, True]


def test_an_imposed_stretch_strains_both_bars_as_springs_in_series(one, two):
    gap = np.array([2e-5, 0.0, 0.0, 0.0, 0.0, 0.0])
    joints = [joint(np.inf, np.inf)]
    chain, imposed = (
        assembled("chain", [one, two], joints),
        imposed_motion([one, two], joints, {"two_start": gap}),
    )
    fixed = np.concatenate([chain.coordinates_of("one_start"), chain.coordinates_of("two_end")])
    q = constrained_solution(chain, fixed, imposed.load, "both ends")
    compliance = [
        pilot_compliance(bar, [fixed_pilot])[0, 0]
        for bar, fixed_pilot in ((one, "one_start"), (two, "two_end"))
    ]
    force = gap[0] / sum(compliance)
    # The gap pushes the first bar back: two_start stands 20 um downstream of one_end.
    assert_allclose(q[chain.coordinates_of("one_end")[0]], -force * compliance[0], rtol=1e-9)
    assert_allclose(imposed.strain_energy(chain.K, q), force * gap[0] / 2.0, rtol=1e-9)
    assert_allclose((chain.K @ q - imposed.load)[fixed[0]], force, rtol=1e-9)


def test_an_imposed_motion_offsets_the_sensors_of_the_second_body(one, two):
    sensing = replace(two, sensor_names=("start",), sensor_rows=np.eye(1, two.n_coordinates, 4))
    motion = np.array([0.0, 0.0, 0.0, 0.0, 3e-4, 0.0])
    imposed = imposed_motion([one, sensing], [joint(np.inf, np.inf)], {"two_start": motion})
    assert_allclose(imposed.sensor_offset, [3e-4], rtol=1e-14)
    assert (imposed.pilot_offset["two_start"] == motion).all()


def test_motions_that_no_joint_can_hold_are_refused(one, two, three):
    kink = np.array([0.0, 0.0, 0.0, 0.0, 1e-3, 0.0])
    with pytest.raises(ValueError, match="no joint has 'one_end' as its second pilot"):
        imposed_motion([one, two], [joint(np.inf, np.inf)], {"one_end": kink})
    with pytest.raises(
        ValueError,
        match="joint one_end-two_start: a motion is imposed along a coordinate that is free or",
    ):
        imposed_motion([one, two], [joint(1e6, np.inf)], {"two_start": kink})
    with pytest.raises(ValueError, match="a motion is imposed along a coordinate that is free or"):
        imposed_motion(
            [one, two], [joint(np.inf, np.inf, slides=True)], {"two_start": np.eye(6)[0]}
        )
    three = replace(
        three, pilots={name: point - [LENGTH, 0.0, 0.0] for name, point in three.pilots.items()}
    )
    chain = [joint(np.inf, np.inf), Joint("two_start", "three_start", np.inf, np.inf)]
    with pytest.raises(ValueError, match="pilot two_start carries a further joint"):
        imposed_motion([one, two, three], chain, {"two_start": kink})


def test_more_stiffness_never_softens(one, two):
    compliances = [
        pilot_compliance(assembled("chain", [one, two], [joint(k, k)]), ["one_start"])
        for k in (1e3, 1e5, 1e7)
    ]
    for soft, hard in pairwise(compliances):
        eigenvalues = np.linalg.eigvalsh(soft - hard)
        assert eigenvalues.min() > -1e-9 * eigenvalues.max()


def test_an_assembly_keeps_mass_rigid_motion_and_symmetry(one, two):
    chain = assembled("chain", [one, two], [joint()])
    single = one.mass_properties
    assert_allclose(chain.mass_properties.mass, 2.0 * single.mass, rtol=1e-12)
    assert_allclose(chain.mass_properties.centre, [LENGTH, 0.0, 0.0], rtol=0.0, atol=1e-12)
    # Steiner: each half lies LENGTH / 2 off the common centre, which only rotations across x feel.
    steiner = 2.0 * single.mass * (LENGTH / 2.0) ** 2
    expected = 2.0 * single.inertia + np.diag([0.0, steiner, steiner])
    assert_allclose(chain.mass_properties.inertia, expected, rtol=0.0, atol=1e-10 * steiner)
    axial = np.zeros(chain.n_coordinates)
    for name in chain.pilots:
        axial[chain.coordinates_of(name)[0]] = 1.0
    assert_allclose(axial @ chain.M @ axial, 2.0 * single.mass, rtol=1e-9)
    assert np.abs(chain.K @ axial).max() < 1e-8 * np.abs(chain.K).max()
    assert (np.abs(chain.K - chain.K.T) == 0.0).all()


def test_loads_on_both_pilots_of_a_joint_add_up(one, two):
    chain = assembled("chain", [one, two], [joint()])
    force = np.array([1.0, 2.0, 3.0, 0.0, 0.0, 0.0])
    parted = static_coordinates(
        chain, ["one_start"], {"one_end": 0.25 * force, "two_start": 0.75 * force}
    )
    at_once = static_coordinates(chain, ["one_start"], {"one_end": force})
    assert_allclose(parted, at_once, rtol=0.0, atol=1e-12 * np.abs(at_once).max())


def test_a_chain_of_three_is_joined_whatever_the_order_of_its_joints(one, two, three):
    joints = [
        Joint("one_end", "two_start", STIFF, STIFF),
        Joint("two_start", "three_start", STIFF, STIFF),
    ]
    three = replace(
        three, pilots={name: point - [LENGTH, 0.0, 0.0] for name, point in three.pilots.items()}
    )
    chains = [assembled("chain", [one, two, three], order) for order in (joints, joints[::-1])]
    for chain in chains:
        shared = [
            chain.coordinates_of(name)[:3] for name in ("one_end", "two_start", "three_start")
        ]
        assert (shared[0] == shared[1]).all()
        assert (shared[0] == shared[2]).all()
    assert_allclose(chains[0].K, chains[1].K, rtol=0.0, atol=1e-6)


def test_bodies_with_sensors_keep_their_rows(one, two):
    sensing = replace(one, sensor_names=("tip",), sensor_rows=np.eye(1, one.n_coordinates, 7))
    chain = assembled("chain", [two, sensing], [Joint("one_end", "two_start", 0.0, 0.0)])
    q = np.random.default_rng(8).standard_normal(chain.n_coordinates)
    assert chain.sensor_names == ("tip",)
    assert_allclose(chain.sensor_rows @ q, q[chain.coordinates_of("one_end")[1]], rtol=1e-14)


def test_repeated_sensor_names_are_refused(one, two):
    bodies = [
        replace(b, sensor_names=("tip",), sensor_rows=np.zeros((1, b.n_coordinates)))
        for b in (one, two)
    ]
    with pytest.raises(
        ValueError, match="two bodies have a sensor named 'tip'; expected different names"
    ):
        assembled("chain", bodies, [joint()])


def test_repeated_pilot_names_are_refused(one):
    with pytest.raises(
        ValueError, match="two bodies have a pilot named 'one_end'; expected different names"
    ):
        assembled("chain", [one, one], [])


def test_an_unknown_pilot_is_refused_by_name(one, two):
    with pytest.raises(
        KeyError,
        match=r"no body has a pilot 'rim'; there are one_start, one_end, two_start, two_end",
    ):
        assembled("chain", [one, two], [Joint("one_end", "rim", 0.0, 0.0)])


def test_pilots_apart_are_refused(one, two):
    with pytest.raises(
        ValueError, match=r"pilots one_end and two_end are 0.3 m apart; expected one point"
    ):
        assembled("chain", [one, two], [Joint("one_end", "two_end", 0.0, 0.0)])


def test_a_pilot_tied_twice_is_refused(one, two):
    with pytest.raises(
        ValueError, match="pilot two_start is tied twice; expected one joint a pilot"
    ):
        assembled("chain", [one, two], [joint(), joint()])


@pytest.mark.parametrize("value", [-1.0, float("nan")])
def test_a_negative_stiffness_is_refused(value):
    with pytest.raises(
        ValueError,
        match=rf"joint one_end-two_start: bending_stiffness is {value}; expected 0 or more",
    ):
        joint(value, 0.0)
    with pytest.raises(
        ValueError, match=rf"joint one_end-two_start: torsional_stiffness is {value}"
    ):
        joint(0.0, value)


def test_inputs_stay_unchanged(one, two):
    before = [matrix.copy() for body in (one, two) for matrix in (body.K, body.M, body.D)]
    assembled("chain", [one, two], [joint()])
    for now, then in zip(
        (m for body in (one, two) for m in (body.K, body.M, body.D)), before, strict=True
    ):
        assert (now == then).all()
