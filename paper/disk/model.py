"""The sliding disk as a MuJoCo model."""

from pathlib import Path

import mujoco

from magmotor.common import style
from magmotor.devices.disk.scene import Disk
from magmotor.run.in_mujoco import build
from paper.device_view import draw_device
from paper.figure import Claim, Figure, judged


def compute(_quick: bool) -> mujoco.MjModel:
    """Build the model."""
    return build(Disk())


def claims(model: mujoco.MjModel) -> list[Claim]:
    """Return our claim on (fig:slidingdisk), which only defines the disk."""
    joint_types = [mujoco.mjtJoint(number) for number in model.jnt_type]
    names = " and ".join(joint.name.removeprefix("mjJNT_").lower() for joint in joint_types)
    return [
        judged(
            "Ours: the model's configuration space is just R × SO(2), as the caption says",
            f"the model has {model.nv} degrees of freedom: {names}",
            joint_types == [mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE],
        )
    ]


def draw(_model: mujoco.MjModel, path: Path) -> None:
    """Draw the disk on its surface."""
    with style.figure(7.0, 5.2) as figure:
        draw_device(figure.subplots(), Disk(), "disk")
        figure.savefig(path, dpi=100)


FIGURE = Figure(
    "disk_device",
    "The sliding disk",
    "The MuJoCo model of the disk: it slides and rotates, and friction and noise act on the slip of"
    " its lowest point.",
    compute,
    claims,
    draw,
    (5,),
)
