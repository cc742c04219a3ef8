"""Watch a scene live in MuJoCo's viewer and interact with it: pull, tilt, heat, brake.

To pull a body with the mouse, double-click it, then hold Ctrl and drag (left button turns, right
button moves). The panel Control, on the right, has sliders for the scene's ring height and tilt,
friction, and temperature. Keys: space pauses, 8 toggles noise, 9 toggles magnetism, 6 and 7 halve
and double the speed, Backspace resets, Tab shows the viewer's own panel.

A `model` is any MJCF file; the magnetism, noise and potentials that it declares act. On macOS, run
this with `mjpython`, which comes with MuJoCo, instead of `python`.
"""

import sys
import threading
import time
import warnings
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import tyro
from mujoco import (
    FatalError,
    MjModel,
    MjvPerturb,
    mjtCamera,
    mjtRndFlag,
    mjv_defaultFreeCamera,
    set_mju_user_warning,
)

from magmotor.commands.output import (
    DIVERGED,
    INTERRUPTED,
    MISTAKE,
    NO_OPENGL,
    fail,
    warn_in_one_line,
)
from magmotor.commands.scene_options import parse
from magmotor.common.checks import check_number, reject
from magmotor.common.interrupts import deferred
from magmotor.live import LiveSimulation, Pace, StateLost, live_scene

HELP = """\
keys: space pauses, 6 slower, 7 faster, 8 noise, 9 magnetism, Backspace resets
mouse: double-click a body, then Ctrl + drag (left turns, right moves); sliders: panel Control"""

SWITCHES = {"8": "noise", "9": "magnetism"}
"""Keys without a function in the viewer itself, unlike all letters."""

FRAME = 1 / 60
"""Wall time per frame (s)."""

CLOSING = 5.0
"""Wall time (s) to wait for a window to close."""


@dataclass
class Options:
    method: str = "mujoco/euler"
    """mujoco/euler, mujoco/implicitfast or mujoco/rk4"""
    timestep: float = 0.01
    """(s)"""
    speed: float = 1.0
    """simulated seconds per second"""
    seed: int = 0
    """seed of the Brownian path"""


@dataclass
class MotorOptions(Options):
    timestep: float = 0.02
    """(s)"""
    speed: float = 20.0
    """simulated seconds per second"""


@dataclass
class ModelOptions:
    """Watch any MJCF model live, with the magnetism, noise and potentials that it declares."""

    path: tyro.conf.Positional[Path]
    """the MJCF file"""
    speed: float = 1.0
    """simulated seconds per second"""
    seed: int = 0
    """seed of the Brownian path, if the model has nuserdata"""


SCENES = {"top": Options, "disk": Options, "motor": MotorOptions, "model": ModelOptions}


def main() -> None:
    warn_in_one_line()
    scene, options = parse(SCENES, __doc__ or "", tuple(SCENES))
    try:
        check_number("speed", options.speed, above=0)
        simulation = make(scene, options)
    except (ValueError, FatalError) as error:
        fail(" ".join(str(error).split()), MISTAKE)
    set_mju_user_warning(report)  # by default MuJoCo writes to a file
    with deferred() as interrupted:  # Ctrl-C would crash a window that opens or closes
        check_display()
        print(HELP, flush=True)
        try:
            show(simulation, options.speed, interrupted)
        except FatalError as error:
            fail(str(error), DIVERGED)
    if interrupted.is_set():
        fail("interrupted", INTERRUPTED)


def make(scene: Any, options: Any) -> LiveSimulation:
    if isinstance(options, ModelOptions):
        if options.path.is_dir():
            raise reject("path", str(options.path), "must be a file")
        model = MjModel.from_xml_path(str(options.path))
        return LiveSimulation(model, seed=options.seed)
    numerics = {"method": options.method, "timestep": options.timestep, "seed": options.seed}
    return live_scene(scene, **numerics)


def report(message: str) -> None:
    print(f"{Path(sys.argv[0]).name}: {message}", file=sys.stderr)


def check_display() -> None:
    """End the program if no window can be opened, since MuJoCo would wait for one forever."""
    if sys.platform == "darwin":
        from mujoco import viewer

        if viewer._MJPYTHON is None:
            fail("no window: on macOS use mjpython instead of python", NO_OPENGL)
        return
    import glfw

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        window = None
        if glfw.init():
            glfw.window_hint(glfw.VISIBLE, glfw.FALSE)
            window = glfw.create_window(8, 8, "", None, None)
        code, reason = glfw.get_error()
    if window is None:
        reason = reason.decode() if isinstance(reason, bytes) else f"GLFW error {code}"
        fail(f"no window: {reason} (a display with OpenGL is needed)", NO_OPENGL)
    glfw.destroy_window(window)


def show(simulation: LiveSimulation, speed: float, interrupted: threading.Event) -> None:
    """Open the window and step the simulation until it is closed."""
    from mujoco.viewer import launch_passive

    pressed: SimpleQueue[int] = SimpleQueue()
    others = set(threading.enumerate())
    model, data = simulation.model, simulation.data
    try:
        with launch_passive(model, data, key_callback=pressed.put, show_left_ui=False) as viewer:
            simulation.reset()  # opening the window has computed without our forces
            aim(viewer, model)
            loop = Loop(simulation, speed)
            while viewer.is_running() and not interrupted.is_set():
                begin = time.perf_counter()
                while not pressed.empty():
                    loop.press(pressed.get())
                loop.step(begin, viewer.perturb)
                viewer.set_texts((None, None, *loop.texts()))
                viewer.sync()
                simulation.apply_input()
                time.sleep(max(0.0, begin + FRAME - time.perf_counter()))
    finally:
        for thread in set(threading.enumerate()) - others:
            thread.join(CLOSING)  # threads of the viewer, which must not draw when Python ends


def aim(viewer: Any, model: MjModel) -> None:
    """Show the whole model; follow a disk, which leaves the region of shadows."""
    camera = viewer.cam
    mjv_defaultFreeCamera(model, camera)
    names = [model.body(i).name for i in range(model.nbody)]
    if "disk" in names:
        camera.type, camera.trackbodyid = mjtCamera.mjCAMERA_TRACKING, names.index("disk")
        camera.elevation = -12
        viewer.user_scn.flags[mjtRndFlag.mjRND_SHADOW] = 0


class Loop:
    """The actions between two frames, independent of the window."""

    def __init__(self, simulation: LiveSimulation, speed: float):
        self.simulation, self.paused = simulation, False
        self.pace = Pace(speed, time.perf_counter())

    def press(self, key: int) -> None:
        match chr(key):
            case " ":
                self.paused = not self.paused
            case "6":
                self.pace.speed /= 2
            case "7":
                self.pace.speed *= 2
            case switch if switch in SWITCHES:
                self.simulation.switch(SWITCHES[switch])

    def step(self, now: float, perturb: MjvPerturb) -> None:
        """Take the steps that are due; if the state is lost, reset and pause."""
        steps = self.pace.steps(now, self.simulation.model.opt.timestep)
        if self.paused:
            self.simulation.hold(perturb)
            return
        try:
            self.simulation.advance(steps, perturb)
        except StateLost as error:
            self.simulation.reset()
            self.simulation.notice = f"{error}: reset; space continues"
            self.paused = True
            report(f"{error}: reset and paused")

    def texts(self) -> tuple[str, str]:
        """Return the two text columns shown in the window."""
        simulation = self.simulation
        rows = {
            "time": f"{abs(simulation.data.time):.1f}",
            "6, 7: speed": f"{self.pace.speed:g}",
        }
        for key, name in SWITCHES.items():
            if simulation.declared[name]:
                rows[f"{key}: {name}"] = "on" if simulation.on[name] else "off"
        rows["space"] = "paused" if self.paused else "pause"
        rows["Backspace"] = "reset"
        if simulation.notice:
            rows[simulation.notice] = ""
        return "\n".join(rows), "\n".join(rows.values())
