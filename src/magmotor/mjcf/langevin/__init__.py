"""Langevin dynamics of MuJoCo models by splittings."""
