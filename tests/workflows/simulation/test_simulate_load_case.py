import re

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.fe.curve_files import read_curves, write_curves
from carrierflex.identification.campaign.campaign_files import read_campaign
from carrierflex.identification.carrier.carrier_identification import identify_each_run
from carrierflex.identification.carrier.models import flexible_model
from carrierflex.simulation.carrier.case_files import shipped_case
from carrierflex.simulation.law_files import write_law
from carrierflex.simulation.laws import CARRIER, ELEMENT, Law, Table, Wave
from carrierflex.workflows.simulation.simulate_load_case import main
from tests.simulation.synthetic_curves import curve_set


@pytest.fixture
def curves(tmp_path):
    path = tmp_path / "curves.csv"
    write_curves(path, curve_set())
    return path


def test_the_shipped_case_becomes_a_campaign_from_which_its_truth_is_identified(tmp_path, curves):
    result = main(shipped_case(), out=tmp_path / "campaign", curves=curves)
    campaign = read_campaign(result.folder)
    assert [run.name for run in campaign.runs] == ["LC1", "LC2", "LC3", "LC4"]
    assert campaign.rig["nominal_torque"] == 360e3
    assert campaign.baseline.effects == ("axial_offset",)
    copied = read_curves(result.folder / campaign.rig["deflection_curves"])
    estimates = identify_each_run(campaign, flexible_model(copied["delta_s"], copied["delta_f"]))
    for case in result.case.runs:
        estimate = estimates[case.name]
        truth = np.array([getattr(case.motion, name) for name in estimate.names])
        assert (np.abs(estimate.values - truth) < 5.0 * estimate.std).all()
        # Table 4: what M2 leaves is the static saddle and the noise.
        assert_allclose(estimate.rms**2, case.motion.saddle**2 + 5e-6**2, rtol=0.02)
        # Section 1: the deflection of the rim scales with the torque in every load case.
        assert_allclose(
            estimate.values[estimate.index("rho_f", case.name)], 42e-6 / (0.19e-6 * 360), rtol=0.01
        )


def test_the_same_case_gives_the_same_files(tmp_path, curves):
    for name in ("a", "b"):
        main(shipped_case(), out=tmp_path / name, curves=curves)
    files = sorted(path.name for path in (tmp_path / "a").iterdir())
    assert files == [
        "LC1.csv",
        "LC2.csv",
        "LC3.csv",
        "LC4.csv",
        "campaign.toml",
        "case.toml",
        "deflection_curves.csv",
    ]
    for name in files:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()


def test_a_refused_case_leaves_nothing(tmp_path, curves):
    case = tmp_path / "case.toml"
    case.write_text(shipped_case().read_text().replace("torque = 180e3", "torque = 0.0", 1))
    with pytest.raises(
        ValueError, match="order 3; a positive torque and a curve with that order are needed"
    ):
        main(case, out=tmp_path / "campaign", curves=curves)
    assert not (tmp_path / "campaign").exists()


def law_file(path, n_planets=3):
    """Law file of a tilt of 20 um that grows up to the torque of 180 kN m and stays."""
    x = np.array([0.0, 1.8e5, 3.6e5])
    height = np.array([0.0, 2e-5, 2e-5])
    waves = (Wave("axial_displacement", 0, 1, "torque", height, 0.0 * x, x),)
    visited = {"torque": (1.8e5, 3.6e5), "ntl_y": (0.0, 0.0), "ntl_z": (0.0, 0.0)}
    rig = {"n_planets": n_planets, "sensor_radius": 0.412}
    write_law(path, Law("bent", CARRIER, "housing/tilt", ("N", "m"), waves, visited, rig))
    return path


def test_the_signal_of_a_law_is_added_to_the_case_and_a_copy_kept(tmp_path, curves):
    law = law_file(tmp_path / "law.toml")
    case = tmp_path / "short.toml"
    text = shipped_case().read_text(encoding="utf-8")
    case.write_text(re.sub(r"(?m)^duration = .*$", "duration = 6.0", text), encoding="utf-8")
    without = main(case, out=tmp_path / "a", curves=curves).campaign
    # A campaign that was simulated may be replaced by one with a law, and the other way round.
    result = main(case, out=tmp_path / "b", curves=curves, law=[law]).campaign
    assert (tmp_path / "b" / "law_1.toml").read_bytes() == law.read_bytes()
    for bare, run in zip(without.runs, result.runs, strict=True):
        for channel in result.channels:
            added = run.signals[channel.name] - bare.signals[channel.name]
            height = np.interp(run.inputs["torque"], [0.0, 1.8e5, 3.6e5], [0.0, 2e-5, 2e-5])
            is_axial = channel.quantity == "axial_displacement"
            assert_allclose(added, is_axial * height * np.cos(channel.angle), atol=1e-16)
    main(case, out=tmp_path / "b", curves=curves)
    assert not (tmp_path / "b" / "law_1.toml").exists()


def test_a_law_that_is_none_of_the_case_is_refused(tmp_path, curves):
    other = law_file(tmp_path / "law.toml", n_planets=5)
    with pytest.raises(ValueError, match="of a carrier with 5 planets, the rig has 3"):
        main(shipped_case(), out=tmp_path / "out", curves=curves, law=[other])
    x = np.array([0.0, 1.0])
    element = tmp_path / "element.toml"
    table = Table(ELEMENT, x, x)
    write_law(element, Law("own", ELEMENT, "dissipation", ("N", "m"), (table,)))
    with pytest.raises(ValueError, match="law 'own' is not of a carrier, which the case is"):
        main(shipped_case(), out=tmp_path / "out", curves=curves, law=[element])
    for name in ("mounting_2011", "stage_lc1"):
        with pytest.raises(ValueError, match="--law is for cases of the carrier"):
            main(shipped_case(name), out=tmp_path / "out", law=[other])
    assert not (tmp_path / "out").exists()
