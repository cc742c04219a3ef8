"""What only Numba runs, to compile: other modules import this when they need compiled code."""
