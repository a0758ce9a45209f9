"""Classes of a carrier: frame and pattern, and what they follow, for laws outside the library."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.carrier.classes.answer import carrier_class_table
from carrierflex.diagnosis.carrier.classes.class_rows import (
    class_rows,
    load_functions,
    shapes,
    torque_levels,
)
from carrierflex.diagnosis.carrier.problem import carrier_problem
from carrierflex.diagnosis.classes.results import NAMED_CLASS, NOTHING
from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.diagnosis.report.diagnosis_files import diagnosis_document
from carrierflex.diagnosis.report.verdict_words import verdict_heading
from carrierflex.simulation.carrier.measured_laws.rim_patterns import (
    BY_BOTH,
    BY_RADIAL_LOAD,
    MODULATED,
    TILT,
)
from tests.diagnosis.carrier.carrier_twin import (
    CARRIER_RIG,
    CHANNELS,
    CURVES,
    KNOWN,
    LOADS,
    twin_campaign,
)

AXIAL = CHANNELS[:4]
SIZE = 4e-5


def three_lobes(angle, torque):
    """Lobes of no pin's shape, which grow up to 60 % of the torque and stay."""
    height = np.minimum(torque / 360e3, 0.6)
    return SIZE * height * (np.cos(3.0 * angle + 0.4) + 0.7 * np.sin(9.0 * angle))


def campaign_of(signal, **options):
    """Campaign with one more signal of (sensor angle, run)."""
    options = {"contained": tuple(KNOWN), **options}
    campaign = twin_campaign(None, channels=AXIAL, turns=6, **options)
    runs = []
    for run in campaign.runs:
        signals = {
            channel.name: run.signals[channel.name] + signal(channel.angle, run)
            for channel in campaign.channels
        }
        runs.append(replace(run, signals=signals))
    return replace(campaign, runs=tuple(runs))


def lobed(v, run):
    """Three lobes that turn with the carrier."""
    return three_lobes(v - run.inputs["carrier_angle"], run.inputs["torque"])


def tilt_that_bends(v, run):
    """Tilt of the housing along the radial load, as its square root."""
    y, z = run.inputs["ntl_y"], run.inputs["ntl_z"]
    size = np.hypot(y, z)
    share = np.sqrt(size / 2e5) / np.maximum(size, 1.0)
    return SIZE * share * (-np.sin(v) * y + np.cos(v) * z)


def bent_face(v, run):
    """Two kinks on the carrier's face, whatever the load."""
    turned = v - run.inputs["carrier_angle"]
    return SIZE * np.abs(np.cos(turned + 0.3))


def saddle_of_squared_torque(v, run):
    """Saddle of the housing that grows as the torque squared."""
    return SIZE * np.cos(2.0 * v - 1.6) * (run.inputs["torque"] / 360e3) ** 2


#: Size of a cause beside another.
SMALL = 0.08
TRUTHS = {
    "carrier/waves/torque": lobed,
    "housing/tilt/radial_load": tilt_that_bends,
    "carrier/waves/none": bent_face,
    "housing/saddle/torque": saddle_of_squared_torque,
}


def answer_of(signal, **options):
    """Answer by class alone."""
    return carrier_problem(campaign_of(signal, **options), CURVES).class_answer()


@pytest.mark.long
@pytest.mark.parametrize("name", TRUTHS)
def test_frame_pattern_and_load_are_named_where_no_law_is_right(name):
    answer = answer_of(TRUTHS[name])
    assert answer.state == NAMED_CLASS
    assert answer.ids == (name,)
    assert answer.ties == ()


@pytest.mark.long
def test_a_small_cause_beside_a_large_one_is_one_too():
    # A sixtieth of the gap: less than what a second cause of an element has to gain.
    answer = answer_of(lambda v, run: lobed(v, run) + SMALL * saddle_of_squared_torque(v, run))
    assert answer.ids == ("carrier/waves/torque", "housing/saddle/torque")
    assert 0.011 < answer.classes[1].share < 0.024


@pytest.mark.long
def test_nothing_is_named_where_nothing_is_missing():
    assert answer_of(lambda v, run: 0.0 * run.time).state == NOTHING


@pytest.mark.long
def test_offsets_of_the_runs_that_the_baseline_lacks_hide_no_other_class():
    without = tuple(name for name in KNOWN if name != "axial_offset")
    answer = answer_of(lobed, contained=without)
    assert answer.ids == ("carrier/waves/torque",)
    assert "offset of every run" in answer.note
    assert answer.classes_of_law["axial_offset"] == ("housing/offset/none",)
    assert answer.classes_of_law["thermal_drift"] == ("housing/offset/time",)
    assert answer_of(lambda v, run: 0.0 * run.time, contained=without).state == NOTHING


@pytest.mark.long
def test_two_torques_leave_open_what_a_class_follows():
    answer = answer_of(lobed, loads=((1.0, 0, 0), (0.5, 0, 0), (1.0, 0, -2e5)))
    assert answer.ids == ("carrier/waves/undetermined",)
    assert "fewer than three torques" in answer.note


@pytest.mark.long
def test_a_class_beyond_the_library_is_the_verdict_and_stands_in_the_files():
    possible = {*KNOWN, "stiff_pins", "housing_tilt"}
    campaign = campaign_of(lobed)
    problem = carrier_problem(campaign, CURVES)
    others = tuple(name for name in problem.cards if name not in possible)
    baseline = replace(campaign.baseline, impossible=others)
    problem = carrier_problem(replace(campaign, baseline=baseline), CURVES)
    diagnosis = diagnose(problem, campaign="lobes", kind="carrier")
    document = diagnosis_document(diagnosis)
    assert document["verdict"] == "class_named"
    assert [entry["id"] for entry in document["classes"]] == ["carrier/waves/torque"]
    assert list(document["effects"]) == []
    assert "waves fixed to the carrier" in verdict_heading(diagnosis)


def test_functions_of_the_torque_vanish_without_torque_and_are_as_many_as_torques_tell():
    still = np.zeros(1)
    for n_torques, n_powers in ((1, 1), (3, 2), (4, 3), (6, 3)):
        powers = load_functions(n_torques)["torque"]
        assert len(powers.functions) == len(powers.penalty) == n_powers
        assert all(function(still, still, still) == 0.0 for function in powers.functions)
    assert torque_levels(np.array([1.0, 1.01, 0.5, 0.99])) == 2
    assert torque_levels(np.array([share for share, *_ in LOADS])) == 4


@pytest.mark.long
def test_of_more_runs_than_blocks_those_of_a_condition_share_one(monkeypatch):
    """Each run's own parameters are taken out of the run before: the sums of all stay."""
    conditions = [str(k % 3) for k in range(len(LOADS))]
    campaign = twin_campaign(None, channels=CHANNELS[:3], turns=3)
    runs = tuple(
        replace(run, condition=condition)
        for run, condition in zip(campaign.runs, conditions, strict=True)
    )
    problem = carrier_problem(replace(campaign, runs=runs), CURVES)

    def table():
        candidates = ("flange_warp",)
        base = problem.starts((), {})[-1]
        return carrier_class_table(
            problem.model, problem.campaign, problem.records, problem.noise, candidates, base
        ).table

    usual = table()
    assert len(usual.gram) >= len(runs)
    where = "carrierflex.diagnosis.carrier.classes.answer"
    monkeypatch.setattr(f"{where}._FEWEST_BLOCKS", 5)
    # Memory for the products of five blocks: not for those of every run.
    monkeypatch.setattr(f"{where}.IN_MEMORY", 5.5 * usual.gram[0].nbytes)
    merged = table()
    assert 3 <= len(merged.gram) <= 5
    assert_allclose(merged.floor.sum(), usual.floor.sum(), rtol=1e-12)
    result, expected = merged.gram.sum(axis=0), usual.gram.sum(axis=0)
    assert_allclose(result, expected, atol=1e-10 * np.abs(expected).max())
    assert len(np.unique(merged.folds)) == len(np.unique(usual.folds))


def late_tilt(v, run):
    """Nothing up to a fifth of the largest load, beyond it a tilt of the housing along the load."""
    y, z = run.inputs["ntl_y"], run.inputs["ntl_z"]
    size = np.hypot(y, z)
    share = np.maximum(size / 2e5 - 0.2, 0.0) / np.maximum(size, 1.0)
    return SIZE * share * (-np.sin(v) * y + np.cos(v) * z)


@pytest.mark.long
def test_a_tilt_that_begins_late_is_no_sharing_that_follows_torque_and_load():
    answer = carrier_problem(campaign_of(late_tilt), CURVES).class_answer()
    assert [entry.id for entry in answer.classes] == ["housing/tilt/radial_load"]


@pytest.mark.parametrize(("pattern", "dependence"), [(TILT, BY_RADIAL_LOAD), (MODULATED, BY_BOTH)])
@pytest.mark.parametrize("n_planets", [3, 4])
@pytest.mark.parametrize("curves", [CURVES, {}], ids=["curve of a pin", "no curve"])
def test_a_pattern_that_turns_with_the_radial_load_costs_no_more_than_its_bends(
    pattern, dependence, n_planets, curves
):
    """Turning housing angle, carrier and load by one angle changes nothing of what costs least."""
    quantities = ("axial_displacement", "radial_displacement")
    shape = next(candidate for candidate in shapes() if candidate.id == pattern)
    columns = shape.columns[dependence](quantities, n_planets)
    loads = load_functions(4)[dependence]
    rig = replace(CARRIER_RIG, n_planets=n_planets, curves=curves)
    group = class_rows(CHANNELS, rig, np.zeros((1, 3)), 4).groups[f"{pattern}:{dependence}"]
    sums = group.weights
    n = 2 * loads.n_vectors * len(sums)
    bends = np.kron(np.diag(loads.penalty), np.eye(len(sums)))
    beside_bends = (group.penalty - bends)[:n, :n]
    values, vectors = np.linalg.eigh(beside_bends)
    is_free = values < 1e-9 * values[-1]
    assert is_free.sum() == n // 2

    def signal(c, v, theta, size, direction):
        """Of all columns at a housing angle, carrier angle and load."""
        y, z = -size * np.sin(direction), size * np.cos(direction)
        functions = [function(0.8, np.array(y), np.array(z)) for function in loads.functions]
        waves = []
        for column in columns:
            cosine, sine = column.over(np.array([v]))
            phase = column.order * theta
            waves.append(float(cosine[0] * np.cos(phase) + sine[0] * np.sin(phase)))
        return c @ np.outer(functions[: 2 * loads.n_vectors], sums @ waves).ravel()

    rng = np.random.default_rng(n_planets)
    for weights, turns in ((is_free, True), (~is_free, False)):
        c = vectors[:, weights] @ rng.standard_normal(int(weights.sum()))
        before = signal(c, 0.3, 0.9, 0.6, 0.5)
        after = signal(c, 0.3 + 1.1, 0.9 + 1.1, 0.6, 0.5 + 1.1)
        assert bool(abs(after - before) < 1e-12) is turns
