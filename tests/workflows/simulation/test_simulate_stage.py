"""A stage case from the command's function to a campaign folder."""

import sys
import tracemalloc
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

from carrierflex.fe.curve_files import write_curves
from carrierflex.identification.campaign.campaign_files import read_campaign
from carrierflex.reduction.body_files import write_body
from carrierflex.reduction.pin_joints import carrier_with_pins
from carrierflex.reduction.shapes.body_stresses import body_stresses
from carrierflex.simulation.carrier.case_files import shipped_case
from carrierflex.simulation.stage import response
from carrierflex.simulation.stage.quasi_static import rest_readings
from carrierflex.simulation.stage.response import StageDivergedError
from carrierflex.simulation.stage.stage_body import ShaftData, StageBody, beam_shaft
from carrierflex.simulation.stage.stage_model import stage_model
from carrierflex.workflows import command_line
from carrierflex.workflows.simulation import simulate_stage
from carrierflex.workflows.simulation.simulate_load_case import main
from carrierflex.workflows.simulation.stage_bodies import default_stage_body
from tests.simulation.synthetic_curves import curve_set


@pytest.fixture
def curves(tmp_path):
    path = tmp_path / "curves.csv"
    write_curves(path, curve_set())
    return path


def short_case(tmp_path, *changes):
    text = (
        shipped_case("stage_lc1")
        .read_text(encoding="utf-8")
        .replace("duration = 20.0", "duration = 5.5")
    )
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "case.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def coarse_body():
    return default_stage_body(1e6, 0.06)


@pytest.fixture
def coarse(coarse_body, monkeypatch):
    assert isinstance(coarse_body, StageBody)
    of_files = simulate_stage.stage_body_of_files

    def body(files, *stated, **more):
        return of_files(files, *stated, **more) if files else coarse_body

    monkeypatch.setattr(simulate_stage, "stage_body_of_files", body)
    return coarse_body


@pytest.mark.usefixtures("coarse")
def test_a_stage_case_becomes_a_campaign_that_shows_three_peaks_a_revolution(tmp_path, curves):
    result = main(short_case(tmp_path), out=tmp_path / "campaign", curves=curves)
    assert result.imbalance["LC1"] < 1e-6
    campaign = read_campaign(result.folder)
    (run,) = campaign.runs
    assert set(run.signals) == {"s047", "s137", "s227", "s317", "r040", "r310"}
    turn = np.exp(-1j * np.outer(np.arange(6), run.inputs["carrier_angle"]))
    two_turns = run.inputs["carrier_angle"] < 4.0 * np.pi
    orders = 2.0 * np.abs((turn[:, two_turns] * run.signals["s047"][two_turns]).mean(axis=1))
    # Pin fit of 1e6 N m/rad: 0.18 um per kN m of order 3 (docs/reduction.md).
    assert 50e-6 < orders[3] < 80e-6
    assert orders[3] > 10.0 * orders[[2, 4, 5]].max()


def test_a_refused_stage_case_leaves_nothing(tmp_path, curves):
    with pytest.raises(ValueError, match="too large for the mesh period"):
        main(
            short_case(tmp_path, ("step = 1e-3 ", "step = 1e-2 ")),
            out=tmp_path / "campaign",
            curves=curves,
        )
    assert not (tmp_path / "campaign").exists()


#: Radial load that lifts the housing by metres; as the carrier turns, its motion passes what counts
#: as small here.
RUNAWAY = (
    ("ntl_y = 0.0", "ntl_y = 1.3e8"),
    ("ntl_z = 0.0 ", "ntl_z = 1.3e8 "),
    ("[effects] ", "[mounting]\nntl_arm = 1.75\n\n[effects] "),
)


@pytest.mark.usefixtures("coarse")
def test_a_diverging_run_keeps_what_was_written_and_tells_when_and_where(
    tmp_path, curves, monkeypatch, capsys
):
    monkeypatch.setattr(response, "_RUN_AWAY", 3.0)
    monkeypatch.setattr(response, "CHUNK", 4)
    out = tmp_path / "campaign"
    arguments = [
        "simulate",
        str(short_case(tmp_path, *RUNAWAY)),
        "--out",
        str(out),
        "--curves",
        str(curves),
    ]
    monkeypatch.setattr(sys, "argv", ["carrierflex", *arguments])
    with pytest.raises(SystemExit) as ended:
        command_line.main()
    assert ended.value.code == 2
    *_, line = capsys.readouterr().err.strip().splitlines()
    assert "the run left the range of small motions at t = 0." in line
    assert "s in 'housing T" in line
    (run,) = read_campaign(out).runs
    assert 4 < len(run.time) < 60  # more than one segment, less than the run
    assert_allclose(np.diff(run.time), 0.01, rtol=1e-9)
    assert run.condition.startswith(f"100 % torque, cut at {run.time[-1]:g} s: housing T")
    assert [path.name for path in tmp_path.glob(".campaign*")] == []


@pytest.mark.usefixtures("coarse")
def test_an_interrupted_run_keeps_what_was_written(tmp_path, curves, monkeypatch):
    def interrupted(*arguments, **keywords):
        yield next(simulate(*arguments, **keywords))
        raise KeyboardInterrupt

    simulate = simulate_stage.simulate_stage
    monkeypatch.setattr(simulate_stage, "simulate_stage", interrupted)
    with pytest.raises(KeyboardInterrupt):
        main(short_case(tmp_path), out=tmp_path / "campaign", curves=curves)
    (run,) = read_campaign(tmp_path / "campaign").runs
    assert len(run.time) == response.CHUNK
    assert run.condition == "100 % torque, cut at 5 s: interrupted"


@pytest.mark.long
@pytest.mark.usefixtures("coarse")
def test_memory_does_not_grow_with_the_length_of_the_run(tmp_path, curves, monkeypatch):
    monkeypatch.setattr(response, "CHUNK", 100)
    peaks = []
    for duration in ("3.0", "3.0", "12.0"):  # the first one warms up
        case = short_case(tmp_path, ("duration = 5.5", f"duration = {duration}"))
        tracemalloc.start()
        result = main(case, out=tmp_path / "campaign", curves=curves)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert result.n_samples == {"LC1": 1200}
    assert len(read_campaign(result.folder).runs[0].time) == 1200
    assert peaks[2] < 1.1 * peaks[1], peaks


def test_signals_count_from_rest_where_asked(tmp_path, curves, coarse):
    runs = []
    for name, more in (
        ("plain", ""),
        ("zeroed", "[zeroing]\ncarrier_angle_deg = 30.0\n\n[effects]"),
    ):
        changes = [("duration = 5.5", "duration = 0.2")] + ([("[effects]", more)] if more else [])
        result = main(short_case(tmp_path, *changes), out=tmp_path / name, curves=curves)
        runs.append(read_campaign(result.folder).runs[0])
    case = result.case
    model = stage_model(coarse, case.data, effects=case.effects, speed=case.speed)
    zero = rest_readings(model, case.sensors, np.deg2rad(30.0), effects=case.reading)
    for name in runs[0].signals:
        assert_allclose(
            runs[0].signals[name] - runs[1].signals[name], zero[name], rtol=0.0, atol=1e-15
        )


def with_bodies(tmp_path, **files):
    lines = "".join(f'{name} = "{file}"\n' for name, file in files.items())
    return short_case(
        tmp_path,
        ("duration = 5.5", "duration = 0.2"),
        ("[effects] ", f"[bodies]\n{lines}\n[effects] "),
    )


@pytest.mark.usefixtures("coarse")
def test_a_case_may_bring_its_own_bodies(tmp_path, curves, flexible_reduction, pin_reduction):
    write_body(flexible_reduction.model, tmp_path / "carrier.h5")
    write_body(pin_reduction.model, tmp_path / "pin.h5")
    thin = ShaftData(outer_diameter=0.3)
    write_body(
        beam_shaft(thin, flexible_reduction.model.pilots["shaft_face"]), tmp_path / "shaft.h5"
    )
    case = with_bodies(tmp_path, carrier="carrier.h5", pin="pin.h5", shaft="shaft.h5")
    given = main(case, out=tmp_path / "own", curves=curves)
    default = main(
        short_case(tmp_path, ("duration = 5.5", "duration = 0.2")),
        out=tmp_path / "default",
        curves=curves,
    )
    (run,), (other,) = read_campaign(given.folder).runs, read_campaign(default.folder).runs
    assert given.imbalance["LC1"] < 1e-6
    # The same carrier and pins, but a shaft that gives way more: the sensors read other numbers of
    # the same size.
    size = np.ptp(other.signals["s047"])
    assert 0.0 < np.abs(run.signals["s047"] - other.signals["s047"]).max() < 2.0 * size


@pytest.mark.parametrize(
    ("body", "lost", "message"),
    [
        (
            "carrier",
            "downwind_seat",
            r"carrier\.h5: .* has no pilot 'downwind_seat', which the planetary stage takes hold "
            r"of",
        ),
        ("carrier", "pin_2_upwind", r"carrier\.h5: .* has no pilot 'pin_2_upwind'"),
        ("pin", "pin_1_midspan", r"pin\.h5: .* has no pilot 'pin_1_midspan'"),
        ("shaft", "main_bearing_seat", r"shaft\.h5: .* has no pilot 'main_bearing_seat'"),
    ],
)
def test_a_body_without_the_stages_pilots_is_refused_before_the_run(
    tmp_path, curves, flexible_reduction, pin_reduction, body, lost, message
):
    shaft = beam_shaft(ShaftData(), flexible_reduction.model.pilots["shaft_face"])
    model = {"carrier": flexible_reduction.model, "pin": pin_reduction.model, "shaft": shaft}[body]
    pilots = {name if name != lost else "elsewhere": point for name, point in model.pilots.items()}
    rows = {
        name if name != lost else "elsewhere": coordinates
        for name, coordinates in model.pilot_coordinates.items()
    }
    write_body(replace(model, pilots=pilots, pilot_coordinates=rows), tmp_path / f"{body}.h5")
    with pytest.raises(ValueError, match=message):
        main(
            with_bodies(tmp_path, **{body: f"{body}.h5"}), out=tmp_path / "campaign", curves=curves
        )
    assert not (tmp_path / "campaign").exists()


def test_bodies_that_do_not_belong_together_are_refused(
    tmp_path, curves, flexible_reduction, stage_pins
):
    moved = {
        name: point + np.array([0.0, 0.0, 0.01])
        for name, point in flexible_reduction.model.pilots.items()
    }
    write_body(replace(flexible_reduction.model, pilots=moved), tmp_path / "carrier.h5")
    with pytest.raises(
        ValueError, match=r"has pin_1_upwind at y, z = .*0\.3180 m; expected .*0\.3080 m"
    ):
        main(with_bodies(tmp_path, carrier="carrier.h5"), out=tmp_path / "campaign", curves=curves)
    carrier, pin = stage_pins
    write_body(carrier, tmp_path / "carrier.h5")
    write_body(pin, tmp_path / "pin.h5")
    with pytest.raises(ValueError, match="comes with its pins; expected no body file for a pin"):
        main(
            with_bodies(tmp_path, carrier="carrier.h5", pin="pin.h5"),
            out=tmp_path / "campaign",
            curves=curves,
        )
    with pytest.raises(FileNotFoundError, match=r"none\.h5: no such file"):
        main(with_bodies(tmp_path, carrier="none.h5"), out=tmp_path / "campaign", curves=curves)


@pytest.fixture
def stage_pins(flexible_reduction, pin_reduction):
    return carrier_with_pins(flexible_reduction.model, pin_reduction.model), pin_reduction.model


@pytest.mark.usefixtures("coarse")
def test_a_run_that_diverges_at_once_leaves_nothing(tmp_path, curves, monkeypatch):
    monkeypatch.setattr(response, "_RUN_AWAY", 1e-3)
    with pytest.raises(StageDivergedError, match="left the range of small motions"):
        main(short_case(tmp_path), out=tmp_path / "campaign", curves=curves)
    assert not list(tmp_path.glob("*campaign*"))


@pytest.mark.long
@pytest.mark.usefixtures("coarse")
def test_the_linearised_stage_swings_in_torsion_first_and_tilts_under_a_slow_radial_load(
    tmp_path, curves
):
    case = short_case(tmp_path, ("duration = 5.5", "duration = 0.2"))
    main(case, out=tmp_path / "campaign", curves=curves, linearised=tmp_path / "lin", quiet=True)
    assert {path.name for path in (tmp_path / "lin").iterdir()} == {
        "modes.csv", "frequency_response.csv", "campbell.csv", "linearised.png", "linearised.json"
    }  # fmt: skip
    modes = np.genfromtxt(
        tmp_path / "lin" / "modes.csv", delimiter=",", names=True, dtype=None, encoding="utf-8"
    )
    # The torsion of the drive train, 1.57 Hz without the generator's speed control, which damps it.
    assert 1.0 < modes["frequency_hz"][0] < 1.57
    assert (modes["damping_ratio"] > 0.0).all()
    response = np.genfromtxt(tmp_path / "lin" / "frequency_response.csv", delimiter=",", names=True)
    slow = [
        [response[f"s{angle}_per_{load}_re_mN"][0] for angle in ("047", "137", "227", "317")]
        for load in ("ntl_y", "ntl_z")
    ]
    # The rim tilts as a whole: sensors opposite one another read opposite motions,
    # but for the waves of order 2 that the three webs add.
    assert np.abs(np.array(slow)[:, :2] + np.array(slow)[:, 2:]).max() < 0.15 * np.abs(slow).max()
    campbell = np.genfromtxt(tmp_path / "lin" / "campbell.csv", delimiter=",", names=True)
    assert_allclose(campbell["mesh_hz"][-1], 1.2 * 36.465, rtol=1e-4)


@pytest.mark.long
@pytest.mark.usefixtures("coarse")
def test_loads_stand_beside_the_record_where_asked(tmp_path, curves):
    loads = tmp_path / "loads"
    result = main(
        short_case(tmp_path, ("duration = 5.5", "duration = 6.0")),
        out=tmp_path / "campaign",
        curves=curves,
        loads=loads,
    )
    table = np.genfromtxt(loads / "LC1_loads.csv", delimiter=",", names=True)
    run = read_campaign(result.folder).runs[0]
    assert_allclose(table["time"], run.time, rtol=1e-12)
    assert_allclose(table["carrier_angle"], run.inputs["carrier_angle"], rtol=1e-12)
    shares = sum(table[f"share_{planet}"] for planet in (1, 2, 3))
    assert_allclose(shares, 1.0, rtol=1e-12)
    power = 360e3 * 22.1 * np.pi / 30.0
    assert_allclose(table["energy_torque"][-1], 6.0 * power, rtol=0.01)
    assert np.abs(table["energy_imbalance"]).max() < 1e-9 * table["energy_torque"][-1]
    assert (loads / "LC1_loads.png").stat().st_size > 10_000
    assert {path.name for path in loads.iterdir()} == {"LC1_loads.csv", "LC1_loads.png"}


def test_loads_are_for_stages_alone(tmp_path):
    with pytest.raises(
        ValueError, match=r"--loads is for stages; carrier_lc1_to_lc4\.toml is none"
    ):
        main(shipped_case(), out=tmp_path / "campaign", loads=tmp_path / "loads")


@pytest.mark.long
def test_stress_of_a_carrier_file_stands_beside_the_record(
    tmp_path, curves, flexible_mesh, flexible_reduction
):
    write_body(
        flexible_reduction.model,
        tmp_path / "carrier.h5",
        stresses=body_stresses(flexible_mesh, flexible_reduction.basis),
    )
    bodies = ("[rig]", '[bodies]\ncarrier = "carrier.h5"\n\n[rig]')
    case = short_case(tmp_path, bodies)
    folder = tmp_path / "stress"
    main(case, out=tmp_path / "campaign", curves=curves, stress=folder, quiet=True)
    names = {"LC1_stress.csv", "LC1_cycles.csv", "LC1_stress.png"}
    assert {path.name for path in folder.iterdir()} == names
    peaks = pd.read_csv(folder / "LC1_stress.csv").set_index("surface")
    # Torsion of the hub with the torque: tau = T r / J, von Mises sqrt(3) tau.
    outer, inner = 0.230, 0.160
    tau = 360e3 * outer / (np.pi / 2.0 * (outer**4 - inner**4))
    seat = peaks.loc["upwind_seat", "largest von Mises stress [Pa]"]
    assert 1.0 < seat / (np.sqrt(3.0) * tau) < 3.0
    # Bending by weight and rotor load turns once a revolution: two cycles in 5.5 s at 22.1 rpm.
    cycles = pd.read_csv(folder / "LC1_cycles.csv")
    large = cycles[cycles["surface"] == "upwind_seat"]
    large = large[large["range from [Pa]"] > 0.5 * peaks.loc["upwind_seat", "range [Pa]"]]
    assert 1.0 <= large["cycles"].sum() <= 3.0
    # Pins as simply supported beams: F (a b / L - w / 8) over the section, weight and tilt aside.
    force, a, b, w = 360e3 / (3.0 * 0.308), 0.1525, 0.1425, 0.160
    expected = 32.0 * force * (a * b / (a + b) - w / 8.0) / (np.pi * 0.160**3)
    for pin in (1, 2, 3):
        pin_row = peaks.loc[f"pin_{pin} as beam"]
        assert_allclose(pin_row["largest von Mises stress [Pa]"], expected, rtol=0.03)
        assert f"pin_{pin} as beam" in set(cycles["surface"])
    # On the side to which the planet holds the pin back: pin 1 is on top, and turns towards -y.
    assert peaks.loc["pin_1 as beam", "y [m]"] > 0.9 * 0.080


@pytest.mark.long
def test_pins_of_a_file_have_the_stress_of_their_finite_elements(
    tmp_path, curves, flexible_mesh, flexible_reduction, one_pin_mesh, pin_reduction
):
    for name, mesh, reduction in (
        ("carrier", flexible_mesh, flexible_reduction),
        ("pin", one_pin_mesh, pin_reduction),
    ):
        stresses = body_stresses(mesh, reduction.basis)
        write_body(reduction.model, tmp_path / f"{name}.h5", stresses=stresses)
    files = '[bodies]\ncarrier = "carrier.h5"\npin = "pin.h5"\n\n[rig]'
    case = short_case(tmp_path, ("[rig]", files))
    folder = tmp_path / "stress"
    main(case, out=tmp_path / "campaign", curves=curves, stress=folder, quiet=True)
    peaks = pd.read_csv(folder / "LC1_stress.csv").set_index("surface")
    assert not any("as beam" in surface for surface in peaks.index)
    # As the beam to a tenth: a pin fit of 1e6 N m/rad is nearly free.
    for pin in (1, 2, 3):
        size = peaks.loc[f"pin_{pin}_midspan_of_pin", "largest von Mises stress [Pa]"]
        assert_allclose(size, 52e6, rtol=0.1)


def test_stress_needs_body_files_that_keep_it(
    tmp_path, flexible_mesh, flexible_reduction, pin_reduction
):
    with pytest.raises(ValueError, match=r"--stress is given, \[bodies\] names no carrier"):
        main(short_case(tmp_path), out=tmp_path / "campaign", stress=tmp_path / "stress")
    write_body(flexible_reduction.model, tmp_path / "carrier.h5")
    bodies = ("[rig]", '[bodies]\ncarrier = "carrier.h5"\n\n[rig]')
    with pytest.raises(ValueError, match="has no stress rows; reduce it again with --stresses"):
        main(short_case(tmp_path, bodies), out=tmp_path / "campaign", stress=tmp_path / "stress")
    write_body(
        flexible_reduction.model,
        tmp_path / "carrier.h5",
        stresses=body_stresses(flexible_mesh, flexible_reduction.basis),
    )
    write_body(pin_reduction.model, tmp_path / "pin.h5")
    files = '[bodies]\ncarrier = "carrier.h5"\npin = "pin.h5"\n\n[rig]'
    with pytest.raises(ValueError, match=r"pin.h5: the body has no stress rows; reduce it again"):
        main(
            short_case(tmp_path, ("[rig]", files)),
            out=tmp_path / "campaign",
            stress=tmp_path / "stress",
        )
    assert not (tmp_path / "stress").exists()
    with pytest.raises(ValueError, match="--stress is for stages; carrier_lc1_to_lc4"):
        main(shipped_case(), out=tmp_path / "campaign", stress=tmp_path / "stress")
