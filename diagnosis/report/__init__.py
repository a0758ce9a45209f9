"""The report page: words, figures and layout of what a diagnosis found."""
