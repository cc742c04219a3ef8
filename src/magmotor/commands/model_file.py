"""Models of MJCF files on the command line."""

from collections.abc import Callable
from pathlib import Path

import mujoco

from magmotor.advice.silence import quiet
from magmotor.commands.output import MISTAKE, fail
from magmotor.common.checks import reject


def load(path: Path) -> mujoco.MjModel:
    """Return the model of an MJCF file, or of one that MuJoCo has compiled (.mjb).

    Raises
    ------
    ValueError
        The file is not a model.
    """
    compiled = path.suffix.lower() == ".mjb"
    if path.is_dir() or (compiled and not path.exists()):
        raise reject("path", str(path), "must be a file")
    if not compiled:
        return mujoco.MjModel.from_xml_path(str(path))
    with quiet():
        try:
            return mujoco.MjModel.from_binary_path(str(path))
        except ValueError:
            sentence = f"must be a model that MuJoCo {mujoco.__version__} has compiled"
            raise reject("path", str(path), sentence) from None


def read(path: Path, keyframe: str = "") -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Return the model of a file, and its initial state or that of a keyframe.

    Raises
    ------
    ValueError
        The file is not a model, or has no such keyframe.
    """
    model = load(path)
    data = mujoco.MjData(model)
    if keyframe:
        names = [model.key(k).name for k in range(model.nkey)]
        if keyframe not in names:
            known = ", ".join(names) or "none"
            raise ValueError(f"keyframe = {keyframe!r}: must be one of the model's: {known}")
        mujoco.mj_resetDataKeyframe(model, data, names.index(keyframe))
    return model, data


def answer(question: Callable[[], None]) -> None:
    """Call a function; a mistake in the file or the options ends the program with one line."""
    try:
        question()
    except (ValueError, mujoco.FatalError) as error:
        fail(" ".join(str(error).split()), MISTAKE)
