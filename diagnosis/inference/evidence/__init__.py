"""Bayesian evidence of the candidates that the search compared."""
