"""Models as functional mock-up units: C source, description, library of this platform."""
