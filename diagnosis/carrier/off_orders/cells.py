"""Motion beside the orders as cells of the gap map, one by line, channel and run."""

from collections.abc import Iterator, Sequence

import numpy as np

from carrierflex.diagnosis.carrier.off_orders.lines import OffOrderLine, OffOrders
from carrierflex.diagnosis.carrier.off_orders.records import FloatArray
from carrierflex.diagnosis.gap.findings import LINE, Finding
from carrierflex.diagnosis.gap.gap_map import N_DRAWS, CellTable
from carrierflex.diagnosis.gap.off_order_motion import OffOrderMotion

_SEED = 5
#: Smallest share of the gap worth naming.
_SMALLEST_NAMED = 0.05


def off_order_tables(found: OffOrders) -> Iterator[CellTable]:
    """Cells of every run in which a motion was found, each motion at its strongest line.

    ``mean_square`` of a cell is that over all channels, as of every cell; the noise of a fitted
    amplitude is taken off, and draws add it once more.

    Yields
    ------
    CellTable
        One a run; orders are turns of the carrier's, whatever the line keeps.
    """
    if not found.members:
        return
    rng = np.random.default_rng(_SEED)
    for number, run in enumerate(found.speeds):
        yield _run_table(found, number, run, rng)


def _run_table(found: OffOrders, number: int, run: str, rng: np.random.Generator) -> CellTable:
    """Cells of one run, the first one's number being zero."""
    names = tuple(channel.name for channel in found.campaign.channels)
    speed = found.speeds[run]
    rows = [_line_rows([found.lines[k] for k in own], number, rng) for own in found.members]
    mean_square, noise, draws = (np.stack(parts, axis=-1) for parts in zip(*rows, strict=True))
    shown = np.array([motion.channels for motion in found.motions], dtype=object)
    used = np.array([[name in channels for channels in shown] for name in names])
    p_value = np.array([motion.p_value for motion in found.motions])
    first = [found.lines[own[0]] for own in found.members]
    return CellTable(
        runs=(run,),
        patterns=names,
        orders=np.array([_order(line, speed) for line in first]),
        mean_square=mean_square[None],
        coherent=(mean_square - noise)[None],
        p_value=np.broadcast_to(p_value, mean_square.shape)[None],
        draws=lambda: (draws - noise)[:, None],
        bands_hz=np.array([_band(found, own, speed) for own in found.members]),
        used=used,
    )


def _line_rows(
    lines: list[OffOrderLine], run: int, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Mean square, that of noise, and draws of one motion's lines: shapes (C,), (C,), (D, C)."""
    amplitudes = np.array([line.amplitudes[run] for line in lines])
    errors = np.array([line.errors[run] for line in lines])
    n_channels = amplitudes.shape[1]
    scatter = rng.standard_normal((2, N_DRAWS, *amplitudes.shape))
    drawn = amplitudes + errors * (scatter[0] + 1j * scatter[1])
    mean_square = (0.5 * np.abs(amplitudes) ** 2).sum(axis=0) / n_channels
    noise = (errors**2).sum(axis=0) / n_channels
    # A draw holds the noise of the estimate and its own.
    draws = (0.5 * np.abs(drawn) ** 2).sum(axis=1) / n_channels - noise
    return mean_square, noise, draws


def _order(line: OffOrderLine, speed: float) -> float:
    return line.position if line.is_order else line.position / speed


def _band(found: OffOrders, members: tuple[int, ...], speed: float) -> tuple[float, float]:
    """Lowest and highest frequency of the lines of a motion in one run [Hz]."""
    hertz = [_order(found.lines[k], speed) * speed for k in members]
    return min(hertz), max(hertz)


def line_findings(
    motions: Sequence[OffOrderMotion], coherent: float, n_runs: int
) -> Iterator[Finding]:
    """Motions beside the orders that are worth naming.

    Parameters
    ----------
    motions : sequence of OffOrderMotion
        What was found.
    coherent : float
        Sum over all runs of the mean square of the gap above the noise.
    n_runs : int
        Runs of the campaign.
    """
    for motion in motions:
        share = sum(motion.mean_square.values()) / coherent if coherent > 0.0 else 0.0
        if share >= _SMALLEST_NAMED:
            yield Finding(
                kind=LINE,
                patterns=motion.channels,
                share=share,
                runs=motion.runs,
                is_in_every_run=motion.is_in_every_run and len(motion.runs) == n_runs,
                band_hz=motion.band_hz,
                p_value=motion.p_value,
                line=motion.label,
            )
