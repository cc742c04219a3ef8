"""The methods of the MuJoCo engine, known without importing MuJoCo."""

METHODS = ("mujoco/euler", "mujoco/implicitfast", "mujoco/rk4")
