import numpy as np
import pytest

from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign.revolutions import whole_revolutions


def record(angle):
    return Run("A", "A.csv", "c", np.arange(float(angle.size)), {"carrier_angle": angle}, {})


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_record_is_trimmed_to_whole_revolutions_in_either_direction(direction):
    angle = direction * 2.0 * np.pi * np.arange(0.0, 3.7, 0.01) + 5.0
    revolutions = whole_revolutions(record(angle))
    assert revolutions.n_revolutions == 3
    assert [samples.size for samples in revolutions.samples] == [100, 100, 100]
    assert (revolutions.kept == np.arange(300)).all()


def test_a_record_that_ends_one_step_before_a_whole_turn_counts_that_turn():
    angle = 2.0 * np.pi * np.arange(200) / 100
    assert whole_revolutions(record(angle)).n_revolutions == 2
    assert whole_revolutions(record(angle[:-1])).n_revolutions == 1


def test_samples_of_a_moment_of_turning_back_go_to_the_revolution_they_belong_to():
    angle = 2.0 * np.pi * np.array([0.0, 0.3, 0.6, 0.9, 1.05, 0.95, 1.1, 1.4, 1.7, 2.0, 2.1])
    first, second = whole_revolutions(record(angle)).samples
    assert list(first) == [0, 1, 2, 3, 5]
    assert list(second) == [4, 6, 7, 8]


@pytest.mark.parametrize("turns", [0.0, 0.5, 0.98])
def test_less_than_one_revolution_is_refused(turns):
    angle = 2.0 * np.pi * turns * np.arange(200) / 200
    with pytest.raises(
        ValueError, match=r"run A: the carrier turns by 0\.\d+ revolutions; expected at least one"
    ):
        whole_revolutions(record(angle))
