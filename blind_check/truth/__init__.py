"""The truth of every case, by equations of its own: nothing of the simulator or the diagnosis is used."""
