"""Makes the curves of carriers off their drawing: ``python -m validation.independent_carrier``.

Each carrier has one dimension or constant off its drawing, or two, by 1 to 10 per cent.
"""

import csv
import os
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from validation.independent_carrier.calculix_elements import Elastic
from validation.independent_carrier.curves import ORDERS, Carrier, ComplexArray, TruthCarrier
from validation.independent_carrier.section_mesh import DRAWN

#: Pin fits [N m/rad] of every carrier besides bonded pins: 0 simply supported, inf rigid.
FITS = (0.0, 1e6, 1e7, 3e7, 1e8, np.inf)
BONDED = "bonded"
#: Lowest and highest change of a value over that of the drawing. One-sided where its neighbours
#: leave no more room: the rim reaches the sensor circle, the pin holes reach the hub.
CHANGES = {
    "outer_radius": (-0.045, 0.10),
    "planet_clearance_radius": (-0.10, 0.10),
    "E": (-0.10, 0.10),
    "hub_outer_diameter": (-0.10, -0.01),
    "upwind_plate_thickness": (-0.10, 0.10),
    "downwind_plate_thickness": (-0.10, 0.10),
    "centre_distance": (-0.009, 0.02),
    "hub_inner_diameter": (-0.10, 0.10),
    "plate_gap": (-0.10, 0.10),
    "web_inner_radius": (-0.10, 0.10),
    "pin_hole_diameter": (-0.10, 0.035),
    "pin_E": (-0.10, 0.10),
    "nu": (-0.10, 0.10),
}
#: Smallest change, but where the range itself is smaller.
_SMALLEST = 0.02
#: Narrowest gap between pin hole and hub that is meshed [m].
_SLIVER = 5e-4
#: Of so many carriers in turn, the last has two values off.
_CYCLE = 4
COLUMNS = (
    "carrier",
    "off",
    "fit",
    *(f"{coefficient}_{order}" for order in ORDERS for coefficient in ("a", "b")),
)


@dataclass(frozen=True)
class Made:
    """A carrier as made: what is off its drawing, by name, in SI units."""

    number: int
    off: dict[str, float]

    @property
    def carrier(self) -> Carrier:
        """Its dimensions and materials."""
        drawn = Carrier()
        dimensions = {**DRAWN, **{k: v for k, v in self.off.items() if k in DRAWN}}
        iron = Elastic(self.off.get("E", drawn.cast_iron.E), self.off.get("nu", drawn.cast_iron.nu))
        steel = replace(drawn.steel, E=self.off.get("pin_E", drawn.steel.E))
        return Carrier(dimensions, iron, steel)


def drawn_value(name: str) -> float:
    """Value on the drawing, in SI units."""
    carrier = Carrier()
    constants = {"E": carrier.cast_iron.E, "nu": carrier.cast_iron.nu, "pin_E": carrier.steel.E}
    return constants[name] if name in constants else DRAWN[name]


def carriers(count: int, seed: int) -> Iterator[Made]:
    """The drawing (number 0) and `count` carriers off it; the first ones do not depend on count."""
    rng = np.random.default_rng(seed)
    yield Made(0, {})
    names = tuple(CHANGES)
    for k in range(count):
        chosen = [names[k % len(names)]]
        if k % _CYCLE == _CYCLE - 1:
            chosen.append(str(rng.choice([name for name in names if name != chosen[0]])))
        while True:
            off = {name: drawn_value(name) * (1.0 + _change(name, rng)) for name in chosen}
            if _leaves_no_sliver(off):
                break
        yield Made(k + 1, off)


def _leaves_no_sliver(off: dict[str, float]) -> bool:
    """Whether pin hole and hub overlap or leave more than a sliver that no element fills."""
    d = {**DRAWN, **off}
    gap = d["centre_distance"] - d["pin_hole_diameter"] / 2.0 - d["hub_outer_diameter"] / 2.0
    return abs(gap) > _SLIVER


def _change(name: str, rng: np.random.Generator) -> float:
    low, high = CHANGES[name]
    least = min(_SMALLEST, -low / 2.0 if low < 0.0 < high else _SMALLEST)
    while True:
        change = float(rng.uniform(low, high))
        if abs(change) >= least:
            return change


def rows(made: Made, size: float, *, radial: bool = False) -> Iterator[list[str]]:
    """Rows of the table of one carrier: orders of the rim by pin fit, axial or `radial`."""
    truth = TruthCarrier(made.carrier, size)
    flexible, pin = truth.flexible(), truth.pin_stiffness()
    off = " ".join(f"{name}={value:.6g}" for name, value in made.off.items())
    curves: list[tuple[str, ComplexArray]] = [(BONDED, truth.bonded())]
    for fit in FITS:
        orders = flexible.with_pins(pin, fit) if fit else flexible.without_pins()
        curves.append((f"{fit:.3g}", orders))
    for fit_name, c in curves:
        # a cos + b sin of each order.
        of_rim = c[1 if radial else 0]
        coefficients = np.stack([of_rim.real, -of_rim.imag], axis=1).ravel()
        yield [
            str(made.number),
            off,
            fit_name,
            *(f"{coefficient:.5e}" for coefficient in coefficients),
        ]


def write_table(path: Path, count: int, seed: int, size: float, *, radial: bool = False) -> None:
    """Add to the table at `path` what it does not hold yet; it is written anew for each carrier.

    Raises
    ------
    ValueError
        Where the file holds something else.
    """
    table = _earlier_rows(path)
    for made in carriers(count, seed):
        if str(made.number) in table:
            continue
        table[str(made.number)] = list(rows(made, size, radial=radial))
        partial = path.with_name(f".{path.name}.partial")
        with partial.open("w", encoding="utf-8", newline="") as lines:
            every = [row for case_rows in table.values() for row in case_rows]
            csv.writer(lines, lineterminator="\n").writerows([COLUMNS, *every])
        os.replace(partial, path)
        off = table[str(made.number)][0][1]
        print(f"carrier {made.number} of {count}: {off or 'as drawn'}", flush=True)


def _earlier_rows(path: Path) -> dict[str, list[list[str]]]:
    """Rows of a table by carrier; none where there is no file."""
    table: dict[str, list[list[str]]] = {}
    if path.exists():
        with path.open(encoding="utf-8", newline="") as lines:
            head, *every = csv.reader(lines)
        if tuple(head) != COLUMNS:
            raise ValueError(f"{path}: is no table of rim curves; expected another --out")
        for row in every:
            table.setdefault(row[0], []).append(row)
    return table
