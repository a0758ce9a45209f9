"""What one kind of campaign gives to the diagnosis: records, candidate effects, sums; no statistics, no kind."""
