"""What a body's coordinates look like: its surface and the displacement field of each on it."""
