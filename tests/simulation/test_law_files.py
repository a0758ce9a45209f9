"""Law files: one format for every kind, class and type of part, read as written or refused."""

import re
from dataclasses import fields, replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.simulation.carrier.measured_laws.rim_patterns import RIM_PATTERNS
from carrierflex.simulation.law_files import read_law, write_law
from carrierflex.simulation.laws import (
    BOTH,
    CARRIER,
    EFFECT_CLASSES,
    ELEMENT,
    MOUNTING,
    PORT,
    STARBOARD,
    TERM_TYPES,
    Branch,
    Friction,
    Law,
    Loop,
    Stop,
    Surface,
    Table,
    Wave,
)

AXIAL, RADIAL = "axial_displacement", "radial_displacement"
X, V = np.linspace(-1e-3, 1e-3, 5), np.linspace(-0.1, 0.1, 7)
R = np.linspace(0.0, 1e-3, 21)
DEFLECTION = {"deflection": (-1e-3, 2e-3)}
SIZE = {"deflection": (0.0, 2e-3)}
LOADS = {"torque": (0.0, 4e5), "ntl_y": (-1e5, 1e5), "ntl_z": (-2e5, 2e5)}
RIG = {"n_planets": 3, "sensor_radius": 0.412}
STOP = Stop(ELEMENT, 3e-4, slip=3.0, half_range=1e-3)
LEVELS = Friction(ELEMENT, x=X, level=np.full(5, 3.0))
Y = 3.0 + 1e3 * X[:, None] + 20.0 * V + 4e4 * X[:, None] * V


def law_of(kind, effect_class, *terms, visited=None):
    """Law with all that a file holds beside its parts."""
    units = ('"V"', "mm\\s") if kind == ELEMENT else ("N", "m")
    rig = RIG if kind == CARRIER else {}
    return Law("own", kind, effect_class, units, terms, visited or {}, rig, 'rig "A"\\')


def still(order=0, lobes=1):
    """Wave that follows nothing."""
    return Wave(AXIAL, order, lobes, "none", np.array([2e-5]), np.zeros(1))


TORQUES, LOAD = np.array([1e5, 2.5e5, 4e5]), np.array([0.0, 1e5])
TILT = law_of(
    CARRIER,
    "housing/tilt",
    still(),
    Wave(AXIAL, 0, 1, "torque", TORQUES * 1e-10, TORQUES * 2e-10, TORQUES),
    Wave(RADIAL, 0, 1, "radial_load", LOAD * 1e-10, LOAD * 0.0, LOAD, "yz"),
    Wave(RADIAL, 0, 1, "load_sharing", LOAD * 1e-16, LOAD * 0.0, LOAD, "z"),
    Wave(AXIAL, 0, 1, "time", np.array([0.0, 1e-5]), np.zeros(2), np.array([0.0, 1.0])),
    visited=LOADS,
)
SPRING = law_of(ELEMENT, "restoring_force", Table(ELEMENT, X, 1e3 * X))
RUBBING = law_of(ELEMENT, "dissipation", Table(ELEMENT, V, V), Friction(ELEMENT, 1.5, 2.5))
SLIPPING = law_of(
    ELEMENT,
    "hysteresis",
    STOP,
    Stop(ELEMENT, 2e-4, middle=-2e-4, inner=1.0, slip_outside=2.0),
    Loop(ELEMENT, 2e-3, 3.0, 1.3 - np.linspace(-1.0, 1.0, 9)),
    visited=DEFLECTION,
)
RELAXING = law_of(
    ELEMENT, "memory", Branch(ELEMENT, 0.1, 5.0), Branch(ELEMENT, 0.7, 0.0), visited=DEFLECTION
)
SURFACE = law_of(ELEMENT, "force_surface", Surface(ELEMENT, X, V, Y), LEVELS, STOP)
BUSHINGS = law_of(
    MOUNTING,
    "restoring_force",
    Table(STARBOARD, R, 2e6 * R, "radial"),
    Table(BOTH, np.linspace(-1e-3, 1e-3, 3), np.array([-1.0, 0.0, 2.0]), "apart"),
)
BUSHING_STOPS = law_of(
    MOUNTING,
    "hysteresis",
    Stop(BOTH, 1e-4, 3.0, "radial"),
    Stop(PORT, 2e-4, 5.0, "apart"),
    Stop(STARBOARD, 3e-4, 1.0, "smooth"),
    visited=SIZE,
)
LAWS = {
    "spring": SPRING,
    "rubbing": RUBBING,
    "coupled": law_of(ELEMENT, "coupled_damping", Table(ELEMENT, X, X**2)),
    "slipping": SLIPPING,
    "relaxing": RELAXING,
    "surface": SURFACE,
    "surface without friction": law_of(ELEMENT, "force_surface", Surface(ELEMENT, X, V, Y)),
    "bushings": BUSHINGS,
    "bushings, g(v)": law_of(MOUNTING, "dissipation", Table(PORT, R, R, "radial")),
    "bushings, h(u) v": law_of(MOUNTING, "coupled_damping", Table(BOTH, R, R + 1.0, "radial")),
    "bushing stops": BUSHING_STOPS,
    "bushing branches": law_of(
        MOUNTING, "memory", Branch(STARBOARD, 0.1, 5.0), Branch(BOTH, 0.7, 0.0), visited=SIZE
    ),
    "tilt": TILT,
    "offset": law_of(CARRIER, "housing/offset", still(lobes=0), visited=LOADS),
    "saddle": law_of(CARRIER, "housing/saddle", still(lobes=2), visited=LOADS),
    "planet pass": law_of(CARRIER, "housing/planet_pass", still(3, -1), visited=LOADS),
    "modulated": law_of(CARRIER, "housing/load_sharing", still(3, 2), visited=LOADS),
    "turning tilt": law_of(CARRIER, "carrier/tilt", still(1, 1), visited=LOADS),
    "waves": law_of(CARRIER, "carrier/waves", still(5, 5), visited=LOADS),
    "uneven": law_of(CARRIER, "carrier/load_sharing", still(2, 2), visited=LOADS),
}


def test_laws_of_every_class_and_parts_of_every_type_are_tried():
    classes = {(law.kind, law.effect_class) for law in LAWS.values()}
    of_bushings = set(EFFECT_CLASSES) - {"force_surface", *RIM_PATTERNS}
    assert classes == {
        *product([ELEMENT], of_bushings | {"force_surface"}),
        *product([MOUNTING], of_bushings),
        *product([CARRIER], RIM_PATTERNS),
    }
    assert {type(term) for law in LAWS.values() for term in law.terms} == set(TERM_TYPES)


@pytest.mark.parametrize("name", LAWS)
def test_a_law_is_read_as_it_was_written(name, tmp_path):
    law = LAWS[name]
    write_law(tmp_path / "law.toml", law)
    read = read_law(tmp_path / "law.toml")
    for key in ("name", "kind", "effect_class", "units", "visited", "rig", "measured_on"):
        assert getattr(read, key) == getattr(law, key)
    assert [type(each) for each in read.terms] == [type(each) for each in law.terms]
    for read_term, term in zip(read.terms, law.terms, strict=True):
        for key in fields(term):
            there, here = getattr(read_term, key.name), getattr(term, key.name)
            if isinstance(here, np.ndarray):
                # Values below 1e-12 of the largest are written as zero.
                assert_allclose(there, here, rtol=0.0, atol=1e-12 * abs(here).max(initial=0.0))
            else:
                assert there == here
    assert [path.name for path in tmp_path.iterdir()] == ["law.toml"]


def test_the_file_of_the_manual_is_a_law(tmp_path):
    page = (Path(__file__).parents[2] / "docs" / "own_effects.md").read_text(encoding="utf-8")
    example = re.search(r'```toml\n(format = "carrierflex-law".*?)```', page, re.DOTALL)
    (tmp_path / "law.toml").write_text(example[1], encoding="utf-8")
    law = read_law(tmp_path / "law.toml")
    assert [term.type for term in law.terms] == ["table", "friction"]
    assert law.units == ("N", "m")


def refused(law, old, new, folder):
    """What is told of the file of a law with `new` for the first `old`."""
    path = folder / "law.toml"
    write_law(path, law)
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(ValueError, match=f"^(\\d+ problems in )?{re.escape(str(path))}: ") as error:
        read_law(path)
    assert "\n" not in str(error.value)
    return str(error.value)


@pytest.mark.parametrize(
    ("name", "old", "new", "message"),
    [
        ("spring", "version = 3", "version = 4", "written by a newer version"),
        ("spring", "version = 3", "version = 1", "key 'version' is 1; expected 3"),
        ("spring", '"carrierflex-law"', '"carrierflex-memory-law"', "key 'format'"),
        ("spring", '"element"', '"gearbox"', "expected one of element, mounting, carrier"),
        ("spring", '"element"', '"mounting"', '[units]: "V" and mm\\s; expected N and m'),
        ("spring", "units", "unit", "did you mean 'units'?"),
        (
            "spring",
            '"restoring_force"',
            '"housing/tilt"',
            "is 'housing/tilt'; expected one of restoring_force, dissipation",
        ),
        ("spring", '"own"', '"Straight Spring"', "an id of small letters"),
        ("spring", '"table"', '"tabel"', "[[part]] 1: key 'type' is 'tabel'; expected one of"),
        ("spring", 'acts_on = "element"', 'acts_on = "port"', "'acts_on' is 'port'; expected one"),
        ("spring", 'acts_on = "element"\n', "", "[[part]] 1: missing key 'acts_on'"),
        ("spring", "x = [", 'plane = "apart"\nx = [', "key 'plane' of kind element; expected none"),
        ("spring", "    -0.001,", "    0.001,", "x[1] is -0.0005 after 0.001; expected increasing"),
        ("spring", "    -0.001,\n", "", "[[part]] 1: x has 4 and y 5 points"),
        ("spring", "    -0.001,", "    nan,", "finite numbers"),
        ("spring", "[[part]]", "[visited]\ndeflection = [0.0, 1.0]\n[[part]]", "expected none: "),
        ("spring", "[[part]]", "[rig]\nn_planets = 3\nsensor_radius = 1.0\n[[part]]", "[rig]"),
        ("rubbing", '"dissipation"', '"restoring_force"', "2: key 'type' is 'friction'; expected"),
        ("rubbing", "minus = 2.5", "minus = -2.5", "[[part]] 2: key 'minus' is -2.5; expected a"),
        ("rubbing", "minus = 2.5", "x = [0.0, 1.0]\nlevel = [0.0, 1.0]", "expected plus and minus"),
        ("slipping", '"hysteresis"', '"memory"', "key 'type' is 'stop'; expected branch, of memo"),
        ("slipping", "slip = 3.0", "slip = -3.0", "key 'slip' is -3.0; expected a number >= 0"),
        ("slipping", "half_range = 0.001", "half_range = 0.0", "a positive number"),
        ("slipping", "    -0.001,", "    0.5,", "deflection is 0.5 to 0.002; expected the least"),
        ("slipping", "[visited]", "[visitde]", "did you mean 'visited'?"),
        ("slipping", "stiffness = [", "stiffness = [\n    1.0,", "9 numbers > 0"),
        ("relaxing", "tau = 0.1", "tau = 0.0", "[[part]] 1: key 'tau' is 0.0; expected a positive"),
        ("relaxing", '"branch"', '"loop"', "[[part]] 1: unknown key 'tau'"),
        ("surface", "    -0.001,", "    0.001,", "x[1] is -0.0005 after 0.001"),
        ("surface", "    -0.1,", "    0.1,", "v[1] is -0.0666667 after 0.1; expected increasing"),
        (
            "surface",
            "    -0.001,\n",
            "",
            "y has 5 rows; expected one for each of the 4 values of x",
        ),
        ("surface", "    -0.1,\n", "", "row 0 of y has 7 values; expected one for each of the 6"),
        ("surface", "    3.0,\n    3.0,\n", "    3.0,\n", "x has 5 and level 4 points"),
        ("surface", "    3.0,\n    3.0,\n", "    -3.0,\n    3.0,\n", "a list of numbers >= 0"),
        ("surface", "level = [", "plus = 1.0\nlevel = [", "class force_surface; expected these"),
        ("bushings", '"radial"', '"around"', "expected one of apart, radial"),
        ("bushings", '"radial"', '"smooth"', "'smooth'; expected one of apart, radial"),
        ("bushings", '"starboard"', '"left"', "expected one of element, both, starboard, port"),
        ("bushings", "    0.0,\n    5e-05,", "    1e-05,\n    5e-05,", "x begins at 1e-05; expect"),
        (
            "bushings",
            "    0.0,\n    100.0,",
            "    3.0,\n    100.0,",
            "expected 0 of a radial force",
        ),
        ("bushings", "    -0.001,\n", "", "[[part]] 2: x has 2 and y 3 points"),
        ("bushing stops", '"hysteresis"', '"memory"', "key 'type' is 'stop'; expected branch"),
        ("bushing stops", '"radial"', '"around"', "one of apart, radial, smooth"),
        ("bushing stops", 'plane = "radial"\n', "", "key 'plane' is ''; expected one of apart"),
        ("bushing stops", "slip = 3.0", "slip = -3.0", "a number >= 0"),
        ("bushing stops", "slip = 3.0", "slip = 3.0\ninner = 1.0", "key 'inner' of a bushing"),
        ("bushing stops", "    0.002,", "    0.0,", "deflection is 0 to 0; expected the least"),
        ("bushing stops", "    0.0,\n    0.002,", "    -1.0,\n    0.002,", "expected its size"),
        ("tilt", '"housing/tilt"', '"carrier/tilt"', "[[part]] 1: order 0 with 1 lobes is no wave"),
        ("tilt", '"housing/tilt"', '"housing/waves"', "expected one of restoring_force"),
        ("tilt", '"torque"', '"speed"', "one of none, torque, radial_load"),
        ("tilt", '"yz"', '"xy"', "one of y, z, yy, yz, zz"),
        ("tilt", 'along = "yz"\n', "", "along is None and follows radial_load; expected a dir"),
        ("tilt", '"radial_load"', '"torque"', "along is yz and follows torque; expected no key"),
        ("tilt", '"torque"', '"none"', "x where nothing is followed; expected none"),
        ("tilt", '"none"', '"torque"', "no x; expected that of follows torque"),
        ("tilt", '"torque"', '"time"', "x is 100000 to 400000; expected 0 to 1, the run"),
        (
            "tilt",
            "    0.0,\n    100000.0,\n]\nal",
            "    1.0,\n    100000.0,\n]\nal",
            "x begins at 1",
        ),
        ("tilt", "    250000.0,\n", "    900000.0,\n", "x[2] is 400000 after 900000"),
        ("tilt", "    250000.0,\n", "", "[[part]] 2: cosine has 3 points; expected 2, those of x"),
        ("tilt", "    0.0,\n    1e-05,", "    2.0,\n    1e-05,", "cosine begins at 2; expected 0"),
        ("tilt", "n_planets = 3", "n_planets = 99", "[rig]: key 'n_planets' is 99; expected"),
        ("tilt", "sensor_radius = 0.412", "sensor_radius = -1", "key 'sensor_radius' is -1"),
        ("tilt", "lobes = 1", "lobes = 2", "order 0 with 2 lobes is no wave of housing/tilt"),
        ("tilt", "    2e-05,\n", "    nan,\n", "a list of 1 to 10000 finite numbers"),
        ("tilt", "order = 0", "order = 65", "a whole number, 0 to 64"),
        ("tilt", "ntl_y", "ntl_x", "[visited]: unknown key 'ntl_x'"),
    ],
)
def test_a_damaged_file_is_refused_by_its_key(name, old, new, message, tmp_path):
    assert message in refused(LAWS[name], old, new, tmp_path)


@pytest.mark.parametrize(
    ("law", "message"),
    [
        (replace(TILT, terms=()), "key 'part' is []; expected at least one table"),
        (replace(TILT, visited={}), "[visited] has no key; expected torque, ntl_y, ntl_z"),
        (replace(TILT, rig={}), "missing table [rig]; expected n_planets and sensor_radius"),
        (replace(TILT, visited={**LOADS, "torque": (4e5, 1e5)}), "torque is 400000 to 100000"),
        (
            replace(SPRING, terms=SPRING.terms * 2),
            "2 tables [[part]] of type table; expected 1 to 1",
        ),
        (
            replace(RELAXING, terms=RELAXING.terms[:1] * 101),
            "101 tables [[part]] of type branch; expected 0 to 100",
        ),
        (
            replace(RUBBING, terms=RUBBING.terms[1:]),
            "0 tables [[part]] of type table; expected 1 to 1",
        ),
        (
            replace(SURFACE, terms=SURFACE.terms[1:]),
            "0 tables [[part]] of type surface; expected 1 to 1",
        ),
    ],
)
def test_what_is_no_law_is_refused(law, message, tmp_path):
    write_law(tmp_path / "law.toml", law)
    with pytest.raises(ValueError, match="expected") as error:
        read_law(tmp_path / "law.toml")
    assert message in str(error.value)
