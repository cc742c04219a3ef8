"""Which integrator and timestep of MuJoCo a model needs, by measurement."""
