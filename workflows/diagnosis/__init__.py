"""Questions about the gap: diagnosis, blind check, public benchmark records."""
