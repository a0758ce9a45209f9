"""Every figure of the 2011 and the 2012 paper, drawn from this project's own runs."""
