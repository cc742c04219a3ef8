"""The Langevin splitting BAOAB, with MuJoCo as its engine."""
