"""`mm.advise` finds in the scenes what their charts found, by other code and another norm."""

import mujoco
import pytest

import magmotor as mm

CASES = {
    "top": (mm.Top(), "position", "body ball", 20.0, {"rk4": (0.016, 0.1)}),
    "disk": (mm.Disk(), "path", "body disk", 10.0, {"euler": (0.01, 0.05), "rk4": (0.01, 0.05)}),
    "motor": (mm.Motor(), "path", "body ball", 20.0, {"euler": (0.05, 1.1), "rk4": (0.1, 1.1)}),
}
"""A scene, its charted quantity, that of the advice, the duration, and ranges of timesteps."""

NAMES = {"euler": "Euler", "rk4": "RK4"}


@pytest.mark.parametrize("name", CASES)
def test_errors_are_those_of_the_charts(name):
    scene, charted, quantity, duration, methods = CASES[name]
    model = mm.build(scene, visual=False)
    model.opt.timestep = 0.01
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    with mm.magnetism():
        advice = mm.advise(model, data, quantity=quantity, duration=duration, error=0.01, budget=8)
    for method, (shortest, longest) in methods.items():
        ratios = []
        for point in advice.points:
            if point.integrator == NAMES[method] and shortest < point.timestep < longest:
                chart = mm.recommend(
                    scene, quantity=charted, method=f"mujoco/{method}", timestep=point.timestep
                )
                ratios.append(point.error / chart.error)
        # The charts take the error at the end, of many paths, over the distance traveled.
        assert len(ratios) >= 2
        assert min(ratios) > 0.08  # 0.24
        assert max(ratios) < 15.0  # 5.0
