"""Measure which integrator and timestep reach an error of a model at the least cost.

The exit code is 1 if nothing reaches the error.
"""

from contextlib import nullcontext
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import mujoco
import numpy as np
import tyro

from magmotor.advice.advise import advise
from magmotor.commands.model_file import answer, read
from magmotor.commands.output import make_folder, written_whole
from magmotor.commands.parsing import parse_options
from magmotor.commands.picture_options import check_as
from magmotor.common import style
from magmotor.common.checks import check_number
from magmotor.common.exceptions import ArgumentError, InputError
from magmotor.common.hints import Dpi, Picture
from magmotor.mjcf.checking.check import check
from magmotor.mjcf.magnetism import magnetism
from magmotor.noise import check_seed

UNANSWERED = 1
"""Exit code if nothing reaches the error."""

AT_REST = "does not change along the path"
"""What `advise` says of a state with nothing to move it."""


@dataclass
class Options:
    """Options of the command."""

    model: tyro.conf.Positional[Path]
    """MJCF file"""
    quantity: str = "positions"
    """what must be accurate: positions, energy, "body NAME", "site NAME", "joint NAME", "tendon
    NAME" or "sensor NAME\""""
    duration: float | None = None
    """duration of the motion in s; by default 1 s, or 48 timesteps if that is longer"""
    error: float = 0.01
    """admissible error, relative to the range of the quantity"""
    every_element: bool = True
    """each element must be accurate, relative to its own range, not only the whole"""
    budget: float = 60.0
    """time in s that the measurement may take"""
    detail: bool = False
    """also report what each feature of the model costs, and which can be dropped at this error"""
    kT: float | None = None
    """temperature in J, at which the splittings of mm.Langevin are compared"""
    keyframe: str = ""
    """name of the keyframe to start from; by default the model's initial state"""
    velocity: float = 0.0
    """standard deviation of random velocities in m/s and rad/s, which are added to the state's"""
    seed: int = 0
    """seed of the random velocities"""
    control: tuple[float, ...] = ()
    """controls, which stay constant: one number for all actuators, or one for each"""
    picture: Path | None = Path("advise.png") if find_spec("matplotlib") else None
    """picture to write, as .png, .pdf or .svg; without matplotlib, none"""
    dpi: int = style.DPI
    """dots per inch of the picture"""

    def check_picture(self) -> None:
        """Check what would otherwise fail only after the measurement."""
        if self.picture is None:
            return
        style.check_matplotlib()
        check_as(Picture, "picture", self.picture.name)
        check_as(Dpi, "dpi", self.dpi)
        make_folder(self.picture.parent)


def main() -> None:
    """Print the advice, and draw it."""
    options = parse_options(Options, __doc__)
    answer(lambda: report(options))


def report(options: Options) -> None:
    """Print the advice, and draw it."""
    model, data = read(options.model, options.keyframe)
    options.check_picture()
    push(model, data, options.velocity, options.seed)
    actuate(model, data, options.control)
    text = mujoco.mjtObj.mjOBJ_TEXT
    is_ours = model.nuser_site > 0 or mujoco.mj_name2id(model, text, "magmotor") >= 0
    try:
        # At a temperature, the forces are those of `Langevin`.
        with magnetism() if is_ours and options.kT is None else nullcontext():
            advice = advise(
                model,
                data,
                quantity=options.quantity,
                duration=options.duration,
                error=options.error,
                every_element=options.every_element,
                budget=options.budget,
                detail=options.detail,
                kT=options.kT,
            )
    except ValueError as error:
        if AT_REST in str(error):
            moving = ", ".join(options_that_move(model))
            raise InputError(f"{error}; options that set it in motion: {moving}") from error
        raise
    print(advice)
    if options.picture is not None and advice.points:
        with written_whole(options.picture) as part:
            advice.draw(part, options.dpi)
        print(f"wrote {options.picture}")
    if not advice.method:
        if is_ours:
            print_findings(model, data)
        raise SystemExit(UNANSWERED)


def print_findings(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Print what `check` finds, if anything, since that may be why nothing reaches the error."""
    found = check(model, data).findings
    if found:
        print("what `magmotor check` finds may be the reason:", *found, sep="\n")


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
        raise ArgumentError(
            "control", control, "must be left out, since the model has no actuators"
        )
    if len(control) not in (1, model.nu):
        raise ArgumentError(
            "control", control, f"must be one number, or {model.nu}, one per actuator"
        )
    most = mujoco.mjMAXVAL
    data.ctrl[:] = [check_number("control", u, above=-most, below=most) for u in control]


def options_that_move(model: mujoco.MjModel) -> list[str]:
    """Return the options of `advise` that set a model in motion."""
    options = ["--velocity 0.5 (random velocities)"]
    if model.nu > 0:
        options.append("--control 1 (all actuators)")
    if model.nkey > 0:
        options.append("--keyframe NAME")
    return options
