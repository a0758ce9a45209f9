"""Watch of a turbine: what an alarm names, what is none; pieces and restarts change nothing."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.diagnosis.carrier.watch.rim_revolutions import RevolutionSplitter
from carrierflex.diagnosis.carrier.watch.state_files import read_state, write_state
from carrierflex.diagnosis.carrier.watch.turbine_watch import TurbineWatch, WatchOptions
from tests.diagnosis.carrier.watch.turbines import NOISE, effect_signal, record, turbine

BASELINE = turbine()
OPTIONS = WatchOptions(learn=100)
SINCE, N = 115, 150
TILT = 3.0 * NOISE * np.sqrt(2.0) / 0.412  # of three floors [rad]


def watched(columns, pieces=(), watch=None):
    """Watch that has taken a record, cut at some samples."""
    watch = watch or TurbineWatch(BASELINE, OPTIONS)
    splitter = RevolutionSplitter()
    n = columns["time"].size
    for first, end in zip([0, *pieces], [*pieces, n], strict=True):
        piece = {name: values[first:end] for name, values in columns.items()}
        for turn, file in splitter.turns(piece):
            watch.take(turn, file)
    return watch


def adding(effect, *coefficients):
    def cause(columns, signals):
        return signals + effect_signal(BASELINE, columns, effect, coefficients)

    return cause


def scaled(channel, factor):
    def cause(columns, signals):
        changed = signals.copy()
        changed[channel] *= factor
        return changed

    return cause


def moved(columns, signals):
    """Signals with one sensor six degrees off."""
    off = replace(BASELINE, moves={"s137": np.deg2rad(6.0)})
    return np.concatenate([signals[:1], off.prediction(columns)[1:2], signals[2:]])


def late(columns, signals):
    """Signals that all come late."""
    return replace(BASELINE, delay=0.02).prediction(columns)


def exchanged(columns, signals):
    return signals[[0, 2, 1, 3]]


CHANGES = {
    "new tilt of the housing": (adding("housing_tilt", TILT, 0.0), "housing/tilt", ""),
    "new tilt by the load": (adding("ntl_tilt", 0, 0, TILT / 8e4, 0), "housing/tilt", ""),
    "new saddle": (adding("flange_warp", 15e-6), "housing/saddle", ""),
    "new waves of the face": (adding("face_runout", 12e-6, 0.0, 9e-6), "carrier/waves", ""),
    "new order of planets": (adding("ring_pass", 12e-6), "housing/planet_pass", ""),
    "tilt turned": (adding("carrier_tilt", 0.5 * TILT, TILT), "carrier/tilt", ""),
    "tilt grown": (adding("carrier_tilt", 0.4e-4, -0.28e-4), "carrier/tilt", "carrier_tilt"),
    "pins softer": (adding("flexible_pins", 0.4), "carrier/waves", "flexible_pins"),
    "offset": (adding("axial_offset", 9e-6), "housing/offset", ""),
    "gain": (scaled(1, 1.6), "channel/gain", ""),
    "angle of a sensor": (moved, "channel/angle", ""),
    "late": (late, "clock/delay", ""),
    "reversed": (scaled(1, -1.0), "wiring/reversed", ""),
    "lost": (scaled(1, 0.0), "channel/lost", ""),
    "exchanged": (exchanged, "wiring/sensor_order", ""),
}


@pytest.mark.long
@pytest.mark.parametrize("name", CHANGES)
def test_an_alarm_names_class_begin_and_size_of_a_change(name):
    cause, expected, effect = CHANGES[name]
    rng = np.random.default_rng(11)
    watch = watched(record(BASELINE, N, rng, cause, since=SINCE))
    assert len(watch.alarms) == 1
    alarm = watch.alarms[0]
    change = alarm.change
    assert (change.id, change.effect, list(change.ties)) == (expected, effect, [])
    assert change.is_fault == expected.startswith(("channel/", "clock/", "wiring/"))
    # Revolution k of the record is number k of the watch: the first, begun late, is omitted.
    assert alarm.since == SINCE
    assert alarm.revolution <= SINCE + 10
    assert not alarm.is_other_load
    if expected.startswith("wiring"):
        assert "s137" in alarm.channels
    columns = record(BASELINE, 20, rng)
    clean = BASELINE.prediction(columns)
    size = np.sqrt(np.mean((cause(columns, clean) - clean) ** 2))
    assert alarm.size == pytest.approx(size, abs=0.3 * NOISE)
    assert alarm.size_ci95[0] < size + 0.1 * NOISE
    assert alarm.size_ci95[1] > size - 0.1 * NOISE
    if effect:
        assert change.relative == pytest.approx(0.4 if effect == "carrier_tilt" else 0.5, abs=0.05)


def test_nothing_and_a_change_below_the_dead_band_are_no_alarm():
    rng = np.random.default_rng(12)
    small = adding("housing_tilt", 0.7 * TILT / 3.0, 0.0)
    assert watched(record(BASELINE, 2 * N, rng, small, since=SINCE)).alarms == []


def test_the_floor_is_that_of_the_noise():
    watch = watched(record(BASELINE, N, np.random.default_rng(13)))
    assert watch.floor == pytest.approx(NOISE, rel=0.03)
    assert watch.dead_band == watch.floor
    larger = TurbineWatch(BASELINE, replace(OPTIONS, remaining=5e-6))
    assert watched(record(BASELINE, N, np.random.default_rng(13)), watch=larger).dead_band == 5e-6


def test_a_second_change_is_a_second_alarm():
    rng = np.random.default_rng(14)

    def cause(columns, signals):
        later = columns["carrier_angle"] >= 2.0 * np.pi * (SINCE + 100)
        first = effect_signal(BASELINE, columns, "housing_tilt", (TILT, 0.0))
        second = effect_signal(BASELINE, columns, "carrier_tilt", (0.0, TILT))
        return signals + first + np.where(later, second, 0.0)

    watch = watched(record(BASELINE, SINCE + 140, rng, cause, since=SINCE))
    named = [(alarm.change.id, alarm.since) for alarm in watch.alarms]
    assert named == [("housing/tilt", SINCE), ("carrier/tilt", SINCE + 100)]


@pytest.mark.parametrize("value", [np.nan, 1.7e-5])
def test_a_dead_sensor_is_reported_as_one_and_the_others_are_watched(value):
    columns = record(
        BASELINE, 330, np.random.default_rng(15), adding("housing_tilt", TILT, 0.0), since=200
    )
    turn = columns["carrier_angle"] / (2.0 * np.pi)
    columns["s227"] = np.where((turn >= 130.2) & (turn < 260.7), value, columns["s227"])
    watch = watched(columns)
    silent, change, again = watch.alarms
    assert (silent.kind, list(silent.channels), silent.since) == ("silent_channel", ["s227"], 130)
    assert (change.kind, change.since) == ("change", 200)
    assert (again.kind, list(again.channels)) == ("channel_reads_again", ["s227"])
    assert watch.is_learning


def test_a_step_of_the_load_is_said_with_the_change():
    columns = record(
        BASELINE, N, np.random.default_rng(16), adding("housing_tilt", TILT, 0.0), since=SINCE
    )
    late = columns["carrier_angle"] >= 2.0 * np.pi * SINCE
    with_step = {**columns, "ntl_y": np.where(late, 1.5e5, columns["ntl_y"])}
    assert watched(with_step).alarms[0].is_other_load


@pytest.mark.long
def test_pieces_a_wrapped_angle_and_restarts_change_no_bit(tmp_path):
    cause = CHANGES["new tilt of the housing"][0]
    columns = record(BASELINE, N, np.random.default_rng(17), cause, since=SINCE)
    columns["s047"][5000:5003] = np.nan
    n = columns["time"].size
    unbroken = watched(columns)
    write_state(tmp_path / "unbroken.npz", unbroken, "key")
    expected = arrays(tmp_path / "unbroken.npz")
    rng = np.random.default_rng(18)
    watch = watched(columns, np.sort(rng.choice(n, 400, replace=False)).tolist())
    write_state(tmp_path / "pieces.npz", watch, "key")
    assert arrays(tmp_path / "pieces.npz") == expected
    # Killed at any sample: what the state has not taken is read again.
    watch = TurbineWatch(BASELINE, OPTIONS)
    for end in [*np.sort(rng.choice(n, 15, replace=False)).tolist(), n]:
        later = columns["time"] > watch.position
        later[end:] = False
        watched({name: values[later] for name, values in columns.items()}, watch=watch)
        write_state(tmp_path / "killed.npz", watch, "key")
        watch = read_state(tmp_path / "killed.npz", BASELINE, OPTIONS, "key")
    assert arrays(tmp_path / "killed.npz") == expected
    wrapped = {**columns, "carrier_angle": np.angle(np.exp(1j * columns["carrier_angle"]))}
    alarm = watched(wrapped).alarms[0]
    assert alarm.revolution == unbroken.alarms[0].revolution
    assert alarm.regime.speed_rpm == pytest.approx(2.3 * 30.0 / np.pi, rel=0.01)


def arrays(path):
    with np.load(path, allow_pickle=False) as file:
        return {name: file[name].tobytes() for name in file.files}


def test_a_turbine_that_stands_still_or_jumps_fills_no_memory_and_raises_no_alarm():
    columns = record(BASELINE, N, np.random.default_rng(19))
    n = columns["time"].size
    first = {name: values[: n // 2] for name, values in columns.items()}
    later = {name: values[n // 2 :] for name, values in columns.items()}
    still = {name: np.full(400_000, values[-1]) for name, values in first.items()}
    still["time"] = first["time"][-1] + 1e-3 * np.arange(1, 400_001)
    later["time"] = later["time"] + 2000.0
    splitter, watch = RevolutionSplitter(), TurbineWatch(BASELINE, OPTIONS)
    for piece in (first, *[still | {"time": still["time"] + 400.0 * k} for k in range(4)], later):
        for turn, _ in splitter.turns(piece):
            assert turn["time"].size < 1_000_000
            watch.take(turn)
    assert watch.alarms == []
    assert watch.n_revolutions >= N - 4


def test_a_state_of_another_watch_is_refused(tmp_path):
    write_state(tmp_path / "state.npz", TurbineWatch(BASELINE, OPTIONS), "one")
    with pytest.raises(ValueError, match=r"another baseline or other options; expected the same"):
        read_state(tmp_path / "state.npz", BASELINE, OPTIONS, "another")
    (tmp_path / "state.npz").write_bytes(b"mine")
    with pytest.raises(ValueError, match=r"state.npz: is no state of a watch"):
        read_state(tmp_path / "state.npz", BASELINE, OPTIONS, "one")
    state = tmp_path / "damaged.npz"
    write_state(state, TurbineWatch(BASELINE, OPTIONS), "one")
    with np.load(state) as file:
        valid = dict(file)
    np.savez(state, **(valid | {"recent_scatter": np.zeros((3, 4))}))
    with pytest.raises(ValueError, match=r"recent_scatter is float64 of shape \(3, 4\); expected"):
        read_state(state, BASELINE, OPTIONS, "one")
    header = str(valid["header"]).replace('"n_recent": 0', '"n_recent": -1')
    np.savez(state, **(valid | {"header": np.array(header)}))
    with pytest.raises(ValueError, match=r"is damaged \(n_recent is -1; expected a whole number"):
        read_state(state, BASELINE, OPTIONS, "one")
