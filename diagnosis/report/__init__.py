"""The report page: words, figures and layout of a diagnosis; diagnosis.json."""
