"""What one kind of campaign gives to the diagnosis.

Records, candidate effects, sums; no statistics, no kind.
"""
