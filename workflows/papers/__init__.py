"""Command on what the papers of 2011 and 2012 leave open: the gap of the 2012 paper."""
