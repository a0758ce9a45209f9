"""What every kind of campaign gives to the diagnosis."""
