"""The shipped cases of the paper's own model and of table 4."""

import numpy as np
import pytest

from carrierflex.simulation.carrier.case_files import shipped_case
from carrierflex.simulation.stage.load_channels import load_columns
from carrierflex.simulation.stage.part_loads import part_loads
from carrierflex.simulation.stage.quasi_static import quasi_static_turn, sensor_orders
from carrierflex.simulation.stage.stage_cases import read_stage_case
from carrierflex.simulation.stage.stage_model import stage_model
from carrierflex.workflows.simulation.stage_bodies import default_stage_body

pytestmark = pytest.mark.long

#: Torque and radial load of table 2.
LOADS = {1: (360e3, 0.0), 2: (180e3, 0.0), 3: (360e3, -200e3), 4: (360e3, 200e3)}


@pytest.mark.parametrize("number", LOADS)
def test_the_papers_model_and_the_fit_of_table_4_are_one_file_a_load_case(number):
    paper = read_stage_case(shipped_case(f"stage_paper_lc{number}"))
    table_4 = read_stage_case(shipped_case(f"stage_table4_lc{number}"))
    plain = read_stage_case(shipped_case(f"stage_lc{number}"))
    for case in (paper, table_4):
        load = case.runs[0].load
        assert (load.torque, load.ntl_z) == LOADS[number]
        assert (case.effects, case.speed) == (plain.effects, plain.speed)
    assert (paper.pin_fit_stiffness, table_4.pin_fit_stiffness) == (1e6, 1.7e7)
    assert paper.main_shaft == "finite_elements"
    assert paper.data.planet_rollers is not None
    assert paper.data.gear.helix_angle == 0.0
    assert paper.data.mounting.radial_damping == 4.83e6
    assert table_4.data.gear == plain.data.gear
    # Spur teeth excite the third mesh harmonic. With 9 steps of its period the generator's speed
    # there is a third too low, with 36 by 3 %.
    mesh_period = 2.0 * np.pi / (paper.speed * paper.data.gear.ring_teeth)
    assert mesh_period / paper.data.mesh.n_harmonics / paper.step > 30.0


def orders_of(name, size=0.06):
    case = read_stage_case(shipped_case(name))
    body = default_stage_body(case.pin_fit_stiffness, size, main_shaft=case.main_shaft)
    model = stage_model(body, case.data, effects=case.effects, speed=0.0)
    record = quasi_static_turn(model, case.runs[0].load)
    axial = case.sensors[:4]
    columns = load_columns(model, record, part_loads(model, record.c))
    return sensor_orders(model, record, axial), columns, model


def test_the_papers_model_shares_the_torque_and_follows_its_carrier():
    orders, columns, model = orders_of("stage_paper_lc1")
    # The finite-element shaft brings its coupling flange and its own bending.
    assert model.layout.hub == "coupling_flange"
    pull = sum(columns[f"pin_{planet}_force_tangential"] for planet in (1, 2, 3))
    np.testing.assert_allclose(-pull * 0.308, 360e3, rtol=1e-3)
    # A sun on its default quill of 5e6 N/m takes no lateral force: below what any gearbox of this
    # family measured (docs/stage_model.md).
    assert 1.0 < columns["load_sharing_factor"].max() < 1.08
    # Pin fit of 1e6 N m/rad: 0.18 um per kN m of order 3 (docs/reduction.md).
    assert 50e-6 < orders.mean_amplitude(3) < 80e-6


def test_the_fit_of_table_4_gives_the_rim_deflection_of_table_4():
    orders, _, _ = orders_of("stage_table4_lc1")
    # 0.083 um RMS per kN m, almost all of it order 3; the coarse mesh is 13 % stiffer than the one
    # that docs/reduction.md derives the fit with.
    assert orders.mean_amplitude(3) == pytest.approx(0.083e-6 * 2.0**0.5 * 360.0, rel=0.15)
