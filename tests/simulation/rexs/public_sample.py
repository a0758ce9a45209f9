"""REXS models to read: the FVA's public planetary stage, and the shipped gearbox.

The public one is "FVA Planetary stage - Minus gearing", which the FVA Workbench 5.5 wrote on
2019-06-05 as REXS 1.1 (a test file of github.com/fva-net/rexs-api-java): its components, ids,
relations and numbers, written here by a few lines instead of its 110 kB.
"""

import json
import math
import zipfile
from xml.etree import ElementTree

MM, NONE = "mm", "none"
#: Places of the planets around the axis in the public file: v, w [mm].
PLANET_POSITIONS = ((0.0, 78.0), (67.54998149518622, -39.0), (-67.5499814951862, -39.0))


class Model:
    """Components and relations as they are added."""

    def __init__(self, version, application, number):
        self.head = {
            "version": version,
            "applicationId": application,
            "applicationVersion": number,
            "date": "2019-06-05T11:46:35+02:00",
        }
        self.components, self.relations, self.cases = [], [], []

    def add(self, number, kind, name="", position=None, **attributes):
        """A component; attributes are (value, unit), places [mm] refer to component 1."""
        stated = [
            {"id": key, "unit": unit, "value": value} for key, (value, unit) in attributes.items()
        ]
        if position is not None:
            stated += [
                {"id": "support_vector", "unit": MM, "value": [float(x) for x in position]},
                {"id": "u_axis_vector", "unit": MM, "value": [1.0, 0.0, 0.0]},
                {"id": "w_axis_vector", "unit": MM, "value": [0.0, 0.0, 1.0]},
                {"id": "reference_component_for_position", "unit": NONE, "value": 1},
            ]
        self.components.append({"id": number, "type": kind, "name": name, "attributes": stated})

    def join(self, kind, **roles):
        """A relation."""
        refs = [{"id": number, "role": role} for role, number in roles.items()]
        self.relations.append({"id": len(self.relations) + 1, "type": kind, "refs": refs})

    def attribute(self, component, name):
        """An attribute of a component, to be changed."""
        (entry_of_name,) = (
            each
            for entry in self.components
            if entry["id"] == component
            for each in entry["attributes"]
            if each["id"] == name
        )
        return entry_of_name

    def remove(self, name, *kinds):
        """Leave out an attribute, everywhere or of some types."""
        for entry in self.components:
            if not kinds or entry["type"] in kinds:
                entry["attributes"] = [e for e in entry["attributes"] if e["id"] != name]

    def write_xml(self, path):
        """As .rexs."""
        root = ElementTree.Element("model", self.head)
        relations = ElementTree.SubElement(root, "relations")
        relations.append(ElementTree.Comment("Side relation between Bolzen and Wange"))
        for each in self.relations:
            attributes = {"id": str(each["id"]), "type": each["type"]}
            entry = ElementTree.SubElement(relations, "relation", attributes)
            for ref in each["refs"]:
                ElementTree.SubElement(entry, "ref", {k: str(v) for k, v in ref.items()})
        self._components(ElementTree.SubElement(root, "components"), self.components)
        if self.cases:
            spectrum = ElementTree.SubElement(root, "load_spectrum", id="1")
            for case in self.cases:
                entry = ElementTree.SubElement(spectrum, "load_case", id=str(case["id"]))
                self._components(entry, case["components"])
        ElementTree.ElementTree(root).write(path, encoding="UTF-8", xml_declaration=True)
        return path

    @staticmethod
    def _components(parent, components):
        for each in components:
            facts = {key: str(each[key]) for key in ("id", "type", "name") if each.get(key)}
            entry = ElementTree.SubElement(parent, "component", facts)
            for attribute in each["attributes"]:
                value = attribute["value"]
                element = ElementTree.SubElement(
                    entry, "attribute", id=attribute["id"], unit=attribute["unit"]
                )
                if isinstance(value, list):
                    array = ElementTree.SubElement(element, "array")
                    for number in value:
                        ElementTree.SubElement(array, "c").text = repr(number)
                else:
                    element.text = str(value).lower() if isinstance(value, bool) else str(value)

    def write_json(self, path):
        """As .rexsj."""
        content = {**self.head, "relations": self.relations}
        content["components"] = [self._typed(each) for each in self.components]
        if self.cases:
            cases = [
                {"id": case["id"], "components": [self._typed(c) for c in case["components"]]}
                for case in self.cases
            ]
            content["load_spectrum"] = {"id": 1, "load_cases": cases}
        path.write_text(json.dumps({"model": content}), encoding="utf-8")
        return path

    @staticmethod
    def _typed(component):
        names = {bool: "boolean", int: "integer", float: "floating_point", str: "enum"}
        names[list] = "floating_point_array"
        attributes = [
            {"id": e["id"], "unit": e["unit"], names[type(e["value"])]: e["value"]}
            for e in component["attributes"]
        ]
        return {**component, "attributes": attributes}

    def write_archive(self, path):
        """As .rexsz."""
        inside = self.write_xml(path.with_name("inside.rexs"))
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.write(inside, "gearbox.rexs")
            archive.writestr("pictures/housing.txt", "a file that the model refers to")
        inside.unlink()
        return path


def _rigid(bending=0.0, absorbs="both_directions"):
    """A bearing of the public file."""
    return {
        "axial_force_absorption": (absorbs, NONE),
        "axial_stiffness": (1e20, "N / m"),
        "bending_stiffness": (bending, "N mm / rad"),
        "radial_force_absorption": (True, NONE),
        "radial_stiffness": (1e20, "N / m"),
    }


def _section(model, number, shaft, length, inner, outer):
    model.add(
        number,
        "shaft_section",
        inner_diameter_begin=(inner, MM),
        inner_diameter_end=(inner, MM),
        outer_diameter_begin=(outer, MM),
        outer_diameter_end=(outer, MM),
        length=(length, MM),
        u_coordinate_on_shaft=(0.0, MM),
    )
    model.join("assembly", assembly=shaft, part=number)


def _gear(model, number, kind, shaft, teeth, position):
    model.add(
        number,
        kind,
        position=position,
        face_width=(50.0, MM),
        helix_angle_reference_diameter=(0.0, "°"),
        normal_module=(4.0, MM),
        number_of_teeth=(teeth, NONE),
    )
    model.join("assembly", assembly=shaft, part=number)
    model.add(number + 1000, "flank_geometry", normal_pressure_angle=(20.0, "°"))
    model.join("flank", gear=number, left=number + 1000)


def public_stage():
    """The FVA's planetary stage: 17, 22 and 61 teeth of module 4 mm, the sun drives."""
    model = Model("1.1", "FVA Workbench", "5.5")
    model.add(
        1,
        "gear_unit",
        "Gear unit [1]",
        position=(0.0, 0.0, 0.0),
        account_for_gravity=(True, NONE),
        direction_vector_gravity_u=(0.0, NONE),
        direction_vector_gravity_v=(1.0, NONE),
        direction_vector_gravity_w=(0.0, NONE),
    )
    model.add(2, "gear_casing", "Casing [2]", temperature_lubricant=(80.0, "C"))
    model.add(3, "planet_carrier", "Zweiwangiger Planetenträger [3]")
    model.add(9, "planetary_stage", "Planetenstufe [9]")
    model.add(
        89,
        "material",
        "Werkstoff [89]",
        density=(7.85, "kg / dm^3"),
        elastic_modulus=(210000.0, "N / mm^2"),
        poisson_ratio=(0.3, NONE),
    )
    for number, u in ((4, 0.0), (6, 150.0), (34, 100.0), (62, 100.0)):
        model.add(number, "shaft", position=(u, 0.0, 0.0))
        model.join("assembly", assembly=1, part=number)
    model.components[-2]["attributes"] += [
        {"id": "rotational_speed", "unit": "1 / min", "value": 1500.0},
        {"id": "defines_speed", "unit": NONE, "value": True},
    ]
    _section(model, 268, 4, 100.0, 60.0, 80.0)
    _section(model, 269, 6, 8.0, 88.0, 99.0)
    _section(model, 270, 34, 150.0, 0.0, 34.0)
    _section(model, 271, 62, 50.0, 265.0, 280.0)
    model.add(61, "external_load", transmits_torque=(True, NONE))
    model.join("assembly", assembly=4, part=61)
    model.add(38, "external_load", torque_around_u_axis=(1591.5494309189535, "N m"))
    model.join("assembly", assembly=34, part=38)
    for number, u, inner in ((67, 92.0, 80.0), (68, 150.0, 99.0)):
        model.add(
            number,
            "side_plate",
            position=(u, 0.0, 0.0),
            inner_diameter=(inner, MM),
            outer_diameter=(219.0, MM),
            length=(8.0, MM),
        )
        model.join("assembly", assembly=3, part=number)
        model.join("reference", origin=number, referenced=89)
    for number in (4, 6):
        model.join("assembly", assembly=3, part=number)
    model.join("assembly", assembly=9, part=3)
    model.join("central_shaft", planetary_stage=9, shaft=34)
    _gear(model, 53, "cylindrical_gear", 34, 17, (125.0, 0.0, 0.0))
    _gear(model, 58, "ring_gear", 62, 61, (125.0, 0.0, 0.0))
    for number, u, shaft, absorbs in (
        (36, 175.0, 34, "both_directions"),
        (37, 227.5, 34, "no_direction"),
        (59, 25.0, 4, "both_directions"),
        (60, 75.0, 4, "no_direction"),
    ):
        model.add(number, "concept_bearing", position=(u, 0.0, 0.0), **_rigid(0.0, absorbs))
        model.join("side", assembly=number, inner_part=shaft, outer_part=2)
    for number, u in ((65, 112.5), (66, 137.5)):
        model.add(number, "switchable_coupling", position=(u, 0.0, 0.0))
        model.join("side", assembly=number, inner_part=62, outer_part=2)
    for i, (v, w) in enumerate(PLANET_POSITIONS):
        shaft, pin, gear = 229 + i, 235 + i, 247 + i
        model.add(shaft, "shaft", position=(100.0, v, w))
        model.add(pin, "shaft", position=(92.0, v, w))
        _section(model, 272 + i, shaft, 50.0, 57.0, 58.0)
        _section(model, 265 + i, pin, 66.0, 0.0, 43.2)
        model.join("planet_shaft", planetary_stage=9, shaft=shaft)
        model.join("planet_pin", planetary_stage=9, shaft=pin)
        model.join("assembly", assembly=3, part=pin)
        _gear(model, gear, "cylindrical_gear", shaft, 22, (125.0, v, w))
        for bearing, u, absorbs in (
            (232 + i, 112.5, "both_directions"),
            (244 + i, 137.5, "no_direction"),
        ):
            model.add(bearing, "concept_bearing", position=(u, v, w), **_rigid(0.0, absorbs))
            model.join("side", assembly=bearing, inner_part=pin, outer_part=shaft)
        for coupling, plate, u in ((238 + i, 67, 96.0), (241 + i, 68, 154.0)):
            model.add(
                coupling, "coupling", position=(u, v, w), bending_stiffness=(1e20, "N mm / rad")
            )
            model.join("side", assembly=coupling, inner_part=pin, outer_part=plate)
        for mesh, first, second in ((211 + i, 53, gear), (220 + i, gear, 58)):
            model.add(
                mesh,
                "cylindrical_stage",
                center_distance=(78.0, MM),
                common_face_width=(50.0, MM),
                mesh_stiffness_for_load_distribution_along_face_width=(20.0, "N / (mm mum)"),
            )
            model.join("assembly", assembly=9, part=mesh)
            model.join("stage", stage=mesh, gear_1=first, gear_2=second)
    return model


def shipped_gearbox():
    """The gearbox of the papers as REXS 1.7 would hold it, with two load cases."""
    model = Model("1.7", "Gearbox program", "1")
    g = {
        "direction_vector_gravity_w": (-1.0, NONE),
        "gravitational_acceleration": (9.81, "m / s^2"),
    }
    model.add(1, "gear_unit", position=(0.0, 0.0, 0.0), **g)
    model.add(2, "gear_casing")
    model.add(
        3,
        "planet_carrier",
        strut_inner_diameter=(470.0, MM),
        strut_radius_planet_recess=(219.0, MM),
    )
    model.add(4, "planetary_stage", "low speed stage")
    model.join("assembly", assembly=4, part=3)
    for number, u, kind in (
        (10, -120.0, "hub"),
        (11, 350.0, "seat"),
        (12, 300.0, "sun"),
        (13, 70.0, "ring"),
    ):
        model.add(number, "shaft", kind, position=(u, 0.0, 0.0))
    for shaft in (10, 11):
        model.join("planet_carrier_shaft", planetary_stage=4, shaft=shaft)
    _section(model, 20, 10, 120.0, 320.0, 460.0)
    _section(model, 21, 11, 60.0, 280.0, 400.0)
    for number, u, length in ((30, 0.0, 65.0), (31, 305.0, 45.0)):
        model.add(
            number,
            "side_plate",
            position=(u, 0.0, 0.0),
            length=(length, MM),
            outer_diameter=(870.0, MM),
        )
        model.join("assembly", assembly=3, part=number)
    model.add(40, "external_load", torque_around_u_axis=(360e3, "N m"))
    model.join("assembly", assembly=10, part=40)
    model.components[5]["attributes"].append(
        {"id": "rotational_speed", "unit": "1 / min", "value": 22.1}
    )
    gears = (
        (50, "cylindrical_gear", 12, 21, (185.0, 0.0, 0.0), 220.0, 235.6, 7.5),
        (51, "ring_gear", 13, -99, (185.0, 0.0, 0.0), 227.5, 998.0, -7.5),
    )
    positions = [
        (-308.0 * math.sin(angle), 308.0 * math.cos(angle))
        for angle in (0.0, 2.0 * math.pi / 3.0, 4.0 * math.pi / 3.0)
    ]
    for i, position in enumerate(positions):
        model.add(70 + i, "shaft", f"planet {i + 1}", position=(75.0, *position))
        model.add(80 + i, "shaft", f"pin {i + 1}", position=(0.0, *position))
        _section(model, 85 + i, 80 + i, 350.0, 0.0, 160.0)
        model.join("planet_pin", planetary_stage=4, shaft=80 + i)
        gears += ((60 + i, "cylindrical_gear", 70 + i, 39, (185.0, *position), 227.5, 421.2, -7.5),)
        for bearing, u in ((90 + i, 145.0), (95 + i, 225.0)):
            model.add(
                bearing,
                "rolling_bearing_with_catalog_geometry",
                position=(u, *position),
                bearing_type=("cylindrical_roller_bearing", NONE),
                width=(80.0, MM),
                radial_stiffness=(8.5e9, "N / m"),
                axial_stiffness=(5e8, "N / m"),
                radial_dynamic_load_rating=(1200.0, "kN"),
                operating_radial_bearing_clearance=(80.0, "mum"),
            )
            model.join("side", assembly=bearing, inner_part=80 + i, outer_part=70 + i)
    for number, kind, shaft, teeth, position, width, tip, helix in gears:
        model.add(
            number,
            kind,
            position=position,
            number_of_teeth=(teeth, NONE),
            face_width=(width, MM),
            tip_diameter=(tip, MM),
            normal_module=(10.0, MM),
            helix_angle_reference_diameter=(helix, "deg"),
        )
        model.join("assembly", assembly=shaft, part=number)
        model.add(number + 1000, "cylindrical_gear_flank", normal_pressure_angle=(20.0, "deg"))
        model.join("flank", gear=number, left=number + 1000, right=number + 1000)
    for i in range(3):
        for mesh, first, second, stiffness in (
            (100 + i, 50, 60 + i, 15.0),
            (110 + i, 60 + i, 51, 18.0),
        ):
            model.add(
                mesh,
                "cylindrical_stage",
                center_distance=(308.0, MM),
                common_face_width=(220.0, MM),
                mean_mesh_stiffness_for_transverse_load_iso_6336_2019=(stiffness, "N / (mm mum)"),
                minimum_normal_backlash=(0.2, MM),
                maximum_normal_backlash=(0.4, MM),
            )
            model.join("assembly", assembly=4, part=mesh)
            model.join("stage", stage=mesh, gear_1=first, gear_2=second)
    for number, u, shaft, stiffness in ((120, -60.0, 10, 6e9), (121, 380.0, 11, 5e9)):
        model.add(
            number,
            "concept_bearing",
            position=(u, 0.0, 0.0),
            radial_stiffness=(stiffness, "N / m"),
            axial_stiffness=(8e8, "N / m"),
            width=(56.0, MM),
        )
        model.join("side", assembly=number, inner_part=shaft, outer_part=2)
    model.cases = [
        {
            "id": k,
            "components": [
                {
                    "id": 40,
                    "type": "external_load",
                    "attributes": [
                        {"id": "torque_around_u_axis", "unit": "N m", "value": torque},
                        {"id": "force_w_direction", "unit": "N", "value": force},
                    ],
                }
            ],
        }
        for k, torque, force in ((1, 360e3, 0.0), (2, 180e3, -2e4))
    ]
    return model
