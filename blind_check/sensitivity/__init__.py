"""How much verdicts depend on the constants of the decision."""
