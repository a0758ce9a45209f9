"""A record read in pieces gives what the whole record gives, in memory that does not grow."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.identification.campaign import run_files
from carrierflex.identification.campaign.campaign_files import columns_of, write_campaign
from carrierflex.identification.campaign.document_files import read_campaign_header
from carrierflex.identification.carrier import long_records
from carrierflex.identification.carrier.carrier_identification import FitOptions, identify_jointly
from carrierflex.identification.carrier.long_records import (
    LARGEST_GROUPS,
    identify_in_pieces,
    is_long,
    run_pieces,
    streamed_equations,
)
from carrierflex.identification.carrier.models import flexible_model, rigid_model
from tests.identification.synthetic_campaigns import carrier_campaign, run_case
from tests.simulation.synthetic_curves import flexible_curve, stiff_curve

M1, M2 = rigid_model(), flexible_model(stiff_curve(), flexible_curve())


@pytest.fixture(scope="module", params=["csv", "parquet"])
def folder(request, tmp_path_factory):
    path = tmp_path_factory.mktemp("long") / "campaign"
    campaign = carrier_campaign()
    runs = tuple(replace(run, file=f"{run.name}.{request.param}") for run in campaign.runs)
    write_campaign(replace(campaign, runs=runs), path)
    return path


@pytest.fixture
def small_pieces(monkeypatch):
    monkeypatch.setattr(run_files, "PIECE", 100)
    monkeypatch.setattr(run_files, "_CSV_BLOCK", 5000)


@pytest.mark.usefixtures("small_pieces")
@pytest.mark.parametrize("per_run", [False, True])
def test_pieces_give_the_same_parameters_as_the_whole_record(folder, per_run):
    header = read_campaign_header(folder)
    heads, estimates = identify_in_pieces(folder, header, [M1, M2], FitOptions(), per_run=per_run)
    assert heads.runs[0].time.size < 250 < carrier_campaign().runs[0].time.size
    for model in (M1, M2):
        at_once = identify_jointly(carrier_campaign(), model)
        pieces = estimates[model.name]["LC1"]
        if not per_run:
            assert_allclose(pieces.values, at_once.values, rtol=1e-9)
            assert_allclose(pieces.std, at_once.std, rtol=1e-6)
            assert_allclose(pieces.rms, at_once.rms, rtol=1e-9)


@pytest.mark.usefixtures("small_pieces")
def test_more_revolutions_than_groups_are_paired_and_none_is_lost(folder, monkeypatch):
    header = read_campaign_header(folder)
    pieces = list(run_pieces(folder, header.runs[0], header))
    every = streamed_equations(pieces, header.channels, M2)
    monkeypatch.setattr(long_records, "LARGEST_GROUPS", 6)
    paired = streamed_equations(pieces, header.channels, M2)
    assert (every.n_revolutions, paired.n_revolutions) == (8, 4)
    for name in ("matrix", "right_side", "square_sum", "n_samples"):
        fine = getattr(every, name)
        assert_allclose(getattr(paired, name), fine[0::2] + fine[1::2], rtol=1e-12)


def test_memory_stays_flat_while_the_record_grows():
    """Ten times the record: the pieces pass, the sums of their revolutions stay."""

    def peak(n_pieces):
        base = carrier_campaign([run_case(duration=60.0, sample_rate=50.0)]).runs[0]
        turn = base.inputs["carrier_angle"][-1] + base.inputs["carrier_angle"][1]

        def pieces():
            for k in range(n_pieces):
                inputs = {**base.inputs, "carrier_angle": base.inputs["carrier_angle"] + k * turn}
                yield replace(base, inputs=inputs)

        tracemalloc.start()
        streamed_equations(pieces(), carrier_campaign().channels, M2)
        size = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return size

    peak(1)  # tables of the curves are made once
    run = carrier_campaign([run_case(duration=60.0, sample_rate=50.0)]).runs[0]
    piece = sum(values.nbytes for values in (run.time, *run.inputs.values(), *run.signals.values()))
    # The sums of the revolutions are given out as a copy, far smaller than the samples.
    assert peak(30) - peak(3) < 27 * piece / 4
    assert LARGEST_GROUPS * 4 * 7 * 7 * 8 < 5e6


def test_a_jump_between_pieces_is_refused(folder, small_pieces):
    header = read_campaign_header(folder)
    pieces = list(run_pieces(folder, header.runs[0], header))
    with pytest.raises(ValueError, match=r"'carrier_angle' goes from .* expected no jump back"):
        streamed_equations([pieces[1], pieces[0]], header.channels, M2)
    with pytest.raises(ValueError, match=r"turns by 0.* revolutions; expected at least one"):
        streamed_equations([_shortened(pieces[0])], header.channels, M2)


def _shortened(run):
    """First twenty samples of a piece: one second, a third of a turn."""
    inputs = {name: values[:20] for name, values in run.inputs.items()}
    signals = {name: values[:20] for name, values in run.signals.items()}
    return replace(run, time=run.time[:20], inputs=inputs, signals=signals)


def test_time_that_goes_back_between_pieces_is_refused(folder, small_pieces, monkeypatch):
    header = read_campaign_header(folder)
    pieces = list(run_files.column_pieces(folder / header.runs[0].file, columns_of(header)))
    monkeypatch.setattr(
        long_records, "column_pieces", lambda path, expected: iter([pieces[1], pieces[0]])
    )
    with pytest.raises(
        ValueError,
        match=r"column 'time' is 0\.0 at sample .* after .*; expected strictly increasing",
    ):
        list(run_pieces(folder, header.runs[0], header))


def test_long_is_told_from_the_size_of_the_files(folder):
    header = read_campaign_header(folder)
    assert not is_long(folder, header)
    assert is_long(folder, header, largest_size=1000)
    assert np.isfinite(next(run_pieces(folder, header.runs[1], header)).time).all()
