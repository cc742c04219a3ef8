"""The command `magmotor`: what can be asked about an MJCF file without a program."""

import sys
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

import mujoco
import numpy as np
import tyro

from magmotor.advice.advise import advise
from magmotor.common.checks import check_number, reject
from magmotor.mjcf.checking.check import check
from magmotor.mjcf.describe import describe
from magmotor.mjcf.magnetism import magnetism
from magmotor.noise import check_seed

UNANSWERED, MISTAKE, INTERRUPTED = 1, 2, 130
"""Exit codes."""

AT_REST = "does not change along the path"
"""What `advise` says of a state with nothing to move it."""


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
    duration: float | None = None
    """duration of the motion in s; by default 1 s, or 48 timesteps if that is longer"""
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
    velocity: float = 0.0
    """standard deviation of random velocities in m/s and rad/s, which are added to the state's"""
    seed: int = 0
    """seed of the random velocities"""
    control: tuple[float, ...] = ()
    """controls, which stay constant: one number for all actuators, or one for each"""
    picture: Path = Path("advise.png")
    """picture to write"""

    def run(self) -> None:
        """Print the advice, and draw it."""
        model, data = read(self.model, self.keyframe)
        push(model, data, self.velocity, self.seed)
        actuate(model, data, self.control)
        text = mujoco.mjtObj.mjOBJ_TEXT
        is_ours = model.nuser_site > 0 or mujoco.mj_name2id(model, text, "magmotor") >= 0
        try:
            with magnetism() if is_ours else nullcontext():
                advice = advise(
                    model, data, quantity=self.quantity, duration=self.duration, error=self.error,
                    budget=self.budget, detail=self.detail, kT=self.kT, picture=self.picture,
                )  # fmt: skip
        except ValueError as error:
            if AT_REST in str(error):
                options = ", ".join(options_that_move(model))
                raise ValueError(f"{error}; options that set it in motion: {options}") from error
            raise
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


def push(model: mujoco.MjModel, data: mujoco.MjData, speed: float, seed: int) -> None:
    """Add random velocities, of a standard deviation in m/s and rad/s, to a state."""
    speed, seed = check_number("velocity", speed, at_least=0.0), check_seed(seed)
    data.qvel += speed * np.random.default_rng(seed).standard_normal(model.nv)


def actuate(model: mujoco.MjModel, data: mujoco.MjData, control: tuple[float, ...]) -> None:
    """Set the controls of a state.

    Raises
    ------
    ValueError
        There is neither one number for all actuators, nor one for each.
    """
    if not control:
        return
    if model.nu == 0:
        raise reject("control", control, "must be left out, since the model has no actuators")
    if len(control) not in (1, model.nu):
        raise reject("control", control, f"must be one number, or {model.nu}, one per actuator")
    data.ctrl[:] = [check_number("control", value) for value in control]


def options_that_move(model: mujoco.MjModel) -> list[str]:
    """Return the options of `advise` that set a model in motion."""
    options = ["--velocity 0.5 (random velocities)"]
    if model.nu > 0:
        options.append("--control 1 (all actuators)")
    if model.nkey > 0:
        options.append("--keyframe NAME")
    return options


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
