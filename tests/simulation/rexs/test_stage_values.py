"""Numbers of a carrier and a stage case from REXS, by hand and by invariance."""

import math
import re
from dataclasses import fields

import pytest

from carrierflex.geometry.parameters import CarrierParameters, GearData, PinParameters
from carrierflex.simulation.rexs.planetary_stage import chosen_stage, planetary_stage
from carrierflex.simulation.rexs.rexs_files import read_rexs
from carrierflex.simulation.rexs.rexs_units import STANDARD_UNITS, UNITS, factor_to_si
from carrierflex.simulation.rexs.stage_values import stage_values
from carrierflex.simulation.stage.stage_data import BearingData, MeshData, StageData
from carrierflex.workflows.simulation.rexs_case import _units
from tests.simulation.rexs.public_sample import public_stage, shipped_gearbox

UNIT_OF = _units()


def values_of(model, folder, stage=None):
    read = read_rexs(model.write_xml(folder / "a.rexs"))
    component = chosen_stage(read, stage)
    return stage_values(
        planetary_stage(read, component), lambda table, key: UNIT_OF.get((table, key), "")
    )


def numbers(values):
    return {(v.table, v.key): v.number for v in (*values.dimensions, *values.case)}


def origin(values, table, key):
    return next(v for v in (*values.dimensions, *values.case) if (v.table, v.key) == (table, key))


def test_the_public_stage_by_hand(tmp_path):
    """Against the file's own numbers; units of the database of REXS 1.7 (mm, N / m, 1 / min)."""
    values = values_of(public_stage(), tmp_path)
    n = numbers(values)
    assert [n["gear", f"{g}_teeth"] for g in ("ring", "planet", "sun")] == [61, 22, 17]
    assert n["carrier", "centre_distance"] == n["gear", "centre_distance"] == 0.078
    assert n["gear", "module"] == 0.004
    # Plates from 92 to 100 and from 150 to 158 mm, 219 mm wide; pins of 43.2 mm.
    assert n["carrier", "plate_gap"] == 0.050
    assert (
        n["carrier", "upwind_plate_thickness"] == n["carrier", "downwind_plate_thickness"] == 8e-3
    )
    assert n["carrier", "outer_radius"] == 0.1095
    assert n["carrier", "pin_hole_diameter"] == n["pin", "diameter"] == 0.0432
    assert n["carrier", "hub_length"] == 0.092
    assert (n["carrier", "hub_outer_diameter"], n["carrier", "hub_inner_diameter"]) == (0.08, 0.06)
    # 20 N/(mm um) over 50 mm are 1000 N/um.
    assert n["mesh", "sun_stiffness"] == n["mesh", "ring_stiffness"] == 1e9
    # The sun drives with 1500 1/min and 1591.5 N m: 250 kW. The carrier's torque acts against it.
    assert n["", "speed_rpm"] == pytest.approx(1500.0 * 17 / 78, rel=1e-9)
    (run,) = values.runs
    power = run.load.torque * n["", "speed_rpm"] * math.pi / 30.0
    assert power == pytest.approx(-250e3, rel=1e-9)
    # Two bearings 25 mm apart that the file calls rigid, 1e20 N/m: no more than counts as that.
    rigid = origin(values, "bearings", "planet_radial")
    assert rigid.how == "file"
    assert "2e+20: rigid" in rigid.source
    assert rigid.number < 1e13
    # Both carrier bearings are upwind of the plates.
    assert n["bearings", "downwind_radial"] == 0.0
    # The same gearbox in REXS 1.4 states these tip diameters; here the rule gives them.
    assert origin(values, "gear", "sun_tip_diameter").how == "default"
    assert n["gear", "sun_tip_diameter"] == pytest.approx(0.076, rel=1e-12)
    assert n["gear", "ring_tip_diameter"] == pytest.approx(0.236, rel=1e-12)


def test_the_shipped_gearbox_comes_back_as_it_is(tmp_path):
    values = values_of(shipped_gearbox(), tmp_path)
    n = numbers(values)
    assert values.scale == 1.0
    for table, shipped in (
        ("carrier", CarrierParameters()),
        ("pin", PinParameters()),
        ("gear", GearData()),
    ):
        for entry in fields(shipped):
            if entry.name != "sensor_radius":  # no sensor in REXS
                expected = getattr(shipped, entry.name)
                assert n[table, entry.name] == pytest.approx(expected, rel=1e-11), entry.name
    shipped = BearingData()
    for key in ("planet_radial", "planet_axial", "upwind_radial", "downwind_radial"):
        assert n["bearings", key] == pytest.approx(getattr(shipped, key), rel=1e-11)
    # Rows 80 mm apart: 2 x 8.5e9 x 0.04^2 = 2.72e7 N m/rad.
    assert n["bearings", "planet_tilt"] == pytest.approx(2.72e7, rel=1e-11)
    # A clearance of 80 um across the diameter lets the planet move by 40 um.
    assert n["bearings", "planet_clearance"] == 4e-5
    assert n["mesh", "sun_stiffness"] == MeshData.sun_stiffness
    assert n["mesh", "backlash"] == pytest.approx(MeshData.backlash, rel=1e-11)
    assert [run.load.torque for run in values.runs] == [360e3, 180e3]
    assert [run.load.ntl_z for run in values.runs] == [0.0, -2e4]
    # A thick ring of 7850 kg/m^3, 227.5 mm wide, from the pin to the reference diameter.
    outside, bore, width = 0.39 / math.cos(math.radians(7.5)), 0.16, 0.2275
    mass = 7850.0 * math.pi / 4 * (outside**2 - bore**2) * width
    across = mass * (3.0 * (outside**2 + bore**2) / 4.0 + width**2) / 12.0
    for key, number in (
        ("mass", mass),
        ("polar_inertia", mass * (outside**2 + bore**2) / 8.0),
        ("transverse_inertia", across),
    ):
        assert n["planet", key] == pytest.approx(number, rel=1e-9), key


OTHER_UNITS = {
    "mm": ("mum", 1e3),
    "mum": ("mm", 1e-3),
    "deg": ("rad", math.pi / 180.0),
    "N / m": ("N / mm", 1e-3),
    "N / mm^2": ("MPa", 1.0),
    "1 / min": ("rad / s", math.pi / 30.0),
    "kN": ("N", 1e3),
    "N": ("kN", 1e-3),
}


@pytest.mark.parametrize("make", [public_stage, shipped_gearbox])
def test_other_units_give_the_same_numbers(make, tmp_path):
    expected = values_of(make(), tmp_path)
    model = make()
    changed = set()
    for entry in (*model.components, *(c for case in model.cases for c in case["components"])):
        for attribute in entry["attributes"]:
            if attribute["unit"] not in OTHER_UNITS or attribute["id"] not in STANDARD_UNITS:
                continue
            unit, factor = OTHER_UNITS[attribute["unit"]]
            changed.add(attribute["unit"])
            attribute["unit"] = unit
            value = attribute["value"]
            attribute["value"] = (
                [x * factor for x in value] if isinstance(value, list) else value * factor
            )
    assert len(changed) >= 3
    values = values_of(model, tmp_path)
    for one, other in zip(
        (*values.dimensions, *values.case), (*expected.dimensions, *expected.case), strict=True
    ):
        assert one.key == other.key
        assert one.number == pytest.approx(other.number, rel=1e-10)
    for one, other in zip(values.runs, expected.runs, strict=True):
        assert one.load.torque == pytest.approx(other.load.torque, rel=1e-10)


def test_units_left_out_are_the_standard_s(tmp_path):
    expected, model = numbers(values_of(shipped_gearbox(), tmp_path)), shipped_gearbox()
    for entry in model.components:
        for attribute in entry["attributes"]:
            attribute["unit"] = ""
    assert numbers(values_of(model, tmp_path)) == expected


def test_the_table_of_units_is_consistent():
    for attribute, unit in STANDARD_UNITS.items():
        assert unit in UNITS
        assert factor_to_si(attribute, None) == factor_to_si(attribute, unit) == UNITS[unit][0]
    assert factor_to_si("radial_stiffness", "N/mm") == 1e3
    # By hand: 20 N/(mm um) of one metre are 20e9 N/m.
    assert factor_to_si("mean_mesh_stiffness_for_transverse_load_iso_6336_2019", None) == 1e9


def test_what_the_file_lacks_is_a_default_and_scaled(tmp_path):
    model = public_stage()
    model.remove("radial_stiffness", "concept_bearing")
    model.remove("mesh_stiffness_for_load_distribution_along_face_width")
    model.remove("outer_diameter", "side_plate")
    values = values_of(model, tmp_path)
    n, s = numbers(values), 0.078 / 0.308
    for table, key, power in (
        ("bearings", "planet_radial", 1),
        ("bearings", "planet_tilt", 3),
        ("chain", "generator_inertia", 5),
        ("mounting", "radial_damping", 2),
        ("chain", "generator_constant", 4),
        ("housing", "mass", 3),
    ):
        shipped = getattr(getattr(StageData(), table), key)
        assert n[table, key] == pytest.approx(shipped * s**power, rel=1e-10), key
        assert origin(values, table, key).how == "default"
    assert n["mesh", "sun_stiffness"] == pytest.approx(15e9 * 0.05)
    assert n["carrier", "outer_radius"] == pytest.approx(0.435 * s)
    # Pure numbers stay.
    assert n["mesh", "n_harmonics"] == MeshData.n_harmonics


def test_a_load_on_the_other_end_turns_the_frame(tmp_path):
    """The carrier's load is upwind: from the other end the same gearbox is seen mirrored."""
    forward, model = values_of(public_stage(), tmp_path), public_stage()
    for relation in model.relations:
        roles = {ref["role"]: ref["id"] for ref in relation["refs"]}
        if roles == {"assembly": 4, "part": 61}:
            relation["refs"][0]["id"] = 6
    turned = values_of(model, tmp_path)
    one, other = numbers(forward), numbers(turned)
    assert other["carrier", "plate_gap"] == one["carrier", "plate_gap"]
    # The long shaft is now the seat, and its bearings are downwind.
    assert other["carrier", "seat_length"] == one["carrier", "hub_length"]
    assert other["bearings", "downwind_radial"] == one["bearings", "upwind_radial"]
    assert other["bearings", "upwind_radial"] == 0.0
    # Speed and torque change their signs together.
    assert turned.runs[0].load.torque == pytest.approx(forward.runs[0].load.torque)
    assert any("against the axis u" in note for note in turned.notes)


def test_a_load_beyond_the_gears_turns_the_frame_of_a_single_shaft(tmp_path):
    """As of a carrier with one plate: where its shaft begins tells nothing of the load's side."""
    model = public_stage()
    coordinate = {"id": "u_coordinate_on_shaft", "unit": "mm", "value": 126.0}
    load = next(each for each in model.components if each["id"] == 61)
    load["attributes"].append(coordinate)
    assert any("against the axis u" in note for note in values_of(model, tmp_path).notes)
    # The gears stand at 125 mm.
    coordinate["value"] = 124.0
    assert not any("against the axis u" in note for note in values_of(model, tmp_path).notes)


def test_one_plate_gives_the_dimensions_of_the_upwind_one(tmp_path):
    model = public_stage()
    model.attribute(67, "length")["value"] = 9.0
    model.relations = [
        relation
        for relation in model.relations
        if {"id": 68, "role": "part"} not in relation["refs"]
    ]
    values = values_of(model, tmp_path)
    n = numbers(values)
    assert n["carrier", "upwind_plate_thickness"] == 9e-3
    assert n["carrier", "outer_radius"] == 0.1095
    assert origin(values, "carrier", "downwind_plate_thickness").how == "default"
    assert any("with 1 side plates" in note for note in values.notes)


def test_places_give_the_centre_distance_that_no_mesh_states(tmp_path):
    model = public_stage()
    model.remove("center_distance")
    model.attribute(247, "support_vector")["value"] = [125.0, 30.0, 72.0]
    values = values_of(model, tmp_path)
    distance = origin(values, "carrier", "centre_distance")
    # 30^2 + 72^2 = 78^2.
    assert distance.number == pytest.approx(0.078, rel=1e-12)
    assert distance.source == "cylindrical_gear 247 support_vector, from the axis"


def test_struts_of_no_size_are_none(tmp_path):
    """Some files state them as 0 of a carrier without struts."""
    model = shipped_gearbox()
    stated = numbers(values_of(model, tmp_path))
    assert stated["carrier", "planet_clearance_radius"] == 0.219
    for name in ("strut_radius_planet_recess", "strut_inner_diameter"):
        model.attribute(3, name)["value"] = 0.0
    values = values_of(model, tmp_path)
    for key in ("planet_clearance_radius", "web_inner_radius"):
        assert origin(values, "carrier", key).how == "default"
        assert origin(values, "carrier", key).number > 0.0


def test_a_gear_that_no_bearing_holds_is_held_by_the_default(tmp_path):
    """One bearing that tilts and slides, as of a sun before a coupling that the file leaves out."""
    model, s = public_stage(), 0.078 / 0.308
    model.attribute(36, "axial_force_absorption")["value"] = "no_direction"
    model.attribute(37, "radial_force_absorption")["value"] = False
    values = values_of(model, tmp_path)
    for key, power in (("sun_axial", 1), ("sun_tilt", 3)):
        source = origin(values, "bearings", key)
        assert source.how == "default"
        assert source.number == pytest.approx(getattr(BearingData, key) * s**power, rel=1e-10)
        assert any(f"the default of {key} holds" in note for note in values.notes)
    assert origin(values, "bearings", "sun_radial").how == "file"


def test_without_a_load_the_torque_is_a_default(tmp_path):
    model, s = public_stage(), 0.078 / 0.308
    model.remove("torque_around_u_axis")
    values = values_of(model, tmp_path)
    torque = origin(values, "rig", "nominal_torque")
    assert torque.how == "default"
    assert torque.number == pytest.approx(360e3 * s**3, rel=1e-10)
    assert [run.load.torque for run in values.runs] == [pytest.approx(torque.number)]


def test_the_gearbox_may_stand_turned_in_space(tmp_path):
    """Places and axes are in the frame of component 1: the stage is the same wherever that is."""
    model = public_stage()
    stated = {e["id"]: e for e in next(c for c in model.components if c["id"] == 1)["attributes"]}
    stated["support_vector"]["value"] = [10.0, -20.0, 30.0]
    stated["u_axis_vector"]["value"] = [0.0, 1.0, 0.0]
    stated["w_axis_vector"]["value"] = [0.6, 0.0, 0.8]
    turned, straight = numbers(values_of(model, tmp_path)), values_of(public_stage(), tmp_path)
    for key, number in numbers(straight).items():
        assert turned[key] == pytest.approx(number, rel=1e-9, abs=1e-12), key


def changed(component, attribute, **entry):
    def change(model):
        model.attribute(component, attribute).update(entry)

    return change


def references_written_as(text):
    def change(model):
        for entry in model.components:
            for attribute in entry["attributes"]:
                if attribute["id"] == "reference_component_for_position":
                    attribute["value"] = text

    return change


@pytest.mark.parametrize("text", ["1", "1.0", "", "none", "9" * 5000])
def test_a_reference_in_other_words_is_read_or_left_out(text, tmp_path):
    model = public_stage()
    references_written_as(text)(model)
    # Component 1 stands at the origin: with and without it, places are the same.
    assert numbers(values_of(model, tmp_path)) == numbers(values_of(public_stage(), tmp_path))


def second_stage(model):
    model.add(900, "planetary_stage", "high speed stage")


def second_sun(model):
    for relation in model.relations:
        if relation["type"] == "stage" and relation["refs"][0]["id"] == 211:
            relation["refs"][1]["id"] = 54
    model.add(54, "cylindrical_gear")


def no_ring(model):
    next(each for each in model.components if each["id"] == 58)["type"] = "cylindrical_gear"


def one_planet(model):
    keep = {211, 220}
    model.relations = [
        each
        for each in model.relations
        if not any(211 <= ref["id"] <= 222 and ref["id"] not in keep for ref in each["refs"])
    ]


REFUSED = {
    "two stages": (second_stage, r"2 planetary stages: 9 \(Planetenstufe \[9\]\), 900 .*--stage"),
    "two suns": (second_sun, "2 suns among 6 gears"),
    "no ring": (no_ring, "0 rings and 0 suns"),
    "one planet": (one_planet, "1 planets"),
    "unit": (changed(211, "center_distance", unit="inch"), "unit 'inch'; expected one of mm, mum"),
    "dimension": (changed(211, "center_distance", unit="kN"), "center_distance has the unit 'kN'"),
    "words": (changed(53, "normal_module", value="four"), "cylindrical_gear 53: normal_module is"),
    "nan": (changed(53, "normal_module", value=math.nan), "expected a number"),
    "huge": (changed(211, "center_distance", value=1e308), "center_distance is '1e.308'; expected"),
    "tiny": (changed(67, "w_axis_vector", value=[1e-200, 0.0, 0.0]), "expected a number, of 1e-40"),
    "negative": (changed(211, "center_distance", value=-78.0), "expected a positive one"),
    "teeth": (changed(53, "number_of_teeth", value=17.5), "expected a whole number"),
    "vector": (changed(67, "support_vector", value=[1.0, 2.0]), "expected three numbers"),
    "no distance": (
        lambda model: model.remove("center_distance") or model.remove("support_vector"),
        "has a center_distance, no planet a support_vector",
    ),
    "no module": (lambda model: model.remove("normal_module"), "has no normal_module"),
    "no stage": (
        lambda model: (
            setattr(model, "components", [e for e in model.components if e["type"] == "material"])
            or setattr(model, "relations", [])
        ),
        "no component planetary_stage",
    ),
}


@pytest.mark.parametrize(("change", "words"), REFUSED.values(), ids=REFUSED)
def test_what_cannot_be_a_stage_is_refused_in_one_line(change, words, tmp_path):
    model = public_stage()
    change(model)
    with pytest.raises(ValueError, match=words) as refusal:
        values_of(model, tmp_path)
    text = str(refusal.value)
    assert "\n" not in text
    assert re.search(r"a\.rexs", text)


def test_one_of_two_stages_is_chosen(tmp_path):
    model = public_stage()
    second_stage(model)
    assert numbers(values_of(model, tmp_path, 9)) == numbers(values_of(public_stage(), tmp_path))
    with pytest.raises(ValueError, match="--stage is 8"):
        values_of(model, tmp_path, 8)
