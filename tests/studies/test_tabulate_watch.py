"""The study of the watch: no alarm under the null, and alarms where the null does not hold."""

import numpy as np
import pytest

from studies import tabulate_watch


@pytest.fixture(autouse=True)
def _few_streams(monkeypatch):
    monkeypatch.setattr(tabulate_watch, "_STREAMS", 10)


def test_statistics_under_the_null_raise_no_alarm_and_state_their_limit(tmp_path):
    text = tabulate_watch.main(
        out=tmp_path, only=["statistics"], revolutions=10_000, seed=4, quiet=True
    )
    # No alarm in t turbine-days: the upper 95 % limit is one in t / 3.
    limit = 10_000 / (22.0 * 60.0 * 24.0) / -np.log(0.05)
    assert f"1 in {limit:.0f} (0 alarms" in text
    assert (tmp_path / "watch.md").read_text(encoding="utf-8") == text


def test_a_temperature_that_is_not_followed_is_an_alarm(monkeypatch):
    followed = tabulate_watch._null_chunk(20_000, [4, 0])
    monkeypatch.setattr(tabulate_watch, "_DRIFT", 0.0)
    not_followed = tabulate_watch._null_chunk(20_000, [4, 0])
    assert followed["alarms"] == 0
    assert not_followed["alarms"] > 0


@pytest.mark.long
def test_a_cause_that_comes_is_found_and_named(tmp_path):
    outcome = tabulate_watch._outcome(tmp_path, tabulate_watch._plan("ntl_tilt", 3, 77), "ntl_tilt")
    assert outcome["is_right"]
    assert outcome["n_before"] == 0
    assert outcome["since"] == 0
    assert outcome["delay"] <= 50
