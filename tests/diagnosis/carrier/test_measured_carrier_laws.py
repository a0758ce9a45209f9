"""A measured shape of a carrier kept as a law explains its class on new records of the rig."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.carrier.classes.class_rows import class_rows, load_functions, shapes
from carrierflex.diagnosis.carrier.classes.measured_laws import (
    VisitedLoads,
    _tabulated_waves,
    carrier_law_of_answer,
)
from carrierflex.diagnosis.carrier.problem import carrier_problem
from carrierflex.diagnosis.carrier.records.columns import ColumnSource
from carrierflex.diagnosis.classes.results import (
    LEADING_CLASS,
    NAMED_CLASS,
    ClassAnswer,
    ClassFinding,
)
from carrierflex.diagnosis.inference.effect_fit import fit_effects
from carrierflex.diagnosis.kinds import problem_of, saved_law
from carrierflex.simulation.carrier.measured_laws.carrier_laws import law_signal
from carrierflex.simulation.carrier.rim import CarrierInputs, RimSensor
from carrierflex.simulation.law_files import read_law, write_law
from carrierflex.simulation.laws import CARRIER, Law, Wave
from tests.diagnosis.carrier.carrier_twin import CARRIER_RIG, CHANNELS, CURVES, KNOWN, twin_campaign

AXIAL = CHANNELS[:4]
SIZE = 4e-5
#: Torque over nominal and radial load [N]; new records lie between those of the first.
FIRST = (
    (1.0, 0, 0),
    (0.5, 0, 0),
    (1.0, 0, -2e5),
    (1.0, 1e5, 1e5),
    (0.75, 0, 5e4),
    (0.25, -5e4, 0),
    (0.5, -1.5e5, 1e5),
    (0.75, 1.2e5, -8e4),
)
NEXT = (
    (0.9, 0, 0),
    (0.4, 0, 0),
    (0.9, 1e4, -1.5e5),
    (0.8, 8e4, 1.1e5),
    (0.6, 0, 6e4),
    (0.3, -6e4, 1e4),
)


def turned(v, run):
    """Angle of a sensor on the carrier."""
    return v - run.inputs["carrier_angle"]


def bounded(run):
    """Share of a size that grows up to 60 % of the torque and stays."""
    return np.minimum(run.inputs["torque"] / 360e3, 0.6) / 0.6


def along_load(v, run, height):
    """Tilt of the housing along the radial load, as high as a function of its size over 200 kN."""
    y, z = run.inputs["ntl_y"], run.inputs["ntl_z"]
    size = np.hypot(y, z)
    share = height(size / 2e5) / np.maximum(size, 1.0)
    return SIZE * share * (-np.sin(v) * y + np.cos(v) * z)


CAUSES = {
    "tilt that saturates": (
        "housing/tilt/radial_load",
        lambda v, run: along_load(v, run, lambda s: 1.5 * s / (s + 0.3)),
    ),
    "tilt beyond a load": (
        "housing/tilt/radial_load",
        lambda v, run: along_load(v, run, lambda s: 2.0 * np.maximum(s - 0.15, 0.0)),
    ),
    "saddle of the torque squared": (
        "housing/saddle/torque",
        lambda v, run: SIZE * np.cos(2.0 * v - 1.6) * (run.inputs["torque"] / 360e3) ** 2,
    ),
    "lobes of the planets": (
        "carrier/waves/torque",
        lambda v, run: (
            SIZE
            * bounded(run)
            * (np.cos(3.0 * turned(v, run) + 0.4) + 0.7 * np.sin(9.0 * turned(v, run)))
        ),
    ),
    "bent face": (
        "carrier/waves/none",
        lambda v, run: SIZE * np.abs(np.cos(turned(v, run) + 0.3)),
    ),
    "drift": (
        "housing/offset/time",
        lambda v, run: SIZE * 3.0 * (1.0 - np.exp(-3.0 * run.time / run.time[-1])),
    ),
}


def campaign_of(signal, **options):
    """Campaign with one more signal of (sensor angle, run)."""
    campaign = twin_campaign(None, channels=AXIAL, contained=tuple(KNOWN), **options)
    runs = []
    for run in campaign.runs:
        signals = {
            channel.name: run.signals[channel.name] + signal(channel.angle, run)
            for channel in campaign.channels
        }
        runs.append(replace(run, signals=signals))
    return replace(campaign, runs=tuple(runs))


def saved(signal, path, **options):
    """Answer by class of first records, and its law as a file holds it."""
    first = campaign_of(signal, loads=FIRST, turns=6, **options)
    answer = carrier_problem(first, CURVES).class_answer()
    write_law(path, saved_law(first, answer, None))
    return answer, read_law(path)


@pytest.mark.long
@pytest.mark.parametrize("cause", CAUSES)
def test_a_saved_law_explains_its_class_on_new_records(cause, tmp_path):
    name, signal = CAUSES[cause]
    answer, law = saved(signal, tmp_path / "law.toml")
    assert (answer.state, answer.ids) == (NAMED_CLASS, (name,))
    problem = carrier_problem(campaign_of(signal, loads=NEXT, turns=6, seed=7), CURVES, (law,))
    result = problem.class_answer()
    # Of a class of the same frame and pattern the law is the nearest one.
    assert all(entry.law == law.name for entry in result.classes if entry.id == name)
    noise = problem.noise_square.sum()
    before = fit_effects(problem, ()).sums.square.sum() - noise
    fit = fit_effects(problem, (law.name,))
    share = 1.0 - (fit.sums.square.sum() - noise) / before
    assert share > 0.98 * result.share
    assert fit.theta[-1] == pytest.approx(1.0, abs=0.1)


RIG = {"n_planets": 3, "sensor_radius": 0.412}


def tilt_law(**changes):
    """Law of a tilt that grows as the torque."""
    x = np.array([9e4, 3.6e5])
    waves = (Wave("axial_displacement", 0, 1, "torque", 1e-10 * x, 0.0 * x, x),)
    visited = {"torque": (9e4, 3.6e5), "ntl_y": (-1e5, 1e5), "ntl_z": (-2e5, 1e5)}
    law = Law("bent", CARRIER, "housing/tilt", ("N", "m"), waves, visited, RIG, "rig")
    return replace(law, **changes)


def answer(*findings, state=NAMED_CLASS):
    """Answer of some classes: id, share and law of each."""
    nan = float("nan")
    interval = (0.0, 1.0)
    classes = tuple(
        ClassFinding(name, share, interval, "", nan, law_named=False, measured_law=law)
        for name, share, law in findings
    )
    return ClassAnswer(state, classes, (), {}, 0.9, interval, 0.9, (), nan, {})


def test_the_law_of_the_largest_share_is_kept_or_that_which_is_asked_for():
    waves = tilt_law(effect_class="carrier/waves")
    pair = answer(
        ("housing/tilt/torque", 0.6, tilt_law(name="")), ("carrier/waves/none", 0.3, waves)
    )
    law = carrier_law_of_answer(pair, "Rig 7: twin")
    assert (law.name, law.measured_on) == ("housing_tilt_of_rig_7_twin", "Rig 7: twin")
    assert carrier_law_of_answer(pair, "rig", "carrier/waves").effect_class == "carrier/waves"
    with pytest.raises(ValueError, match="'carrier/tilt' is not in the answer; expected housing"):
        carrier_law_of_answer(pair, "rig", "carrier/tilt")


@pytest.mark.parametrize(
    ("refused", "reason"),
    [
        (answer(state="nothing"), "the answer by class is 'nothing'"),
        (
            answer(("channel/gain/none", 0.9, None), state=LEADING_CLASS),
            "'channel/gain/none' cannot be saved as a law; expected one of housing/offset, "
            "housing/t",
        ),
        (
            answer(("clock/delay/none", 0.6, None), ("housing/tilt/torque", 0.3, tilt_law())),
            "'clock/delay/none' cannot be saved as a law; expected one of housing/tilt$",
        ),
        (
            answer(("carrier/waves/undetermined", 0.9, None)),
            "load dependence of 'carrier/waves' cannot be determined from these records; expected "
            "three torques or more",
        ),
        (
            answer(("housing/tilt/torque", 0.9, None)),
            "the shape of 'housing/tilt' was not supported",
        ),
    ],
)
def test_what_cannot_be_kept_is_refused_by_name(refused, reason):
    with pytest.raises(ValueError, match=f"^no law to save: .*{reason}"):
        carrier_law_of_answer(refused, "rig")


def test_a_law_of_a_carrier_is_for_carriers():
    campaign = SimpleNamespace(name="rig", kind="mounting")
    with pytest.raises(ValueError, match="of kind mounting; law 'bent' is of a carrier"):
        problem_of(campaign, None, (tilt_law(),))


def short_campaign():
    """Three short runs of two sensors."""
    loads = ((1.0, 0, 0), (0.5, 0, -1e5), (0.25, 5e4, 0))
    return twin_campaign(loads=loads, turns=2, channels=AXIAL[:2])


def test_a_law_of_another_rig_or_that_stands_twice_is_refused():
    with pytest.raises(ValueError, match="law 'bent' is of a carrier with 4 planets"):
        problem_of(short_campaign(), CURVES, (tilt_law(rig={**RIG, "n_planets": 4}),))
    with pytest.raises(ValueError, match="'bent' of kind carrier is registered twice"):
        problem_of(short_campaign(), CURVES, (tilt_law(), tilt_law()))


def test_records_that_leave_the_loads_of_a_law_are_told():
    low = tilt_law(visited={"torque": (9e4, 2e5), "ntl_y": (0.0, 0.0), "ntl_z": (0.0, 0.0)})
    problem = problem_of(short_campaign(), CURVES, (low,))
    # It follows no radial load; two runs of three have a torque within its table.
    (warning,) = problem.beyond_visited(low)
    assert (warning.check, warning.about, warning.line) == ("visited_range", "bent", "run run1")
    assert warning.figure == pytest.approx(1.0 / 3.0)
    assert "its table from 90 kN m to 200 kN m" in warning.text
    assert problem.beyond_visited(tilt_law()) == ()
    vector = replace(low.terms[0], follows="radial_load", along="y")
    (warning,) = problem.beyond_visited(replace(low, terms=(vector,)))
    assert "N along" in warning.text


def test_the_effect_of_a_law_is_the_signal_of_the_simulator():
    law = tilt_law()
    campaign = short_campaign()
    problem = carrier_problem(campaign, CURVES, (law,))
    run, channel = campaign.runs[1], campaign.channels[1]
    inputs = CarrierInputs(run.time, *run.inputs.values(), start=run.time[0], end=run.time[-1])
    sensor = RimSensor(channel.angle, channel.radius, is_axial=True)
    (column,) = problem.model.effects["bent"].signals(sensor, inputs, CARRIER_RIG)
    assert_allclose(column, law_signal(law, sensor, inputs), rtol=1e-14)


@pytest.mark.long
@pytest.mark.parametrize("n_planets", [3, 5])
def test_tables_of_a_class_are_its_columns_where_they_have_points(n_planets):
    """Loads that stand still, at points of the tables: every shape in every way to follow them."""
    rng = np.random.default_rng(n_planets)
    scale = np.array([360e3, 2e5, 2e5])
    loads = np.array([[9e4, 0.0, 0.0], [3.6e5, 1.2e5, -1.6e5], [2.25e5, -3e4, 4e4]])
    rig = replace(CARRIER_RIG, n_planets=n_planets)
    rows = class_rows(CHANNELS, rig, loads / scale, 4)
    quantities = ("axial_displacement", "radial_displacement")
    weights = {name: group_columns.weights for name, group_columns in rows.groups.items()}
    visited = VisitedLoads(loads, scale, 4, quantities, n_planets, 0.412, weights)
    source = ColumnSource(rig, {}, 2.0, 2e5)
    time = np.linspace(0.0, 5.0, 30)
    one = np.ones_like(time)
    functions = load_functions(4)
    for shape in shapes():
        for dependence, columns_of in shape.columns.items():
            group = f"{shape.id}:{dependence}"
            columns_of_group, _ = rows.rows_of_groups[group]
            columns = columns_of(quantities, n_planets)
            dependence_functions = functions[dependence].functions
            c = rng.uniform(-1.0, 1.0, (len(dependence_functions), len(weights[group])))
            waves = _tabulated_waves(
                dependence, dependence_functions, c @ weights[group], columns, visited
            )
            law = tilt_law(effect_class=shape.id, terms=tuple(waves))
            for k, load in enumerate(loads):
                inputs = CarrierInputs(time, 2.0 * time, *(load[:, None] * one), 0.0, 5.0)
                features = source._flexible_rows(inputs)
                signals = c.ravel() @ np.swapaxes(rows.of_run(k)[columns_of_group] @ features, 0, 1)
                for channel, expected in zip(CHANNELS, signals, strict=True):
                    sensor = RimSensor(channel.angle, 0.412, channel.quantity == quantities[0])
                    # The slope of a class's functions within a run is a difference quotient.
                    assert_allclose(law_signal(law, sensor, inputs), expected, rtol=1e-9, atol=1e-9)
