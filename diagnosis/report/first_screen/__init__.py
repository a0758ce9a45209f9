"""What a report shows first: the machine, the signals, the answer's worth and the next step."""
