"""Bodies of any solid elements: their matrices, then everything as for those of another program."""
