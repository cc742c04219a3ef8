"""Fields and potentials of uniformly magnetized bodies in closed form, one shape a module."""
