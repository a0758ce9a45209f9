"""Modules of pyyeti, without what their import does to the printing of numbers.

They set numpy to the twelve digits of its version 1.13 for the whole process: numbers as text, and
what pandas writes afterwards, would be rounded.
"""

import numpy as np

with np.printoptions():
    from pyyeti import cyclecount
    from pyyeti.nastran import bulk, n2p, op4

__all__ = ["bulk", "cyclecount", "n2p", "op4"]
