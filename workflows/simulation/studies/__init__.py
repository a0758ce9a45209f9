"""Studies of the planetary stage that are run once, for a page of the docs or a shipped case."""
