"""The main job: from the parameters of a carrier to a diagnosed gap."""
