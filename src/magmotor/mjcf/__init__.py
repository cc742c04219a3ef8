"""For any MuJoCo model: magnetism, Brownian forces, viscous contact, the thermostat."""
