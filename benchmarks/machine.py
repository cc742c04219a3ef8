"""Where a chart was measured, and with what, as its small print."""

from store import machine, versions


def small_print() -> str:
    found = versions()
    used = ", ".join(f"{name} {found[name]}" for name in ("magmotor", "mujoco", "python"))
    return f"one core of {machine()}; {used}"
