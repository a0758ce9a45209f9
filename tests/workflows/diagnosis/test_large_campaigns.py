"""Records and products of a large campaign are not held in memory."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from carrierflex.identification.campaign.campaign_files import read_campaign, write_campaign
from carrierflex.identification.campaign.kept_runs import KeptRuns
from tests.identification.synthetic_campaigns import carrier_campaign, run_case

#: Runs, sensors and samples of the records that are read: 0.27 GB.
RUNS, CHANNELS, SAMPLES = 40, 16, 40_000
#: Runs, sensors and samples of those that are compared: 0.2 GB of products.
COMPARED = (80, 64, 145)

_READ = """
import resource, sys
from pathlib import Path
from carrierflex.identification.campaign.campaign_files import read_campaign

def peak():
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

import pyarrow.parquet
before = peak()
campaign = read_campaign(Path(sys.argv[1]))
total = sum(float(values.sum()) for run in campaign.runs for values in run.signals.values())
size = sum(v.nbytes for run in campaign.runs for v in (run.time, *run.columns().values()))
print(peak() - before, size, total)
"""

_COMPARE = """
import resource, sys
from pathlib import Path
from carrierflex.diagnosis.kinds import problem_of
from carrierflex.identification.campaign.campaign_files import read_campaign
from carrierflex.workflows.support.default_curves import default_curves

def peak():
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

campaign = read_campaign(Path(sys.argv[1]))
curves = default_curves()
import dataclasses
problem_of(dataclasses.replace(campaign, runs=campaign.runs[:2]), curves)
before = peak()
problem, _ = problem_of(campaign, curves)
print(peak() - before, problem.records.products.nbytes)
"""


def in_a_process(program, folder):
    """Numbers that a program prints of a campaign, from a process of its own."""
    done = subprocess.run(
        [sys.executable, "-P", "-c", program, str(folder)],
        capture_output=True,
        text=True,
        check=True,
    )
    return [float(word) for word in done.stdout.split()]


def many(n_runs, n_channels, n_samples, folder):
    """Campaign folder of a carrier whose signals are noise on a wave."""
    template = carrier_campaign([run_case("LC1")])
    (run,) = template.runs
    angles = 2.0 * np.pi * np.arange(n_channels) / n_channels
    channels = tuple(
        replace(template.channels[0], name=f"s{k}", angle=float(angle))
        for k, angle in enumerate(angles)
    )
    rng = np.random.default_rng(0)
    time = np.linspace(0.0, float(run.time[-1]), n_samples)
    turned = np.interp(time, run.time, run.inputs["carrier_angle"])
    inputs = {name: np.full(n_samples, float(own[0])) for name, own in run.inputs.items()}
    inputs["carrier_angle"] = turned
    runs = tuple(
        replace(
            run,
            name=f"run{number}",
            file=f"run{number}.parquet",
            time=time,
            inputs=inputs,
            signals={
                channel.name: 1e-5 * np.cos(turned - angle) + 1e-6 * rng.standard_normal(n_samples)
                for channel, angle in zip(channels, angles, strict=True)
            },
        )
        for number in range(n_runs)
    )
    write_campaign(replace(template, channels=channels, runs=runs), folder, simulated=True)


@pytest.mark.acceptance
def test_records_of_a_large_campaign_are_read_where_they_are_asked_for(tmp_path):
    """Beyond 0.2 GB they are on disk: those before, one run and half of that again are held."""
    many(RUNS, CHANNELS, SAMPLES, tmp_path / "many")
    grown, size, total = in_a_process(_READ, tmp_path / "many")
    assert np.isfinite(total)
    assert size > 250e6
    assert grown < 200e6 + 1.5 * size / RUNS, f"{grown / 1e6:.0f} MB of {size / 1e6:.0f} MB"


@pytest.mark.acceptance
def test_products_of_a_large_campaign_are_on_disk(tmp_path):
    """What is at work on them, a few tens of MB, is below a half of them."""
    many(*COMPARED, tmp_path / "many")
    grown, size = in_a_process(_COMPARE, tmp_path / "many")
    assert size > 150e6
    assert grown < 0.5 * size, f"{grown / 1e6:.0f} MB of {size / 1e6:.0f} MB"


def test_runs_beyond_the_limit_are_on_disk_with_the_same_values(tmp_path):
    many(4, 3, 100, tmp_path / "few")
    runs = read_campaign(tmp_path / "few").runs
    size = 8 * 100 * (1 + len(runs[0].columns()))
    kept = KeptRuns(in_memory=2 * size)
    for run in runs:
        kept.add(run)
    assert all(not isinstance(own.signals, dict) for own in kept.runs)
    for own, run in zip(kept.runs, runs, strict=True):
        for name, values in run.columns().items():
            np.testing.assert_array_equal(own.columns()[name], values)
        names = list(run.signals)[:2]
        assert list(own.of_channels(names).signals) == names
        halved = own.with_signals({name: 0.5 * own.signals[name] for name in names})
        assert type(halved.signals) is type(own.signals)
        np.testing.assert_array_equal(halved.signals[names[0]], 0.5 * run.signals[names[0]])
    few = KeptRuns()
    few.add(runs[0])
    assert few.runs[0] is runs[0]
