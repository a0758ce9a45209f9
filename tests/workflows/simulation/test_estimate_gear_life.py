"""Gear life from the stage: what of a kink reaches the teeth, and what it costs."""

import csv

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.workflows.simulation import estimate_gear_life
from tests.workflows.checked_documents import checked_document

pytestmark = pytest.mark.long

PHI = 0.58e-3


@pytest.fixture(scope="module")
def life(tmp_path_factory):
    folder = tmp_path_factory.mktemp("gear_life")
    return estimate_gear_life.main(out=folder / "life", size=0.06, quiet=True), folder / "life"


def kink(life, support, carrier, mesh):
    (result,) = [
        kink
        for kink in life.kinks
        if (kink.support, kink.carrier, kink.mesh) == (support, carrier, mesh)
    ]
    return result


def test_one_bearing_alone_leaves_nearly_the_whole_kink_in_the_mesh(life):
    # L / (L + a) of the kink in the plane of action of the worst planet: the carrier alone turns,
    # sun and ring stay. Three planets at 120 deg see at least cos 30 of it.
    full_slope = PHI * 2.1 / 2.16
    for mesh in ("sun", "ring"):
        added = kink(life[0], "bearing A alone", "rigid", mesh).added_slope
        assert 0.86 * full_slope < np.abs(added).max() < 1.01 * full_slope
        assert_allclose(added.sum(), 0.0, atol=0.02 * full_slope)


def test_a_free_housing_takes_the_ring_along_and_a_held_one_does_not(life):
    sun = kink(life[0], "housing free", "flexible", "sun")
    assert abs(sun.worst) < 1e-6
    assert_allclose(sun.life_ratio, 1.0, atol=1e-3)
    sun_fixed = kink(life[0], "housing held", "flexible", "sun")
    assert 10e-6 < abs(sun_fixed.worst) < 60e-6
    # A rigid carrier brings more of the kink to the teeth than one that bends between its bearings.
    assert abs(kink(life[0], "housing held", "rigid", "sun").worst) > 3.0 * abs(sun_fixed.worst)
    state = {(s.support, s.carrier, s.phi_PLC): s for s in life[0].states}
    free, fixed = (state[name, "flexible", PHI] for name in ("housing free", "housing held"))
    assert np.linalg.norm(free.tilt["ring"]) > 0.8 * PHI
    assert np.linalg.norm(fixed.tilt["ring"]) < 1e-3 * PHI


def test_pressure_and_life_follow_from_the_added_slope(life):
    result, folder = life
    papers = result.meshes["sun"].papers_misalignment
    for entry in result.kinks:
        assert_allclose(entry.life_ratio, entry.pressure_ratio ** (-1.0 / 0.056), rtol=1e-12)
        if entry.mesh == "sun":
            # Forces of the planets differ by a thousandth, sides of the lead by a little.
            assert (abs(entry.worst) > papers) == (entry.pressure_ratio > 1.015)
        assert entry.uncorrected > entry.pressure  # torque tilts all planets under the helix
    with (folder / "stage_meshes.csv").open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == len(result.kinks) == 16
    assert_allclose(float(rows[0]["common slope [urad]"]), result.kinks[0].common_slope * 1e6, 1e-6)
    assert set(checked_document(folder / "gear_life.json")["result"]["meshes"]) == {"sun", "ring"}
    for name in ("gear_life.png", "stage_contact.png", "stage_tilts.csv", "gear_life.json"):
        assert (folder / name).stat().st_size > 1000


def test_a_kink_that_is_no_number_is_refused_before_anything_is_made(tmp_path):
    with pytest.raises(ValueError, match="--phi-plc is nan rad; expected a finite angle"):
        estimate_gear_life.main(out=tmp_path / "life", phi_plc=float("nan"), quiet=True)
    assert not (tmp_path / "life").exists()
