"""How often a campaign's verdict comes up where each candidate is true."""
