"""From the files of a data logger to a campaign.

Readers of foreign tables, and the map that says what their columns are.
"""
