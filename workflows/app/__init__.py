"""The page of `carrierflex app`: the commands in a browser on this machine, without a shell."""
