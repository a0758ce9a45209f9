"""Memory that was let go, and what the process still holds."""

import subprocess
import sys

import pytest

from carrierflex.workflows.diagnosis import diagnose_campaign
from carrierflex.workflows.diagnosis.diagnose_campaign import _returning_freed_memory

#: Frees a hundred megabytes between arrays that live, and prints how much the process holds
#: before and after it was given back.
_HOLES = """
import numpy as np
from carrierflex.workflows.diagnosis.diagnose_campaign import _return_freed_memory

def resident():
    with open("/proc/self/statm") as statm:
        return int(statm.read().split()[1]) * 4096

kept = [np.ones(10_000) for _ in range(2_500)]
kept = kept[::2]
before = resident()
_return_freed_memory()
print((before - resident()) / 1e6)
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="of the GNU C library")
def test_holes_between_arrays_that_live_go_back_to_the_system():
    run = subprocess.run([sys.executable, "-c", _HOLES], check=True, capture_output=True, text=True)
    assert float(run.stdout) > 80.0


def test_progress_is_passed_on_and_memory_returned_now_and_then(monkeypatch):
    clock, returned, noted = [0.0], [], []
    monkeypatch.setattr(diagnose_campaign.time, "monotonic", lambda: clock[0])
    monkeypatch.setattr(
        diagnose_campaign, "_return_freed_memory", lambda: returned.append(clock[0])
    )
    note = _returning_freed_memory(noted.append)
    for clock[0] in (1.0, 11.0, 12.0, 25.0):
        note(f"step at {clock[0]}")
    assert noted == [f"step at {t}" for t in (1.0, 11.0, 12.0, 25.0)]
    assert returned == [11.0, 25.0]


def test_another_c_library_keeps_what_it_keeps(monkeypatch):
    monkeypatch.setattr(diagnose_campaign, "_trim", lambda: None)
    diagnose_campaign._return_freed_memory()
