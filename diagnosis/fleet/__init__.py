"""Many diagnoses together: sizes by turbine and date, their common prior, trends, differences."""
