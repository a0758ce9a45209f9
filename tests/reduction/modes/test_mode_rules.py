"""A number of modes never ends inside a group of equal frequency, whatever it counts from."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.fe.structural_model import carrier_pilot_points, flexible_carrier_pilots
from carrierflex.fe.symmetry_blocks import half_sector
from carrierflex.geometry.dihedral_group import dihedral_group
from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.reduction.fixed_interface_modes import fixed_interface_modes
from carrierflex.reduction.free_interface import free_interface_reduction
from carrierflex.reduction.held_structure import GroundedBody, HeldStructure
from carrierflex.reduction.modes import mode_rules
from carrierflex.reduction.modes.mode_rules import AtLeast, Below, end_of_group, rule_for_use
from carrierflex.reduction.symmetric_craig_bampton import symmetric_craig_bampton

HZ = 2.0 * np.pi
#: Two pairs of equal frequency, the first one split by a free mesh, and modes beside them.
OMEGA = np.array([10.0, 20.0, 20.01, 30.0, 40.0, 40.0, 50.0])


@pytest.fixture(scope="module")
def frequencies(flexible_structure):
    """Lowest fixed-interface frequencies of the coarse carrier, cut wherever the number falls."""
    body = GroundedBody(flexible_structure.K, flexible_structure.points)
    constrained = HeldStructure(body, flexible_structure.pilots)
    return fixed_interface_modes(
        constrained, flexible_structure.M, 24, rng=np.random.default_rng(0)
    ).omega


@pytest.mark.parametrize(
    ("wanted", "count"), [(0, 0), (1, 1), (2, 3), (3, 3), (4, 4), (5, 6), (6, 6), (7, None)]
)
def test_a_number_grows_to_the_next_gap(wanted, count):
    assert end_of_group(OMEGA, wanted) == count
    assert AtLeast(wanted).count(OMEGA) == count


@pytest.mark.parametrize(
    ("frequency_hz", "count"), [(5.0, 0), (15.0, 1), (20.005, 3), (45.0, 6), (60.0, None)]
)
def test_a_frequency_keeps_what_lies_below_and_its_partner(frequency_hz, count):
    assert Below(frequency_hz).count(HZ * OMEGA) == count


def test_a_body_used_up_to_a_frequency_keeps_modes_up_to_four_times_that():
    assert rule_for_use(11.0).count(HZ * OMEGA) == 6
    with pytest.raises(ValueError, match="cut-off frequency is nan Hz; expected a positive"):
        Below(float("nan"))


@pytest.mark.long
def test_the_carriers_numbers_hardly_depend_on_what_counts_as_equal(frequencies, monkeypatch):
    def numbers():
        return [end_of_group(frequencies, n) for n in range(1, 22)]

    usual = numbers()
    assert usual != list(range(1, 22))
    differing = set()
    for share in (1e-12, 1e-9, 1e-6, 1e-3, 4e-3):
        monkeypatch.setattr(mode_rules, "SAME_GROUP", share)
        differing |= {n for n, count in enumerate(numbers(), start=1) if count != usual[n - 1]}
    # Modes 10 and 11 and modes 19 and 20 lie 0.2 % apart: one mode more or less there.
    assert differing <= {9, 10, 19}


@pytest.mark.long
def test_no_reduction_of_the_carrier_ends_inside_a_pair(
    flexible_structure, flexible_half, frequencies, carrier
):
    pairs = np.flatnonzero(frequencies[1:] < (1.0 + 1e-9) * frequencies[:-1]) + 1
    wanted = int(pairs[pairs > 5][0])
    points = carrier_pilot_points(carrier)
    half = half_sector(
        "flexible_carrier",
        flexible_half,
        {name: points[name] for name in flexible_carrier_pilots(3)},
        dihedral_group(3),
    )
    for rule in (wanted, Below(frequencies[wanted - 1] / HZ * (1.0 + 1e-6))):
        full = craig_bampton(flexible_structure, rule)
        assert len(full.modes.omega) == wanted + 1
        symmetric = symmetric_craig_bampton(half, rule)
        assert symmetric.model.labels == full.model.labels
        assert_allclose(symmetric.basis.omega, full.modes.omega, rtol=1e-9)


def test_a_free_interface_body_keeps_its_pairs_too(flexible_structure):
    # The lowest free mode is one of a pair.
    assert len(free_interface_reduction(flexible_structure, 1).modes.omega) == 2
