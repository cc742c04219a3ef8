"""Watch a scene live in MuJoCo's viewer, and meddle with it: pull, tilt, heat, brake.

The mouse pulls what it points at: double-click a body, then Ctrl and drag (left turns, right
moves). The panel Control, at the right, has sliders for what the scene has of tilt and height of
the ring, friction, and temperature. Keys: space pauses, 8 turns noise off and on, 9 magnetism,
6 and 7 halve and double the speed, Backspace starts again, Tab shows the viewer's own panel.

A `model` is any MJCF: magnetism, noise and potentials act where it declares them. On macOS run this
by `mjpython`, which MuJoCo brings, instead of `python`.
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
from command_line import (
    DIVERGED,
    INTERRUPTED,
    MISTAKE,
    NO_OPENGL,
    fail,
    parse,
    run_script,
    warn_in_one_line,
)
from mujoco import FatalError, MjModel, MjvPerturb, mjtCamera, mjtRndFlag, set_mju_user_warning

from magmotor.common.checks import check_number, reject
from magmotor.common.interrupts import deferred
from magmotor.live import LiveSimulation, Pace, StateLost, live_scene

HELP = """\
keys: space pauses, 6 and 7 slower and faster, 8 noise, 9 magnetism, Backspace starts again
mouse: double-click a body, then Ctrl + drag (left turns, right moves); sliders: Control"""

SWITCHES = {"8": "noise", "9": "magnetism"}
"""Keys that no panel of the viewer has, as letters are."""

FRAME = 1 / 60
"""Wall time of a frame (s)."""

CLOSING = 5.0
"""Wall time that a window is given to close (s)."""


@dataclass
class Options:
    method: str = "mujoco/euler"
    """mujoco/euler, mujoco/implicitfast or mujoco/rk4"""
    timestep: float = 0.01
    """(s)"""
    speed: float = 1.0
    """simulated seconds in a second"""
    seed: int = 0
    """of the Brownian path"""


@dataclass
class MotorOptions(Options):
    timestep: float = 0.02
    """(s)"""
    speed: float = 20.0
    """simulated seconds in a second"""


@dataclass
class ModelOptions:
    """Watch any MJCF live; magnetism, noise and potentials act where it declares them."""

    path: tyro.conf.Positional[Path]
    """the MJCF file"""
    speed: float = 1.0
    """simulated seconds in a second"""
    seed: int = 0
    """of the Brownian path, if the model has nuserdata"""


SCENES = {"top": Options, "disk": Options, "motor": MotorOptions, "model": ModelOptions}


def main() -> None:
    warn_in_one_line()
    scene, options = parse(SCENES, __doc__ or "", tuple(SCENES))
    try:
        check_number("speed", options.speed, above=0)
        simulation = make(scene, options)
    except (ValueError, FatalError) as error:
        fail(" ".join(str(error).split()), MISTAKE)
    set_mju_user_warning(say)  # else into a file
    with deferred() as interrupted:  # a window that opens or closes would crash
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


def say(message: str) -> None:
    print(f"{Path(sys.argv[0]).name}: {message}", file=sys.stderr)


def check_display() -> None:
    """End the program where no window can be opened, for which MuJoCo would wait for ever."""
    if sys.platform == "darwin":
        from mujoco import viewer

        if viewer._MJPYTHON is None:
            fail("no window: on macOS run it by mjpython instead of python", NO_OPENGL)
        return
    import glfw

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        window = None
        if glfw.init():
            glfw.window_hint(glfw.VISIBLE, glfw.FALSE)
            window = glfw.create_window(8, 8, "", None, None)
        code, why = glfw.get_error()
    if window is None:
        why = why.decode() if isinstance(why, bytes) else f"GLFW's error {code}"
        fail(f"no window: {why} (it needs a display with OpenGL)", NO_OPENGL)
    glfw.destroy_window(window)


def show(simulation: LiveSimulation, speed: float, interrupted: threading.Event) -> None:
    """Open the window, and step until it is closed."""
    from mujoco.viewer import launch_passive

    pressed: SimpleQueue[int] = SimpleQueue()
    others = set(threading.enumerate())
    model, data = simulation.model, simulation.data
    try:
        with launch_passive(model, data, key_callback=pressed.put, show_left_ui=False) as viewer:
            simulation.reset()  # opening the window computes without our forces
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
            thread.join(CLOSING)  # the viewer's: Python must not end while it draws


def aim(viewer: Any, model: MjModel) -> None:
    """See the whole scene from above; follow a disk, which leaves the shadows' region."""
    camera = viewer.cam
    camera.azimuth, camera.elevation = 90, -35
    camera.lookat[:], camera.distance = model.stat.center, 2.9 * model.stat.extent
    names = [model.body(i).name for i in range(model.nbody)]
    if "disk" in names:
        camera.type, camera.trackbodyid = mjtCamera.mjCAMERA_TRACKING, names.index("disk")
        camera.elevation = -12
        viewer.user_scn.flags[mjtRndFlag.mjRND_SHADOW] = 0


class Loop:
    """What happens between two frames; the window is not its business."""

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
        """Take the steps that are due; a state that is lost is the initial one again, paused."""
        steps = self.pace.steps(now, self.simulation.model.opt.timestep)
        if self.paused:
            self.simulation.hold(perturb)
            return
        try:
            self.simulation.advance(steps, perturb)
        except StateLost as error:
            self.simulation.reset()
            self.simulation.notice = f"{error}: reset; space to go on"
            self.paused = True
            say(f"{error}: reset and paused")

    def texts(self) -> tuple[str, str]:
        """Two columns to write into the window."""
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


if __name__ == "__main__":
    run_script(main)
