"""Permanent magnets of real shapes: their moment and mass, dipoles that represent them, MJCF."""
