"""Physics for any MuJoCo model: magnetism, Brownian forces, viscous contact, a thermostat."""
