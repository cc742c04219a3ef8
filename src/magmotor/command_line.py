"""The command `magmotor`: what can be asked about an MJCF file without a program."""

import sys
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

import mujoco
import tyro

from magmotor.advice.advise import advise
from magmotor.mjcf.checking.check import check
from magmotor.mjcf.describe import describe
from magmotor.mjcf.magnetism import magnetism

UNANSWERED, MISTAKE, INTERRUPTED = 1, 2, 130
"""Exit codes."""


@dataclass
class Advise:
    """Measure which integrator and timestep reach an error of a model at the least cost.

    The exit code is 1 if nothing reaches the error.
    """

    model: tyro.conf.Positional[Path]
    """MJCF file"""
    quantity: str = "positions"
    """what must be accurate: positions, energy, "body NAME", "site NAME", "joint NAME", "tendon
    NAME" or "sensor NAME\""""
    duration: float = 1.0
    """duration of the motion in s"""
    error: float = 0.01
    """admissible error, relative to the range of the quantity"""
    budget: float = 60.0
    """time in s that the measurement may take"""
    detail: bool = False
    """also report what each feature of the model costs, and which can be dropped at this error"""
    kT: float | None = None
    """temperature in J, at which the splittings of mm.Langevin are compared"""
    keyframe: str = ""
    """initial state: the name of a keyframe; the model's own by default"""
    picture: Path = Path("advice.png")
    """picture to write"""

    def run(self) -> None:
        """Print the advice, and draw it."""
        model, data = read(self.model, self.keyframe)
        text = mujoco.mjtObj.mjOBJ_TEXT
        is_ours = model.nuser_site > 0 or mujoco.mj_name2id(model, text, "magmotor") >= 0
        with magnetism() if is_ours else nullcontext():
            advice = advise(
                model, data, quantity=self.quantity, duration=self.duration, error=self.error,
                budget=self.budget, detail=self.detail, kT=self.kT,
                picture=self.picture,
            )  # fmt: skip
        if advice.points:
            print(f"wrote {self.picture}")
        if advice.integrator is None:
            raise SystemExit(UNANSWERED)


@dataclass
class Check:
    """Say what of a model with magnets will fail, and which settings hold.

    The exit code is 1 if there are findings.
    """

    model: tyro.conf.Positional[Path]
    """MJCF file"""
    keyframe: str = ""
    """state: the name of a keyframe; the model's own by default"""

    def run(self) -> None:
        """Print the findings."""
        if check(*read(self.model, self.keyframe)).findings:
            raise SystemExit(UNANSWERED)


@dataclass
class Describe:
    """Say what of a model is magnetic, and what has a temperature."""

    model: tyro.conf.Positional[Path]
    """MJCF file"""

    def run(self) -> None:
        """Print the description."""
        describe(read(self.model)[0])


def read(path: Path, keyframe: str = "") -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Return the model of a file, and its initial state or that of a keyframe.

    Raises
    ------
    ValueError
        The file is not a model, or has no such keyframe.
    """
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    if keyframe:
        names = [model.key(k).name for k in range(model.nkey)]
        if keyframe not in names:
            known = ", ".join(names) or "none"
            raise ValueError(f"keyframe = {keyframe!r}: must be one of the model's: {known}")
        mujoco.mj_resetDataKeyframe(model, data, names.index(keyframe))
    return model, data


def main() -> None:
    """Run the command; a mistake ends it with one line and code 2."""
    commands = {"advise": Advise, "check": Check, "describe": Describe}
    try:
        tyro.extras.subcommand_cli_from_dict(
            commands, prog="magmotor", description="Magnetism and temperature for MuJoCo."
        ).run()
    except (ValueError, OSError, mujoco.FatalError) as error:
        _fail(str(error), MISTAKE)
    except KeyboardInterrupt:
        _fail("interrupted", INTERRUPTED)


def _fail(message: str, code: int) -> NoReturn:
    print(f"magmotor: {' '.join(message.split())}", file=sys.stderr)
    raise SystemExit(code)
