"""The table of a fuzz run, told at its end."""

import os

from tests.fuzz.counts import COUNTS


def pytest_terminal_summary(terminalreporter):
    if not COUNTS:
        return
    columns = ("tried", "accepted", "refused", "traceback", "hang", "above 400 MB", "unnamed")
    write = terminalreporter.write_line
    write(f"{'reader':22s}" + "".join(f"{name:>14s}" for name in columns))
    for reader, counts in COUNTS.items():
        write(f"{reader:22s}" + "".join(f"{counts[name]:14d}" for name in columns))
    total = {name: sum(counts[name] for counts in COUNTS.values()) for name in columns}
    write(f"{'all':22s}" + "".join(f"{total[name]:14d}" for name in columns))
    write(f"inputs asked for: {os.environ.get('FUZZ_INPUTS', '2000')}")
