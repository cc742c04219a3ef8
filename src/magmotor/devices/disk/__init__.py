"""The sliding disk, and the Langevin particle beside it."""
