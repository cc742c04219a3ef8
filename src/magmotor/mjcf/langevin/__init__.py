"""The Langevin splitting BAOAB for MuJoCo models."""
