"""A zero that drifts over a run is a fault of the channel, not a stiffness that changes."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.workflows.diagnosis.examination import examined

from .element_campaigns import STIFFNESS, displacement_campaign, no_law

NOISE = 0.05


def is_drift(added, trend=0.0):
    """Whether a drift explains what is added to the force of a linear element.

    `trend` is that of the deflection over its largest value; the force follows it.
    """
    clean = displacement_campaign(no_law, amplitudes=(0.5e-3, 1e-3), n=1500)

    def changed(run):
        along = run.time / run.time[-1] - 0.5
        q = run.inputs["displacement"]
        moved = trend * np.abs(q).max() * along
        force = run.signals["F"] + STIFFNESS * moved + added(along, q + moved)
        return replace(run, inputs={"displacement": q + moved}, signals={"F": force})

    campaign = replace(clean, runs=tuple(map(changed, clean.runs)))
    rivals = examined(campaign, None).baseline(None, ()).rivals
    return "wiring/drift" in [rival.id for rival, _ in rivals]


@pytest.mark.parametrize("floors", [pytest.param(-20.0, marks=pytest.mark.long), 8.0])
def test_a_line_over_time_in_the_force_is_a_drift(floors):
    assert is_drift(lambda along, q: floors * NOISE * along)


def level(q):
    """Larger in the run of the larger motion."""
    return 20.0 * NOISE * np.abs(q).max() / 1e-3


def test_a_drift_that_begins_at_zero_in_every_run_is_a_drift():
    """Its mean differs from run to run, so that no constant force is that mean."""
    assert is_drift(lambda along, q: level(q) * (along + 0.5))


@pytest.mark.parametrize(
    ("added", "trend"),
    [
        # Zeros that differ from run to run and stay.
        (lambda along, q: level(q) + 0.0 * along, 0.0),
        (lambda along, q: 0.1 * STIFFNESS * q * along, 0.0),
        pytest.param(lambda along, q: 1e6 * STIFFNESS * q**3, 0.0, marks=pytest.mark.long),
        # A deflection that grows itself: what follows it cannot be told from a drift.
        (lambda along, q: 8.0 * NOISE * along, 3.0),
    ],
)
def test_what_follows_the_motion_is_no_drift(added, trend):
    assert not is_drift(added, trend)
