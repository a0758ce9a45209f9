"""Columns of one sensor at a time: memory of the basis does not grow with the sensors."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from carrierflex.diagnosis.carrier.library import carrier_library
from carrierflex.diagnosis.carrier.records.columns import ColumnSource, largest_load, typical_speed
from carrierflex.diagnosis.carrier.records.sums import _column_basis
from carrierflex.simulation.carrier.rim import CarrierRig
from tests.identification.synthetic_campaigns import carrier_campaign
from tests.simulation.synthetic_curves import curve_set


@pytest.mark.long
def test_memory_of_the_basis_is_that_of_one_sensor():
    campaign = carrier_campaign()
    rig = CarrierRig(float(campaign.rig["nominal_torque"]), 3, np.nan, curve_set())
    source = ColumnSource(
        rig, carrier_library(rig), typical_speed(campaign), largest_load(campaign)
    )
    first = campaign.channels[0]
    sensors = [replace(first, angle=0.1 * k) for k in range(12)]

    def peak(n_sensors):
        tracemalloc.start()
        _column_basis(campaign.runs, sensors[:n_sensors], source)
        size = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return size

    peak(1)  # tables of the curves are made once
    assert peak(12) < 1.5 * peak(3)
