"""The command as a shell meets it: signatures, options of every command, refusals, JSON."""
