"""Stiffness and frequencies of the torsional train, from the command's function to its files."""

import csv
import io

import pytest
from numpy.testing import assert_allclose
from rich.console import Console

from carrierflex.simulation.carrier.case_files import shipped_case
from carrierflex.workflows.screen.simulation_tables import torsion_table
from carrierflex.workflows.simulation import compute_torsion, stage_bodies
from tests.workflows.checked_documents import checked_document


@pytest.fixture
def coarse(flexible_reduction, pin_reduction, monkeypatch):
    def bodies(_size, stage, _files):
        return flexible_reduction.model, pin_reduction.model, stage.gear

    monkeypatch.setattr(stage_bodies, "reduced_carrier_and_pin", bodies)


@pytest.mark.usefixtures("coarse")
def test_the_mounting_is_as_soft_as_the_gearbox_and_lowers_the_frequency(tmp_path):
    torsion = compute_torsion.main(out=tmp_path / "torsion", quiet=True)
    written = checked_document(tmp_path / "torsion" / "torsion.json")
    # Two linear bushings of table 3: 2 K1 R_x^2.
    assert_allclose(written["stiffness_nm_per_rad"]["mounting"], 2.0 * 20.2e6 * 0.75**2, rtol=5e-3)
    assert_allclose(written["stiffness_nm_per_rad"]["gearbox"], 27e6, rtol=0.03)
    assert written["paper"]["first_frequency_hz"]["held"] == 2.11
    assert set(written["paper"]["fitted_to_it"]) == {"main shaft", "gearbox"}
    first = {key: values[0] for key, values in torsion.frequencies_hz.items()}
    for topology in ("all stages in one housing", "ring gear alone on the mounting"):
        assert_allclose(first[topology, "held"], 2.074, atol=1e-3)
        assert 0.6 < first[topology, "on bushings"] / first[topology, "held"] < 0.75
    with (tmp_path / "torsion" / "torque_sweep.csv").open(encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["member"] == "mounting"]
    assert_allclose(float(rows[-1]["torque [N m]"]), 360e3 * (1.0 - 1.0 / 81.491), rtol=1e-6)
    assert (tmp_path / "torsion" / "torque_sweep.png").read_bytes().startswith(b"\x89PNG")
    console = Console(width=80, record=True, file=io.StringIO())
    console.print(torsion_table(torsion))
    assert "paper, 1st" in console.export_text()


@pytest.mark.usefixtures("coarse")
def test_given_inertias_and_bushings_decide(tmp_path):
    torsion = compute_torsion.main(
        out=tmp_path / "torsion",
        case=shipped_case("mounting_2011"),
        rotor_inertia=1.9e5,
        quiet=True,
    )
    first = torsion.frequencies_hz["ring gear alone on the mounting", "on bushings"][0]
    assert_allclose(first, 1.469, atol=1e-3)
    # Bushings that harden: stiffer than 2 K1 R_x^2 of their own K1.
    assert torsion.sweeps["mounting"].stiffness > 1.1 * 2.0 * 17.6e6 * 0.75**2


def test_an_impossible_torque_is_refused_before_anything_is_made(tmp_path):
    with pytest.raises(ValueError, match=r"torque sweep: torque is -1\.0 N m"):
        compute_torsion.main(out=tmp_path / "torsion", torque=-1.0, quiet=True)
    assert not (tmp_path / "torsion").exists()
