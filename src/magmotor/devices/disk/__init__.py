"""The sliding disk, and the Langevin particle for comparison."""
