"""Charts made up for `mm.recommend`, in which each choice is known."""

from typing import Any

# Of each method (h, error, wall seconds a step); simulated seconds cost seconds / h.
TOP = {
    "variational/euler": [(0.01, 0.004, 1e-6), (0.02, 0.008, 1e-6), (0.04, 0.016, 1e-6)],
    "variational/baoab": [(0.02, 2e-5, 3e-6), (0.04, 1e-4, 3e-6), (0.08, 0.02, 3e-6),
                          (0.1, 5e-3, 3e-6)],
    "mujoco/rk4": [(0.05, 1e-6, 2e-5), (0.1, 1e-4, 2e-5)],
}  # fmt: skip
DISK = {
    "mujoco/baoab": [(0.02, 0.006, 9e-8), (0.04, 0.007, 9e-8), (1.0, 0.008, 9e-8)],
    "variational/euler": [(0.02, 0.01, 1e-8), (0.04, 0.02, 1e-8)],
    "variational/baoab": [(0.02, 0.001, 2e-8), (0.04, 0.0001, 2e-8), (1.0, 0.0002, 2e-8)],
}
FLOOR = 0.005
TABLE: dict[str, Any] = {
    "machine": "abacus",
    "durations": {
        "Top": {"momentum_map": 60, "position": 20},
        "Disk": {"temperature": 160.0, "path": 10.0},
    },
    "points": [
        {"scene": scene, "surface": surface, "quantity": quantity, "method": method,
         "timestep": h, "error": error, "floor": floor, "seconds": seconds / h}
        for scene, surface, quantity, floor, methods in [
            ("Top", "planar", "momentum_map", 0.0, TOP),
            ("Top", "planar", "position", 0.0, {"mujoco/rk4": TOP["mujoco/rk4"]}),
            ("Top", "plane", "momentum_map", 0.0, {"mujoco/rk4": [(0.05, 0.009, 2e-5)]}),
            ("Disk", "planar", "temperature", FLOOR, DISK),
            ("Disk", "planar", "path", 0.0, DISK),
        ]
        for method, points in methods.items()
        for h, error, seconds in reversed(points)
    ],
}  # fmt: skip
