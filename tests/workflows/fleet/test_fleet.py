"""Turbines and days of a fleet: what is put together, which turbine differs, what changes."""

from dataclasses import replace

import numpy as np

from carrierflex.workflows.diagnosis.fleet_sizes import CampaignRow, CauseSize
from carrierflex.workflows.fleet.fleet import fleet_diagnosis
from carrierflex.workflows.fleet.fleet_page import fleet_page, fleet_sentences

STD = 1e-6


def row(turbine, month, value, *, unit="rad", cause="carrier_tilt", is_named=True):
    """Campaign of a turbine with one size."""
    interval = (value - 2 * STD, value + 2 * STD)
    size = CauseSize(cause, "phi_PLC", value, STD, interval, unit, is_named)
    return CampaignRow(
        campaign=f"{turbine}/{month}",
        turbine=turbine,
        recorded=f"2026-{month:02d}-01",
        kind="carrier",
        verdict="named",
        text="",
        causes=(cause,) if is_named else (),
        unit="m",
        noise_floor=5e-6,
        gap_floors=value / 5e-6,
        sizes=(size,),
    )


def drawn_rows(n_turbines, n_months, rng):
    """Turbines about 1e-4 with a spread of 1e-5, the same in every month but for the errors."""
    for number in range(n_turbines):
        true = 1e-4 + 1e-5 * rng.standard_normal()
        for month in range(1, n_months + 1):
            yield row(f"T{number:02d}", month, true + STD * rng.standard_normal())


def test_the_last_campaign_of_each_turbine_makes_the_prior():
    rng = np.random.default_rng(1)
    fleet = fleet_diagnosis([*drawn_rows(40, 2, rng), row("T07", 3, 2e-4)])
    (prior,) = fleet.priors
    assert len(prior.turbines) == 40
    assert prior.n_without == 0
    # Forty turbines: standard errors 1.6 % of the mean and 11 % of the spread of 39 of them.
    np.testing.assert_allclose(prior.mean, 1e-4, rtol=0.08)
    first = prior.turbines[0]
    assert (first.turbine, first.campaign, first.differs) == ("T07", "T07/3", True)
    assert sum(one.differs for one in prior.turbines) == 1
    assert fleet.latest[0].turbine == "T07"
    assert "Different from the other turbines: T07" in " ".join(fleet_sentences(fleet))


def test_a_size_that_grows_changes_and_others_do_not():
    rng = np.random.default_rng(2)
    rows = list(drawn_rows(20, 6, rng))
    # Named from the third month on, 2e-6 a month: two errors.
    growing = [row("T99", month, 2e-6 * month, is_named=month > 2) for month in range(1, 7)]
    fleet = fleet_diagnosis([*rows, *growing])
    changing = [one for one in fleet.trends if one.changes]
    assert [one.turbine for one in changing] == ["T99"]
    low, high = changing[0].slope_ci95
    assert low < 2e-6 * 12 < high
    assert changing[0].first_named == "2026-03-01"
    assert "Changing with time: T99" in " ".join(fleet_sentences(fleet))
    page = fleet_page(fleet, "records", "campaigns", "report.html")
    assert "Sizes that change with time" in page


def test_a_step_is_dated_where_a_line_fits_worse():
    rng = np.random.default_rng(5)
    stepped = [row("T98", month, 2e-6 + 2e-5 * (month > 3)) for month in range(1, 7)]
    drifting = [row("T99", month, 5e-6 * month) for month in range(1, 7)]
    fleet = fleet_diagnosis([*drawn_rows(20, 6, rng), *stepped, *drifting])
    days = {one.turbine: one.stepped for one in fleet.trends if one.changes}
    assert days == {"T98": "2026-04-01", "T99": ""}
    assert "2026-04-01</td>" in fleet_page(fleet, "records", "campaigns", "report.html")


def test_an_error_that_all_days_share_hides_no_change_under_the_same_conditions():
    def days(turbine, conditions):
        for month in range(1, 7):
            one = row(turbine, month, 2e-5 + 2e-5 * (month > 3))
            size = replace(one.sizes[0], std=1e-5, repeat_std=2e-7)
            yield replace(one, sizes=(size,), conditions=conditions[month - 1])

    alike = days("T01", 6 * (("full", "half"),))
    other = days("T02", 5 * (("full", "half"),) + (("full",),))
    first, second = sorted(fleet_diagnosis([*alike, *other]).trends, key=lambda one: one.turbine)
    assert (first.changes, first.stepped) == (True, "2026-04-01")
    assert not second.changes
    # What all days share scales the slope: it is in the interval.
    np.testing.assert_allclose(first.slope_ci95, second.slope_ci95)


def test_a_fault_of_the_measurement_comes_first_and_is_in_no_prior():
    rng = np.random.default_rng(4)
    faulty = replace(row("T98", 1, 9e-4), first_fault="wiring/sensor_order")
    fleet = fleet_diagnosis([*drawn_rows(20, 1, rng), faulty])
    assert len(fleet.priors[0].turbines) == 20
    assert not any(one.differs for one in fleet.priors[0].turbines)
    sentences = fleet_sentences(fleet)
    assert sentences[1].startswith("Check the measurement first")
    assert "in the last campaign of 20." in sentences[0]


def test_sizes_of_different_units_are_never_put_together():
    rng = np.random.default_rng(3)
    rows = [*drawn_rows(4, 1, rng), *(row(f"U{k}", 1, 1e-4, unit="deg") for k in range(3))]
    (prior,) = fleet_diagnosis(rows).priors
    assert (prior.unit, len(prior.turbines), prior.n_without) == ("rad", 4, 3)


def test_a_name_that_holds_markup_is_text_on_the_page():
    rows = [row(f"<b>{k}</b>", 1, 1e-4 + 1e-6 * k) for k in range(4)]
    page = fleet_page(fleet_diagnosis(rows), "records", "campaigns", "report.html")
    assert "<b>" not in page
