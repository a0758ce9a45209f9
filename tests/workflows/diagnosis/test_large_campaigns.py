"""Records and products of a large campaign are not held in memory."""

import pickle
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from carrierflex.diagnosis.inference.effect_fit import fit_effects
from carrierflex.files.temporary_store import StoredRows
from carrierflex.identification.campaign.campaign_files import (
    KeptRuns,
    read_campaign,
    write_campaign,
)
from tests.diagnosis.carrier.carrier_twin import twin_problem
from tests.identification.synthetic_campaigns import carrier_campaign, run_case

#: Runs, sensors and samples of the records that are read: 0.27 GB.
RUNS, CHANNELS, SAMPLES = 40, 16, 40_000
#: Copies of one run that may be held while it is read: file, table, numbers, checks, to be written;
#: twice that, since freed memory is not all given back.
COPIES = 10

# What getrusage tells of a new process begins with its parent's.
_READ = """
import re, sys
from pathlib import Path
from carrierflex.identification.campaign.campaign_files import read_campaign

def peak():
    status = Path("/proc/self/status").read_text(encoding="utf-8")
    return 1024 * int(re.search(r"VmHWM:\\s+(\\d+)", status)[1])

read_campaign(Path(sys.argv[1]))
before = peak()
campaign = read_campaign(Path(sys.argv[2]))
total = sum(float(values.sum()) for run in campaign.runs for values in run.signals.values())
size = sum(v.nbytes for run in campaign.runs for v in (run.time, *run.columns().values()))
inputs = sum(v.nbytes for run in campaign.runs for v in (run.time, *run.inputs.values()))
print(peak() - before, size, inputs, total)
"""


def in_a_process(program, *folders):
    """Numbers that a program prints of campaigns, from a process of its own."""
    done = subprocess.run(
        [sys.executable, "-P", "-c", program, *map(str, folders)],
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
    inputs = {name: np.full(n_samples, float(values[0])) for name, values in run.inputs.items()}
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
    """Time and inputs are held, and one run at a time; 0.27 GB and more while all signals were."""
    many(2, CHANNELS, 100, tmp_path / "few")
    many(RUNS, CHANNELS, SAMPLES, tmp_path / "many")
    grown, size, inputs, total = in_a_process(_READ, tmp_path / "few", tmp_path / "many")
    assert np.isfinite(total)
    limit = inputs + COPIES * size / RUNS
    assert limit < 0.6 * size
    assert grown < limit, f"{grown / 1e6:.0f} MB of {size / 1e6:.0f} MB"


@pytest.mark.long
def test_products_on_disk_are_those_in_memory(monkeypatch):
    usual = twin_problem("flange_warp")
    monkeypatch.setattr("carrierflex.diagnosis.carrier.records.sums.IN_MEMORY", 0)
    stored = twin_problem("flange_warp")
    assert isinstance(usual.records.products, np.ndarray)
    assert isinstance(stored.records.products, StoredRows)
    effects = ("flange_warp",)
    fits = [fit_effects(problem, effects) for problem in (usual, stored)]
    np.testing.assert_array_equal(fits[0].theta, fits[1].theta)
    again = pickle.loads(pickle.dumps(stored))
    np.testing.assert_array_equal(fit_effects(again, effects).theta, fits[0].theta)


def test_runs_beyond_the_limit_are_on_disk_with_the_same_values(tmp_path):
    many(4, 3, 100, tmp_path / "few")
    runs = read_campaign(tmp_path / "few").runs
    size = 8 * 100 * (1 + len(runs[0].columns()))
    stored = KeptRuns(in_memory=2 * size)
    for run in runs:
        stored.add(run)
    assert all(not isinstance(each.signals, dict) for each in stored.runs)
    for stored_run, run in zip(stored.runs, runs, strict=True):
        for name, values in run.columns().items():
            np.testing.assert_array_equal(stored_run.columns()[name], values)
        names = list(run.signals)[:2]
        assert list(stored_run.of_channels(names).signals) == names
        halved = stored_run.with_signals({name: 0.5 * stored_run.signals[name] for name in names})
        assert type(halved.signals) is type(stored_run.signals)
        np.testing.assert_array_equal(halved.signals[names[0]], 0.5 * run.signals[names[0]])
    few = KeptRuns()
    few.add(runs[0])
    assert few.runs[0] is runs[0]
