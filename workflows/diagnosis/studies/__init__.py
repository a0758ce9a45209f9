"""Studies of the diagnosis that are run by hand: tables over many campaigns."""
