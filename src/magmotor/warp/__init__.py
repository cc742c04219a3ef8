"""Magnets and noise in MuJoCo Warp, which `pip install "magmotor[warp]"` installs.

`put_model` takes the place of `mujoco_warp.put_model`; everything else is as always:

    import magmotor.warp
    import mujoco_warp

    m = magmotor.warp.put_model(model)
    d = mujoco_warp.put_data(model, data, nworld=1024)
    mujoco_warp.step(m, d)
"""

from magmotor.common.optional import extra

with extra("warp"):
    import mujoco_warp  # noqa: F401

from magmotor.warp.dipoles import Dipoles as Dipoles
from magmotor.warp.fields import Field as Field
from magmotor.warp.magnets import Magnets as Magnets
from magmotor.warp.models import put_model as put_model
from magmotor.warp.noise import Noise as Noise
from magmotor.warp.potentials import Potentials as Potentials

__all__ = ["Dipoles", "Field", "Magnets", "Noise", "Potentials", "put_model"]
