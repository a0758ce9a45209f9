"""The effects that docs/own_effects.md adds, run as printed there and found in campaigns."""

import re
import sys
import tomllib
from importlib import invalidate_caches
from pathlib import Path

import numpy as np
import pytest
from numba import njit

from carrierflex.diagnosis.carrier.problem import carrier_problem
from carrierflex.diagnosis.comparison.effect_cards import _ENTRY_POINT_GROUP
from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.diagnosis.element.problem import element_problem
from carrierflex.diagnosis.mounting.problem import mounting_problem
from carrierflex.simulation.mounting.equations import mounting_blocks
from carrierflex.simulation.mounting.parameter_arrays import parameter_array
from carrierflex.simulation.mounting.simulate import simulate
from tests.diagnosis.carrier.carrier_twin import CURVES, KNOWN, twin_campaign
from tests.diagnosis.element.element_campaigns import displacement_campaign
from tests.diagnosis.mounting.mounting_campaigns import (
    CONDITIONS,
    RIG,
    TRUE_LINEAR,
    mounting_campaign,
)

PAGE = Path(__file__).parents[2] / "docs" / "own_effects.md"
#: Truth of the stops in the bushings: stiffness [N/m] and clearance [m].
STOP_STIFFNESS, CLEARANCE = 2.0e7, 4.0e-3
#: Steps of the truth in a sampling interval of 50 ms; the mounting swings at up to 20 Hz.
SUBSTEPS = 25
#: Runout of the rim [m]; five to ten times the noise.
OVALITY = (3e-5, -4e-5)


def blocks_of(language):
    page = PAGE.read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)


@pytest.fixture
def documented_package(tmp_path, monkeypatch):
    """The package of the page, installed: its modules and its entry points on the path."""
    (project,) = (
        tomllib.loads(block) for block in blocks_of("toml") if _ENTRY_POINT_GROUP in block
    )
    for block in blocks_of("python"):
        name = re.match(r"# (\w+\.py)\n", block)[1]
        (tmp_path / name).write_text(block, encoding="utf-8")
    points = project["project"]["entry-points"][_ENTRY_POINT_GROUP]
    metadata = tmp_path / "rig_effects-0.1.dist-info"
    metadata.mkdir()
    lines = [f"[{_ENTRY_POINT_GROUP}]", *(f"{name} = {target}" for name, target in points.items())]
    (metadata / "entry_points.txt").write_text("\n".join(lines), encoding="utf-8")
    head = "Metadata-Version: 2.1\nName: rig-effects\nVersion: 0.1\n"
    (metadata / "METADATA").write_text(head, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    invalidate_caches()
    modules = project["tool"]["setuptools"]["py-modules"]
    assert sorted(modules) == sorted(path.stem for path in tmp_path.glob("*.py"))
    yield
    for module in modules:
        sys.modules.pop(module, None)


def check_parameter(diagnosis, effect, name, truth):
    """Named, and the truth within four errors and half a per cent."""
    assert diagnosis.verdict == "named", (diagnosis.verdict, diagnosis.reason)
    assert diagnosis.attribution.effects == (effect,)
    estimate = diagnosis.attribution.parameters[effect][name]
    assert abs(estimate.value - truth) < 4.0 * estimate.std + 5e-3 * abs(truth), estimate


@pytest.mark.long
def test_the_stop_of_an_element_is_named(documented_package):
    campaign = displacement_campaign(lambda q, v: 4e3 * np.maximum(q - 0.5e-3, 0.0), n=2000)
    result = diagnose(element_problem(campaign), campaign="page", kind="element")
    check_parameter(result, "rubber_stop", "K_s", 4e3)


@pytest.mark.long
def test_the_oval_rim_of_a_carrier_is_named(documented_package):
    def oval(channel, angle):
        wave = np.real((OVALITY[0] - 1j * OVALITY[1]) * np.exp(2j * (channel.angle - angle)))
        return wave if channel.quantity == "radial_displacement" else 0.0

    campaign = twin_campaign(contained=tuple(KNOWN), extra=oval)
    result = diagnose(carrier_problem(campaign, CURVES), campaign="page", kind="carrier")
    for name, truth in zip(("e_c", "e_s"), OVALITY, strict=True):
        check_parameter(result, "rim_ovality", name, truth)


@pytest.mark.acceptance
def test_the_stops_of_the_bushings_are_named(documented_package):
    campaign = mounting_campaign(extra=change_by_stops, conditions=CONDITIONS[:3])
    result = diagnose(mounting_problem(campaign), campaign="page", kind="mounting")
    check_parameter(result, "bushing_stop", "K_s", STOP_STIFFNESS)
    check_parameter(result, "bushing_stop", "g", CLEARANCE)


def change_by_stops(inputs):
    """What the stops change in the signals [m]: motion by Runge-Kutta less the linear motion."""
    parameters = parameter_array(RIG, TRUE_LINEAR)
    signals = np.zeros((inputs.time.size, 6))
    for block in mounting_blocks(RIG, parameters):
        n = len(block.names)
        inverse = np.linalg.inv(block.M)
        A = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ block.K, -inverse @ block.C]])
        B = np.vstack([np.zeros((n, 3)), inverse @ block.G])
        push = -inverse @ (block.rows.T * block.weights)
        N = np.vstack([np.zeros_like(push), push])
        rows = np.hstack([block.rows, np.zeros_like(block.rows)])
        loads = np.ascontiguousarray(inputs.loads)
        motion = stopped_motion(A, B, N, rows, loads, inputs.step, SUBSTEPS)
        signals += motion[:, :n] @ block.output.T
    return signals - simulate(RIG, parameters, inputs).signals


@njit(cache=True)
def stopped_motion(A, B, N, rows, loads, interval, substeps):
    """States at the samples, from rest, by the classical Runge-Kutta method."""
    h = interval / substeps
    x = np.zeros(len(A))
    states = np.zeros((len(loads), len(A)))
    for sample in range(1, len(loads)):
        rise = loads[sample] - loads[sample - 1]
        for substep in range(substeps):
            total, k = np.zeros(len(A)), np.zeros(len(A))
            for stage in range(4):
                share = 0.0 if stage == 0 else (1.0 if stage == 3 else 0.5)
                y = x + share * h * k
                u = rows @ y
                beyond = np.sign(u) * np.maximum(np.abs(u) - CLEARANCE, 0.0)
                k = A @ y + B @ (loads[sample - 1] + (substep + share) / substeps * rise)
                k += N @ (STOP_STIFFNESS * beyond)
                total += k if stage in (0, 3) else 2.0 * k
            x = x + h / 6.0 * total
        states[sample] = x
    return states
