"""The figures of both papers: every number is there, and the data behind the axes are physics."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.geometry.parameter_files import StageParameters, read_parameters
from carrierflex.identification.carrier.printed_tables import TABLE_4, derived_facts
from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.simulation.mounting.table_3 import TABLE_3
from carrierflex.workflows.fe.bodies import body_structure
from carrierflex.workflows.fe.default_curves import default_curves
from carrierflex.workflows.figures.bushing_figures import _force_loops
from carrierflex.workflows.figures.draw_figures import _chosen_figures, main
from carrierflex.workflows.figures.figures_2011 import FIGURES_2011
from carrierflex.workflows.figures.figures_2012 import FIGURES_2012
from carrierflex.workflows.figures.finite_element_figures import _mode_shapes, deflection_curves
from carrierflex.workflows.figures.index_page import FIGURES, index_page
from carrierflex.workflows.figures.mounting_figures import cylinder_forces
from carrierflex.workflows.figures.shared_runs import BodyReduction, SharedRuns
from tests.workflows.checked_documents import checked_document


def test_every_number_of_both_papers_is_there_once():
    assert [figure.number for figure in FIGURES_2011] == list(range(1, 13))
    assert [figure.number for figure in FIGURES_2012] == list(range(1, 15))
    assert len({figure.file for figure in FIGURES}) == 26
    shared = {name for name in dir(SharedRuns) if not name.startswith("_")}
    assert all(set(figure.needs) <= shared for figure in FIGURES)


def test_the_index_says_of_every_figure_what_made_it_and_what_is_derived():
    page = index_page(FIGURES, 0.04)
    for figure in FIGURES:
        entry = page[page.index(f'<figure id="{figure.name}">') :]
        entry = entry[: entry.index("</figure>")]
        for words in (figure.file, figure.in_the_paper, figure.made_by, figure.derived):
            assert words in entry
        assert figure.derived.endswith((".", "a>"))
    assert "http" not in page


def test_figures_are_chosen_by_paper_and_by_number():
    assert _chosen_figures("2011", ()) == FIGURES_2011
    assert [figure.name for figure in _chosen_figures(None, ("2012-5", "2011-9"))] == [
        "2011-9",
        "2012-5",
    ]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--only", "2011-13"), "--only 2011-13: no such figure; expected one of 2011-1, "),
        (("--paper", "2011", "--only", "2012-5"), "no such figure in the paper of 2011"),
        (("--duration", "5"), "--duration is 5.0 s; expected at least 5.43 s"),
        (("--evaluations", "9"), "--evaluations is 9; expected at least 100"),
    ],
)
def test_what_cannot_be_drawn_is_refused_before_the_folder_is_made(
    command, tmp_path, options, message
):
    result = command("figures", "--out", "figures", *options)
    assert result.returncode == 2
    assert message in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1
    assert not (tmp_path / "figures").exists()


def test_drawings_and_their_index_are_written(tmp_path):
    drawn = main(out=tmp_path / "figures", only=("2011-5", "2012-3"), quiet=True)
    assert [figure.name for figure in drawn.figures] == ["2011-5", "2012-3"]
    written = checked_document(tmp_path / "figures" / "figures.json")
    assert written["figures"] == {
        "2011-5": "2011_figure_05.png",
        "2012-3": "2012_figure_03.png",
    }
    for file in written["figures"].values():
        assert (tmp_path / "figures" / file).read_bytes().startswith(b"\x89PNG")
    page = (tmp_path / "figures" / "index.html").read_text(encoding="utf-8")
    assert page.count("<figure ") == 2


def test_six_peaks_stand_in_the_stiff_panel_and_three_in_the_flexible_one():
    stiff, flexible = deflection_curves(
        SimpleNamespace(curves=default_curves(), parameters=StageParameters())
    ).axes
    assert stiff.get_legend().get_texts()[0].get_text() == "6 peaks"
    assert flexible.get_legend().get_texts()[0].get_text() == "3 peaks"
    assert "µm per kN m" in stiff.get_ylabel()
    assert stiff.get_xlim() == (0.0, 360.0)


def test_every_law_begins_with_its_stiffness_and_loses_what_its_damper_takes():
    # Slow and small: no fluid, no slip, no hardening.
    amplitude = 1e-5
    for (label, (u, force)), constants in zip(
        _force_loops(1e-4, amplitude).items(), TABLE_3.values(), strict=True
    ):
        stiffness = constants["K1"] + constants.get("Kp", 0.0)
        assert_allclose(np.polyfit(u, force, 1)[0], stiffness, rtol=1e-3, err_msg=label)
    # The linear law's loop holds pi C omega u².
    u, force = _force_loops()["Lin"]
    area = abs(np.trapezoid(force, u))
    assert_allclose(area, np.pi * 4.83e6 * (2.0 * np.pi * 0.05) * 8e-3**2, rtol=1e-3)


def test_the_three_laws_agree_at_small_deflection_and_part_at_large_ones():
    small, large = _force_loops(1e-3, 1e-3), _force_loops(1e-3, 8e-3)

    def peak(loops):
        """Largest force of every law [N]."""
        return {label: force.max() for label, (_, force) in loops.items()}

    # Secants of 20.2, 17.7 and 12.6 MN/m; at 8 mm hardening adds a fifth to one and none to others.
    assert peak(small)["Lin"] == pytest.approx(peak(small)["NLin"], rel=0.15)
    assert peak(large)["NLin"] > 1.35 * peak(large)["Lin"] > 1.35 * peak(large)["HD-b"]


def test_both_cylinders_together_make_the_radial_load():
    inputs = SimpleNamespace(ntl_y=np.array([0.0, 3e4]), ntl_z=np.array([0.0, -1e5]))
    port, starboard = cylinder_forces(SimpleNamespace(inputs=inputs)).values()
    assert_allclose((port + starboard) * np.cos(np.pi / 4.0), inputs.ntl_z)
    assert_allclose((port - starboard) * np.sin(np.pi / 4.0), inputs.ntl_y)


@pytest.fixture(scope="module")
def bodies(flexible_mesh, flexible_reduction, one_pin_mesh, pin_reduction):
    mesh, structure = body_structure("main_shaft", read_parameters(None), 0.08)
    return {
        "carrier": BodyReduction(flexible_mesh, flexible_reduction),
        "pin": BodyReduction(one_pin_mesh, pin_reduction),
        "main_shaft": BodyReduction(mesh, craig_bampton(structure, 6)),
    }


def test_mode_seven_joins_shaft_carrier_and_pins(bodies, flexible_structure, pin_structure):
    shapes, mode, pivot = _mode_shapes(SimpleNamespace(bodies=bodies, parameters=StageParameters()))
    shaft, carrier, *pins = (u for _, _, u in shapes)
    assert 100.0 < mode.frequency_hz < 250.0
    assert "1 nodal diameter" in mode.rim_motion
    bore = {pilot.name: pilot.G @ carrier.ravel() for pilot in flexible_structure.pilots}
    scale = np.abs(bore["shaft_face"]).max()
    # Carrier and shaft as one at the joint, all six motions.
    end = bodies["main_shaft"].mesh.surface("carrier_joint")
    mean = shaft[np.unique(end)].mean(axis=0)
    assert_allclose(mean, bore["shaft_face"][:3], atol=0.01 * scale)
    # Pins move with their bores' middles: translations tied, each pin in its own place.
    for number, u in enumerate(pins, start=1):
        turn = 2.0 * np.pi * (number - 1) / 3.0
        R = np.array(
            [[1.0, 0.0, 0.0], [0.0, np.cos(turn), -np.sin(turn)], [0.0, np.sin(turn), np.cos(turn)]]
        )
        for pilot in pin_structure.pilots:
            side = pilot.name.removeprefix("pin_1_")
            if side != "midspan":
                motion = (pilot.G @ (u @ R).ravel())[:3]
                assert_allclose(R @ motion, bore[f"pin_{number}_{side}"][:3], atol=1e-6 * scale)
    # The plates bend and the pins do not: they pivot by most of the hub's tilt.
    assert 0.5 < pivot < 1.2


@pytest.mark.long
def test_the_records_leave_what_tables_4_and_5_print(bodies):
    shared = SharedRuns(0.06, 5.5, 100)
    # The coarse bodies that other tests made, in place of its own.
    vars(shared).update(bodies=bodies, curves=default_curves())
    stage = shared.stage
    run = stage.measured()
    angle = run.inputs["carrier_angle"]
    turns = angle < angle[0] + 4.0 * np.pi
    order_1 = [
        2.0 * np.mean(run.signals[name][turns] * np.exp(-1j * angle[turns]))
        for name in ("s047", "s137", "s227", "s317")
    ]
    assert_allclose(np.abs(order_1), 0.24e-3, rtol=0.1)
    # A tilt that turns with the carrier comes a quarter of a turn later at the next sensor.
    assert_allclose(np.angle(np.divide(order_1, np.roll(order_1, -1))), np.pi / 2.0, atol=0.1)
    for load_case, printed in TABLE_4.items():
        m1, m2 = (stage.estimates[name][load_case] for name in ("m1", "m2"))
        # Two standard errors of 4 um, errors of the sensors and a coarse carrier: 12 um.
        assert_allclose([m1.rms, m2.rms], printed, rtol=0, atol=12e-6)
        assert m2.rms < m1.rms
    for load_case, phi in derived_facts().phi_PLC.items():
        assert_allclose(phi_of(stage, load_case), phi.value, rtol=0.06)
    # Another stage: its tilt goes round.
    simulated = stage.simulated.signals
    assert_allclose(np.ptp(simulated["s047"]), 2.0 * phi_of(stage, "LC2") * 0.412, rtol=0.4)


def phi_of(stage, load_case):
    """Tilt that model 1 found in a load case [rad]."""
    estimate = stage.estimates["m1"][load_case]
    return estimate.values[estimate.names.index("phi_PLC")]


@pytest.mark.acceptance
def test_all_figures_are_drawn(tmp_path):
    drawn = main(out=tmp_path / "figures", size=0.06, evaluations=200, quiet=True)
    assert len(drawn.figures) == 26
    for figure in drawn.figures:
        assert (drawn.folder / figure.file).stat().st_size > 20_000
    numbers = checked_document(drawn.folder / "figures.json")["numbers"]
    accuracy = numbers["table 2 of 2011, accuracy"]
    # Each model contains the one before it.
    assert accuracy["HD-b"] == 1.0 <= accuracy["NLin"] <= accuracy["Lin"]
    for constants in numbers["table 3 of 2011, SI"].values():
        for name, entry in constants.items():
            low, high = entry["ci95"]
            assert low is None or low <= entry["value"] <= high, name
