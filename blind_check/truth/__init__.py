"""The truth of every case, by equations of its own.

Nothing of the simulator or the diagnosis is used.
"""
