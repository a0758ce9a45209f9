"""Bodies of the stage keep the modes that the frequency of use asks for."""

import numpy as np

from carrierflex.geometry.parameter_files import read_parameters
from carrierflex.reduction import mode_count
from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.reduction.modes.mode_rules import CUT_OFF_SHARE
from carrierflex.workflows.fe.bodies import body_structure
from carrierflex.workflows.simulation import stage_bodies

SIZE = 0.06


def test_modes_follow_from_the_frequency_of_use_and_not_from_a_number(monkeypatch):
    more = craig_bampton(body_structure("pin", read_parameters(None), SIZE)[1], 8)
    n_static = len(more.model.K) - len(more.modes.omega)
    counts = []
    for frequency in (750.0, 3000.0):
        monkeypatch.setattr(mode_count, "DEFAULT_FREQUENCY", frequency)
        model = stage_bodies._reduced("pin", SIZE)
        last = 2.0 * np.pi * frequency / CUT_OFF_SHARE
        counts.append(len(model.K) - n_static)
        assert counts[-1] == np.count_nonzero(more.modes.omega < last)
    # A pin is used far below its first mode; up to 3 kHz it needs some.
    assert counts[0] == 0 < counts[1] < len(more.modes.omega)
