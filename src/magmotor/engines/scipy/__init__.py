"""The deterministic truth: ordinary differential equations integrated by SciPy's DOP853."""
