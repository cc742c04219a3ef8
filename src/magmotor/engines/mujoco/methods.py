"""The methods of the MuJoCo engine, known without importing MuJoCo."""

METHODS = ("mujoco/euler", "mujoco/implicitfast", "mujoco/rk4")

PLANAR = (*METHODS, "mujoco/baoab")
"""Of scenes without constraints but a viscous contact; the splitting BAOAB needs that."""
