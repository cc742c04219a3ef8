"""Responses of iron in a file, for programs without Python."""

from pathlib import Path
from typing import Annotated

import mujoco
import numpy as np

from magmotor.common.arguments import checked
from magmotor.common.files import whole_file
from magmotor.common.hints import output
from magmotor.mjcf.callbacks import acting_forces
from magmotor.mjcf.forces import responses
from magmotor.mjcf.forces.magnetic_state import stack_bytes


@checked
def save_responses(model: mujoco.MjModel, path: Annotated[str | Path, output()]) -> None:
    """Write how the iron of a model responds to fields, for programs without Python.

    They find the file by the environment variable `MAGMOTOR_RESPONSES` when they load the library
    of magmotor. It also contains what this process has computed for other models.

    Parameters
    ----------
    model : mujoco.MjModel
    path : path-like
        The file, which is replaced.

    Raises
    ------
    ValueError
        The model declares something invalid, or the file cannot be written.
    """
    acting_forces(model)
    stack_bytes(model)
    found = responses.kept()
    with whole_file(Path(path)) as part, part.open("wb") as file:
        file.write(responses.MARK + np.int64(len(found)).tobytes())
        for words in found:
            file.write(np.int64(len(words)).tobytes() + words.tobytes())
