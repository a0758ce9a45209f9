"""Body files to the rotating group.

Its mass, its modes, and what a tilted carrier does at the rim.
"""

import csv
import io

import numpy as np
import pytest
from numpy.testing import assert_allclose
from rich.console import Console

from carrierflex.fe.main_shaft import main_shaft_structure
from carrierflex.geometry.main_shaft_mesh import main_shaft_mesh
from carrierflex.geometry.main_shaft_parameters import MainShaftParameters
from carrierflex.reduction.assembly_modes import assembly_modes
from carrierflex.reduction.body_files import read_body, write_body
from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.reduction.shaft_joint import SUPPORTS
from carrierflex.workflows.reduction import join_rotating_group
from carrierflex.workflows.screen.tables import joined_table

SHAFT = MainShaftParameters()
R_PHI = 0.412 * 0.6e-3
#: Supports in the order of the table: nothing but the shaft, bearing A, bearings A and B.
FIRST, SECOND, LAST = SUPPORTS


@pytest.fixture(scope="module")
def files(tmp_path_factory, flexible_reduction, pin_reduction, carrier):
    folder = tmp_path_factory.mktemp("bodies")
    shaft = craig_bampton(
        main_shaft_structure(main_shaft_mesh(carrier, SHAFT, 0.08), carrier, SHAFT), 4
    ).model
    for name, model in (
        ("carrier", flexible_reduction.model),
        ("pin", pin_reduction.model),
        ("shaft", shaft),
    ):
        write_body(model, folder / f"{name}.h5")
    return {name: folder / f"{name}.h5" for name in ("carrier", "pin", "shaft")}


def test_the_tilt_shows_in_full_until_a_second_bearing_holds_the_carrier(files, tmp_path):
    joined = join_rotating_group.main(
        **files, out=tmp_path / "group.h5", phi_plc=0.6e-3, theta_plc=1.05
    )
    assert_allclose(joined.swing[FIRST], R_PHI, rtol=1e-3)
    pilots = joined.group.model.pilots
    length = pilots["carrier_joint"][0] - pilots["main_bearing_seat"][0]
    arm = pilots["upwind_seat"][0] - pilots["carrier_joint"][0]
    # Statically determinate: the kink divides into the slopes of carrier and shaft.
    assert_allclose(joined.swing[SECOND], R_PHI * length / (length + arm), rtol=1e-3)
    assert joined.swing[LAST] < 0.4 * R_PHI
    with (tmp_path / "group_misalignment.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert sum(row["kind"] == "load" for row in rows) == joined.group.model.n_coordinates
    assert sum(row["kind"] == "offset" for row in rows) == 720
    console = Console(width=80, record=True, file=io.StringIO())
    console.print(joined_table(joined))
    assert "axial swing of the rim by the tilt, um" in console.export_text()


def test_the_group_file_holds_all_masses_and_the_shafts_bending_comes_first(files, tmp_path):
    joined = join_rotating_group.main(**files, out=tmp_path / "group.h5")
    assert [path.name for path in tmp_path.iterdir()] == ["group.h5"]
    masses = {name: read_body(path).mass_properties.mass for name, path in files.items()}
    written = read_body(tmp_path / "group.h5")
    assert_allclose(
        written.mass_properties.mass,
        masses["carrier"] + 3.0 * masses["pin"] + masses["shaft"],
        rtol=1e-9,
    )
    first, second = joined.modes[:2]
    # Bending in two planes; the free mesh of the shaft parts them a little.
    assert_allclose(first.frequency_hz, second.frequency_hz, rtol=5e-3)
    assert first.rim_motion == "rim axial, 1 nodal diameter"
    stiffer = join_rotating_group.main(**files, out=tmp_path / "stiff.h5", pin_fit=1e9)
    assert all(
        a.frequency_hz >= b.frequency_hz * (1.0 - 1e-9)
        for a, b in zip(stiffer.modes, joined.modes, strict=True)
    )


def test_a_held_body_has_no_free_modes(files):
    model = read_body(files["pin"])
    model.K[:6, :6] += 1e9 * np.eye(6)
    with pytest.raises(
        ValueError, match="pin: 0 motions meet no stiffness; expected the six of a free body"
    ):
        assembly_modes(model, 2)


def test_bodies_that_do_not_fit_are_refused_and_leave_nothing(files, tmp_path):
    with pytest.raises(KeyError, match="no body has a pilot 'shaft_face'"):
        join_rotating_group.main(
            carrier=files["pin"], shaft=files["shaft"], out=tmp_path / "group.h5"
        )
    with pytest.raises(ValueError, match=r"phi is 0\.6 rad; expected a small angle"):
        join_rotating_group.main(**files, out=tmp_path / "group.h5", phi_plc=0.6)
    with pytest.raises(ValueError, match=r"suffix '\.op4'; expected \.h5"):
        join_rotating_group.main(**files, out=tmp_path / "group.op4")
    assert not list(tmp_path.iterdir())
