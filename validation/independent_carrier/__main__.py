"""``python -m validation.independent_carrier --out FILE``."""

import argparse
from pathlib import Path

from validation.independent_carrier.truth_curves import write_table


def main() -> None:
    """Read the arguments and make the table."""
    parser = argparse.ArgumentParser(
        prog="python -m validation.independent_carrier",
        description="Rim curves of carriers off their drawing, by CalculiX (ccx), in m per kN m.",
    )
    parser.add_argument("--out", type=Path, required=True, help="CSV file; it is continued")
    parser.add_argument("--carriers", type=int, default=200, help="carriers off their drawing")
    parser.add_argument("--seed", type=int, default=44, help="seed of what is off")
    parser.add_argument("--size", type=float, default=0.06, help="edge of the elements [m]")
    parser.add_argument("--radial", action="store_true", help="radial curves, not axial ones")
    arguments = parser.parse_args()
    table = (arguments.out, arguments.carriers, arguments.seed, arguments.size)
    write_table(*table, radial=arguments.radial)


if __name__ == "__main__":
    main()
