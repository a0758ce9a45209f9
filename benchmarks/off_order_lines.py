"""How often a line between the shaft's orders is found, and how often one is invented.

``python -m benchmarks.off_order_lines --cases 60 --seed 7``: campaigns of the blind check's own
truth (coloured noise, speed ripple, sensors a little off, an effect withheld or two), each searched
once as it is and once with a line of 2 to 10 noise floors at a random place, in all sensors or in
one. No noise is declared.
"""

import argparse
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from carrierflex.blind_check.case_plans import case_plans
from carrierflex.blind_check.labels import OUTSIDE
from carrierflex.blind_check.truth.carrier.truth import carrier_case
from carrierflex.diagnosis.carrier.off_order_lines import off_orders
from carrierflex.diagnosis.gap.findings import OffOrderMotion
from carrierflex.identification.campaign.campaign import Campaign

SMALLEST, LARGEST = 2.0, 10.0
#: Orders between which a line is drawn, and its least distance from an order.
LOWEST, HIGHEST = 0.3, 5.0
LEAST_DISTANCE = 0.12
#: A line is found where its order in the first run is met within this.
_MET = 0.05
#: Runs whose speeds differ by less are at one speed.
_ONE_SPEED = 0.02


@dataclass(frozen=True)
class DrawnLine:
    """A line: order or frequency [Hz], RMS over all channels in floors, its channel if alone."""

    position: float
    is_order: bool
    floors: float
    channel: int | None


def drawn_line(rng: np.random.Generator, speed: float, n_channels: int) -> DrawnLine:
    """Random line; `speed` [turns/s] puts a frequency beside the orders of most runs."""
    order = float(rng.uniform(LOWEST, HIGHEST))
    while abs(order - round(order)) < LEAST_DISTANCE:
        order = float(rng.uniform(LOWEST, HIGHEST))
    is_order = bool(rng.uniform() < 0.5)
    floors = float(SMALLEST * (LARGEST / SMALLEST) ** rng.uniform())
    channel = None if rng.uniform() < 0.5 else int(rng.integers(n_channels))
    return DrawnLine(order if is_order else order * speed, is_order, floors, channel)


def with_line(campaign: Campaign, line: DrawnLine, floor: float, phase: float) -> Campaign:
    """Campaign with a line in its signals; one that whirls has its phase from the sensor."""
    runs = []
    n_channels = len(campaign.channels)
    in_one = np.sqrt(n_channels) if line.channel is not None else 1.0
    amplitude = np.sqrt(2.0) * line.floors * floor * in_one
    for run in campaign.runs:
        turned = run.inputs["carrier_angle"] if line.is_order else 2.0 * np.pi * run.time
        signals = dict(run.signals)
        for number, channel in enumerate(campaign.channels):
            if line.channel in (None, number):
                assert channel.angle is not None  # a carrier's sensors have a place
                wave = np.sin(line.position * turned - channel.angle + phase)
                signals[channel.name] = signals[channel.name] + amplitude * wave
        runs.append(replace(run, signals=signals))
    return replace(campaign, runs=tuple(runs))


def is_met(
    motions: tuple[OffOrderMotion, ...], line: DrawnLine, names: list[str], speeds: list[float]
) -> bool:
    """Whether the strongest motion is the line: its place, what it keeps, and its sensors.

    At one speed, in one run or in all, an order is a frequency.
    """
    if not motions:
        return False
    strongest = max(motions, key=lambda motion: sum(motion.mean_square.values()))
    is_order = strongest.label.endswith("X")
    one_speed = max(speeds) - min(speeds) < _ONE_SPEED * max(speeds)
    if is_order != line.is_order and not one_speed:
        return False
    position = float(strongest.label.removesuffix("X").removesuffix("Hz"))
    order = position if is_order else position / speeds[0]
    true_order = line.position if line.is_order else line.position / speeds[0]
    alone = tuple(names) if line.channel is None else (names[line.channel],)
    return abs(order - true_order) < _MET and strongest.channels == alone


def campaigns(cases: int, seed: int) -> Iterator[tuple[str, Campaign, float]]:
    """Name, records without declared noise, and true noise of each case."""
    for plan in case_plans("carrier", cases, seed):
        if plan.family == OUTSIDE:
            continue
        campaign, label = carrier_case(plan)
        channels = tuple(replace(channel, noise_std=None) for channel in campaign.channels)
        name = f"{plan.family} {' '.join(plan.effects)}"
        yield name, replace(campaign, channels=channels), label.floor


def main(cases: int, seed: int) -> None:
    """Print every miss and the totals."""
    rng = np.random.default_rng([seed, 99])
    searched = 0
    n_met = 0
    invented = 0
    for name, campaign, floor in campaigns(cases, seed):
        speeds = [
            abs(run.inputs["carrier_angle"][-1] - run.inputs["carrier_angle"][0])
            / (2.0 * np.pi * (run.time[-1] - run.time[0]))
            for run in campaign.runs
        ]
        line = drawn_line(rng, float(np.median(speeds)), len(campaign.channels))
        changed = with_line(campaign, line, floor, float(rng.uniform(0.0, 6.0)))
        plain = off_orders(campaign).motions
        motions = off_orders(changed).motions
        names = [channel.name for channel in campaign.channels]
        searched += 1
        invented += bool(plain)
        is_found = is_met(motions, line, names, speeds)
        n_met += is_found
        if plain:
            print(f"invented, {name}: {[motion.id for motion in plain]}", flush=True)
        if not is_found:
            print(f"missed, {name}: {line}: {[motion.id for motion in motions]}", flush=True)
    print(f"{searched} campaigns: found {n_met}, invented in {invented}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=60)
    parser.add_argument("--seed", type=int, default=7)
    given = parser.parse_args()
    main(given.cases, given.seed)
