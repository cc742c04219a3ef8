"""The reference engine: variational integrators and splittings, which use no MuJoCo."""
