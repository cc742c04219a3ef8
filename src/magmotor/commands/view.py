"""Watch a scene live, in a window or in a browser, and interact with it: pull, tilt, heat, brake.

With --web, any browser shows the scene, with sliders and curves: on this computer, or over SSH.
Otherwise MuJoCo's viewer opens. To pull a body with the mouse, double-click it, then hold Ctrl and
drag (left button turns, right button moves). The panel Control, on the right, has sliders for the
scene's ring height and tilt, friction, and temperature. Keys: space pauses, 8 toggles noise, 9
toggles magnetism, 6 and 7 halve and double the speed, the period selects arrows for moments and
field, Backspace resets, Tab shows the viewer's own panel.

A `model` is any MJCF file; the magnetism, noise and potentials that it declares act. The word
`model` can be left out. On macOS, run this with `mjpython`, which comes with MuJoCo, instead of
`python`; --web does not need it.
"""

import socket
import sys
import threading
import time
import warnings
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import tyro
from mujoco import FatalError, MjModel, mjtCamera, mjtRndFlag, set_mju_user_warning

from magmotor.commands.model_file import load
from magmotor.commands.output import (
    DIVERGED,
    INTERRUPTED,
    MISTAKE,
    NO_OPENGL,
    fail,
    report,
    warn_in_one_line,
)
from magmotor.commands.scene_options import KINDS, parse
from magmotor.common.checks import check_number
from magmotor.common.interrupts import deferred
from magmotor.common.optional import require
from magmotor.live import LiveSimulation, Loop, WebView, live_scene
from magmotor.live.viewpoint import free_camera, traveler
from magmotor.live.web import HOST, PORT

HELP = """\
keys: space pauses, 6 slower, 7 faster, 8 noise, 9 magnetism, . arrows, Backspace resets
mouse: double-click a body, then Ctrl + drag (left turns, right moves); sliders: panel Control"""

FRAME = 1 / 60
"""Wall time per frame (s)."""

CLOSING = 5.0
"""Wall time (s) to wait for a window to close."""


MODELS = ".xml", ".mjcf", ".mjb", ".mjz"
"""Endings of the names of files, before which the word `model` may be left out."""


@dataclass
class Display:
    web: bool = False
    """show it in a browser instead of a window"""
    host: str = HOST
    """address on which to listen for browsers: 127.0.0.1 for this computer only, 0.0.0.0 for every
    network, without a password"""
    port: int = PORT
    """port on which to listen for browsers; if it is taken, the next free one is used"""


@dataclass
class Options(Display):
    method: str = "mujoco/euler"
    """mujoco/euler, mujoco/implicitfast or mujoco/rk4"""
    timestep: float = 0.01
    """timestep (s)"""
    speed: float = 1.0
    """simulated seconds per second"""
    seed: int = 0
    """seed of the Brownian path"""


@dataclass
class MotorOptions(Options):
    timestep: float = 0.02
    """timestep (s)"""
    speed: float = 20.0
    """simulated seconds per second"""


@dataclass(kw_only=True)
class ModelOptions(Display):
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
    arguments = sys.argv[1:]
    scenes = [k for k, word in enumerate(arguments) if word in SCENES or _is_model(word)]
    if scenes and arguments[0].startswith("-"):  # options may come first
        arguments = [arguments.pop(scenes[0]), *arguments]
    if arguments and _is_model(arguments[0]):
        arguments = ["model", *arguments]
    allowed = f"{', '.join(KINDS)}, or an MJCF file ({', '.join(MODELS)})"
    scene, options = parse(SCENES, __doc__ or "", tuple(SCENES), arguments, allowed)
    require(*["scenes"] * (scene is not None), *["web"] * options.web)
    set_mju_user_warning(report)  # by default MuJoCo writes to a file
    try:
        check_number("speed", options.speed, above=0)
        simulation = make(scene, options)
    except (ValueError, FatalError) as error:
        fail(" ".join(str(error).split()), MISTAKE)
    with deferred() as interrupted:  # Ctrl-C would crash a window that opens or closes
        loop = Loop(simulation, options.speed, report)
        show_warnings(simulation)
        try:
            if options.web:
                serve(loop, options, interrupted)
            else:
                check_display()
                print(HELP, flush=True)
                show(loop, interrupted)
        except FatalError as error:
            fail(str(error), DIVERGED)
    if interrupted.is_set():
        fail("interrupted", INTERRUPTED)


def _is_model(word: str) -> bool:
    return word.lower().endswith(MODELS)


def show_warnings(simulation: LiveSimulation) -> None:
    """Show warnings as notices of the view also."""
    printed = warnings.showwarning

    def show(message: Warning | str, *others: Any, **more: Any) -> None:
        printed(message, *others, **more)
        simulation.notice = str(message)

    warnings.showwarning = show


def make(scene: Any, options: Any) -> LiveSimulation:
    if isinstance(options, ModelOptions):
        return LiveSimulation(load(options.path), seed=options.seed)
    numerics = {"method": options.method, "timestep": options.timestep, "seed": options.seed}
    return live_scene(scene, **numerics)


def serve(loop: Loop, options: Display, interrupted: threading.Event) -> None:
    """Show the simulation to browsers until Ctrl-C."""
    try:
        view = WebView(loop, host=options.host, port=options.port)
    except ValueError as error:
        fail(str(error), MISTAKE)
    port = view.url.rpartition(":")[2]
    print(f"open {view.url} in a browser; Ctrl-C ends")
    if options.host == HOST:
        print(f"from another computer: ssh -L {port}:{HOST}:{port} USER@{socket.gethostname()}")
    sys.stdout.flush()
    try:
        view.run(interrupted)
    finally:
        view.stop()


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
        needed = "a display with OpenGL is needed; --web shows the scene in a browser"
        fail(f"no window: {reason} ({needed})", NO_OPENGL)
    glfw.destroy_window(window)


def show(loop: Loop, interrupted: threading.Event) -> None:
    """Open the window and step the simulation until it is closed."""
    from mujoco.viewer import launch_passive

    pressed: SimpleQueue[int] = SimpleQueue()
    others = set(threading.enumerate())
    simulation = loop.simulation
    model, data = simulation.model, simulation.data
    try:
        with launch_passive(model, data, key_callback=pressed.put, show_left_ui=False) as viewer:
            simulation.reset()  # opening the window has computed without our forces
            aim(viewer, model)
            while viewer.is_running() and not interrupted.is_set():
                begin = time.perf_counter()
                while not pressed.empty():
                    loop.press(pressed.get())
                loop.step(begin, viewer.perturb)
                assert viewer.user_scn is not None, "the viewer is running"
                loop.draw(viewer.user_scn)
                viewer.set_texts((None, None, *loop.texts()))
                viewer.sync()
                simulation.apply_input()
                time.sleep(max(0.0, begin + FRAME - time.perf_counter()))
    finally:
        for thread in set(threading.enumerate()) - others:
            thread.join(CLOSING)  # threads of the viewer, which must not draw when Python ends


def aim(viewer: Any, model: MjModel) -> None:
    """Show the whole model; follow a disk, which leaves the region of shadows."""
    camera, default, followed = viewer.cam, free_camera(model), traveler(model)
    camera.lookat[:], camera.distance = default.lookat, default.distance
    camera.azimuth, camera.elevation = default.azimuth, default.elevation
    if followed is not None:
        camera.type, camera.trackbodyid = mjtCamera.mjCAMERA_TRACKING, followed
        camera.elevation = -12
        viewer.user_scn.flags[mjtRndFlag.mjRND_SHADOW] = 0
