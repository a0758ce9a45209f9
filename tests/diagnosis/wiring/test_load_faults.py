"""Faults of inputs as campaigns in which they are put right."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.wiring.load_faults import held_inputs, load_faults, sized_faults
from tests.identification.synthetic_campaigns import carrier_campaign, run_case


def loaded():
    """Two runs of a carrier with torque and both radial loads."""
    campaign = carrier_campaign([run_case("LC1"), run_case("LC2", torque=180e3)])
    radial = {"ntl_y": 1e3, "ntl_z": -2e3}
    runs = tuple(
        replace(
            run,
            inputs={
                **run.inputs,
                **{name: size * np.ones(run.time.size) for name, size in radial.items()},
            },
        )
        for run in campaign.runs
    )
    return replace(campaign, runs=runs)


def test_signs_and_axes_are_put_right_in_the_inputs_alone():
    campaign = loaded()
    faults = {fault.text: fault for fault in load_faults(campaign)}
    turned = faults["torque of the other sign"].corrected.runs[1]
    assert_allclose(turned.inputs["torque"], -campaign.runs[1].inputs["torque"])
    exchanged = faults["ntl_y and ntl_z exchanged, ntl_z reversed"].corrected.runs[0].inputs
    assert_allclose(exchanged["ntl_y"], campaign.runs[0].inputs["ntl_z"])
    assert_allclose(exchanged["ntl_z"], -campaign.runs[0].inputs["ntl_y"])
    for fault in faults.values():
        for run, before in zip(fault.corrected.runs, campaign.runs, strict=True):
            assert run.signals == before.signals


def test_one_run_is_put_right_alone():
    campaign = loaded()
    first, second = next(load_faults(campaign, campaign.runs[0].name)).corrected.runs
    assert_allclose(first.inputs["torque"], -campaign.runs[0].inputs["torque"])
    assert second is campaign.runs[1]


def test_a_held_input_comes_back_as_straight_lines_between_its_readings():
    campaign = loaded()
    ramp = {run.name: np.linspace(0.0, 1.0, run.time.size) ** 2 for run in campaign.runs}
    staircase = replace(
        campaign,
        runs=tuple(
            replace(
                run,
                inputs={
                    **run.inputs,
                    "torque": np.repeat(ramp[run.name][::4], 4)[: run.time.size],
                },
            )
            for run in campaign.runs
        ),
    )
    assert not list(held_inputs(campaign))
    (fault,) = held_inputs(staircase)
    assert (fault.id, fault.about) == ("wiring/held_input", "torque")
    for run in fault.corrected.runs:
        assert_allclose(run.inputs["torque"][:-4], ramp[run.name][:-4], atol=1e-4)


@pytest.mark.parametrize(("power", "n_vertices"), [(1.0, 1), (0.9, 4)])
def test_a_zero_is_sought_until_a_vertex_gains_what_its_parabola_promised(power, n_vertices):
    campaign = carrier_campaign([run_case("LC1")])
    stated = campaign.runs[0].inputs["torque"][0]
    zero = 0.02 * stated
    tried = []

    def refitted(corrected):
        """Mean square of a torque whose zero is off, a parabola at the power of one."""
        moved = corrected.runs[0].inputs["torque"][0] - stated
        if moved != 0.0:
            tried.append(moved)
        return 1e-6 + ((moved - zero) / stated) ** 2 * (1.0 + (moved / zero) ** 2) ** (power - 1.0)

    (rival,) = (one for one in sized_faults(campaign, refitted) if one.about == "torque")
    assert rival.mean_square == pytest.approx(1e-6, rel=1e-3)
    assert len(tried) == 3 * n_vertices
