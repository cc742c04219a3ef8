"""The only two magnets of a model that can meet, as `mm.check` sees them."""

from typing import Any

import mujoco

from magmotor.mjcf.checking.closest_approach import meetings


def meeting(model) -> tuple[mujoco.MjData, Any]:
    """Return the initial data of a model, and how its two magnets meet."""
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    (found,) = meetings(model, data)
    assert found.approach
    return data, found
