"""The page of a live view: the picture by mjviser, the controls and curves by viser."""

import errno
import html
import io
import logging
import math
import os
import socket
import threading
from collections.abc import Callable
from contextlib import redirect_stdout
from copy import copy
from functools import partial
from queue import SimpleQueue
from typing import Any, NamedTuple

import mujoco
import numpy as np

from magmotor.common import style
from magmotor.common.arrays import Array
from magmotor.common.exceptions import ArgumentError
from magmotor.common.optional import extra
from magmotor.live.gate import Gate, is_number
from magmotor.live.loop import ARROWS, Loop
from magmotor.live.painted import painted_spheres
from magmotor.live.viewpoint import eye, free_camera, traveler
from magmotor.mjcf.arrows import MOMENT
from magmotor.mjcf.declared import name_of

CURVED = 6
"""Frames between two updates of the curves and numbers."""

CURVE_HEIGHT, PADDING = 80, (8, 12, 0, 0)
"""Height of a curve's panel, and its margins (top, right, bottom, left), in pixels."""

AXES = tuple({"size": size, "ticks": {"show": False}} for size in (26, 44))
"""The axes of a curve, with the room for their labels in pixels."""

AWAY = 1.25
"""Distance of the camera in those of MuJoCo's viewer, since the controls cover a part of it."""

TABLE = "width:100%;padding:0 0.6em;font-size:0.8em;line-height:1.2"

STEPS = 200
"""Number of positions of a slider."""

ROOM = 10_000
"""Largest number of arrows."""

HUGE = 1e300
"""Size from which numbers are not scaled, and the range of a control is none."""

LAST_PORT = 65535

QUIET = threading.Lock()
"""Held while the standard output of all threads is redirected."""


class Control(NamedTuple):
    """An input on the page, with functions that return and change what it controls."""

    handle: Any
    get: Callable[[], Any]
    put: Callable[[Any], None]
    allows: Callable[[Any], bool]
    tolerance: float = 0.0


class Page:
    """A page with the picture, the controls, the readouts and the curves of a live simulation.

    Parameters
    ----------
    loop : Loop
    host : str
    port : int
        See `WebView`.
    """

    def __init__(self, loop: Loop, host: str, port: int):
        self._loop, self._frames = loop, 0
        gate = Gate(host)
        self._server, self._scene, self._painted = _serve(loop.simulation.model, host, port, gate)
        self.url = f"http://{_shown(host)}:{self._server.get_port()}"
        self._follows = traveler(loop.simulation.model) is not None
        self._scene.camera_tracking_enabled = self._follows
        self._view = mujoco.MjvScene(loop.simulation.model, maxgeom=ROOM)
        self._pressed: SimpleQueue[Callable[[], None]] = SimpleQueue()
        self._arrows: dict[str, Any] = {}
        self._aim()
        gui = self._server.gui
        gui.configure_theme(show_logo=False, show_share_button=False)
        buttons = self._buttons()
        self._controls = [*self._switches(), *self._sliders()]
        gate.inputs |= {handle._impl.uuid: allows for handle, allows in buttons}
        gate.inputs |= {one.handle._impl.uuid: one.allows for one in self._controls}
        self._seen = [control.get() for control in self._controls]
        self._notice = gui.add_text("notice", "", multiline=True, disabled=True, visible=False)
        self._numbers = gui.add_html("")
        self._curves = self._empty_curves()
        self.show()

    @property
    def is_watched(self) -> bool:
        """Whether a browser is connected."""
        return bool(self._server.get_clients())

    def read(self) -> None:
        """Apply the input of all browsers since the last call."""
        while not self._pressed.empty():
            self._pressed.get()()
        for i, control in enumerate(self._controls):
            value = control.handle.value
            if value != self._seen[i]:
                self._seen[i] = value
                control.put(value)

    def show(self) -> None:
        """Show the current state."""
        simulation = self._loop.simulation
        with self._server.atomic():
            self._scene.update_from_mjdata(simulation.data)
            self._turn_painted()
        self._draw_arrows()
        for i, control in enumerate(self._controls):
            value = control.get()
            if _differ(value, self._seen[i], control.tolerance):
                self._seen[i] = control.handle.value = value
        self._pause.label = "Continue" if self._loop.paused else "Pause"
        self.notify(simulation.notice)
        if self._frames % CURVED == 0:
            self._show_numbers()
        self._frames += 1

    def notify(self, notice: str) -> None:
        """Show a notice, or none if it is empty."""
        self._notice.visible, self._notice.value = bool(notice), notice

    def close(self) -> None:
        """Stop serving the page."""
        with QUIET, redirect_stdout(io.StringIO()):
            self._server.stop()

    def _aim(self) -> None:
        """Show the whole model, as MuJoCo's viewer does."""
        model = self._loop.simulation.model
        camera, start = free_camera(model), self._server.initial_camera
        center = np.zeros(3) if self._follows else camera.lookat.copy()
        away = AWAY * (eye(camera) - camera.lookat)
        start.position, start.look_at = center + away, center
        start.fov = math.radians(model.vis.global_.fovy)
        start.near = model.vis.map.znear * model.stat.extent

        @self._server.on_client_connect
        def _(client: Any) -> None:
            if client.camera.aspect < 1:  # a phone, whose lower half is covered by the controls
                farther = away / client.camera.aspect
                half = math.tan(start.fov / 2) * np.linalg.norm(farther)
                side = np.cross(away, [0.0, 0.0, 1.0])
                up = np.cross(side, away)
                target = center - half / 2 * up / max(float(np.linalg.norm(up)), 1e-9)
                client.camera.position = target + farther
                client.camera.look_at = target  # which has moved with the camera

    def _buttons(self) -> list[tuple[Any, Callable[[Any], bool]]]:
        """Add the buttons; return them, with the values that a click may send."""
        gui, press = self._server.gui, self._loop.press
        self._pause = gui.add_button("Pause")
        self._pause.on_click(lambda _: self._pressed.put(lambda: press(ord(" "))))
        reset = gui.add_button("Reset", color="gray")
        reset.on_click(lambda _: self._pressed.put(self._loop.simulation.reset))
        speed = gui.add_button_group("speed", ("slower", "faster"))
        keys = {"slower": "6", "faster": "7"}
        speed.on_click(
            lambda event: self._pressed.put(partial(press, ord(keys[event.target.value])))
        )
        is_flag = lambda value: isinstance(value, bool)  # noqa: E731
        return [(self._pause, is_flag), (reset, is_flag), (speed, keys.keys().__contains__)]

    def _switches(self) -> list[Control]:
        """Add a checkbox for each force that acts, and the choice of arrows."""
        gui, loop, simulation = self._server.gui, self._loop, self._loop.simulation
        found = [
            Control(
                gui.add_checkbox(name, initial_value=simulation.on[name]),
                lambda name=name: simulation.on[name],
                lambda _, name=name: simulation.switch(name),
                lambda value: isinstance(value, bool),
            )
            for name, declared in simulation.declared.items()
            if declared
        ]
        if loop.is_magnetic:
            handle = gui.add_dropdown("arrows", ARROWS, initial_value=loop.arrows)
            put = lambda value: setattr(loop, "arrows", value)  # noqa: E731
            found.append(Control(handle, lambda: loop.arrows, put, ARROWS.__contains__))
        return found

    def _sliders(self) -> list[Control]:
        """Add the sliders of a scene, or one for each actuator of another model."""
        simulation = self._loop.simulation
        model, data = simulation.model, simulation.data
        return [self._slider(model, data, i) for i in simulation.sliders]

    def _slider(self, model: mujoco.MjModel, data: mujoco.MjData, i: int) -> Control:
        least, largest = model.actuator_ctrlrange[i]
        if not (model.actuator_ctrllimited[i] and least > -HUGE and largest < HUGE):
            least, largest = -1.0, 1.0
        exponent = _exponent(max(abs(least), abs(largest)))
        unit, name = 10.0**exponent, name_of(model, "actuator", i)
        step = float(f"{(largest - least) / unit / STEPS:.0e}")
        digits = 1 - math.floor(math.log10(step))
        low, high = (round(float(end) / unit, digits) for end in (least, largest))

        def get() -> float:
            return min(max(round(float(data.ctrl[i]) / unit, digits), low), high)

        def put(value: float) -> None:
            data.ctrl[i] = value * unit

        label = _scaled(name, exponent)
        handle = self._server.gui.add_slider(label, low, high, step, initial_value=get())
        half = step / 2
        allows = lambda value: is_number(value) and low - half < value < high + half  # noqa: E731
        return Control(handle, get, put, allows, tolerance=half)

    def _empty_curves(self) -> dict[str, Any]:
        colors = style.BLUE, style.ORANGE, style.GREEN, style.PURPLE
        curves = {}
        for i, name in enumerate(self._loop.readouts.units):
            lines: Any = ({"label": "time"}, {"label": name, "stroke": colors[i % 4], "width": 2})
            curves[name] = self._server.gui.add_uplot(
                (np.zeros(1), np.zeros(1)),
                lines,
                title=name,
                scales={"x": {"time": False}},
                axes=AXES,
                legend={"show": False},
                height=CURVE_HEIGHT,
                padding=PADDING,
            )
        return curves

    def _show_numbers(self) -> None:
        readouts = self._loop.readouts
        rows = "".join(
            f"<tr><td>{html.escape(name)}</td><td style='text-align:right'>{text}</td></tr>"
            for name, text in self._loop.rows().items()
        ).replace("^2", "²")
        self._numbers.content = f"<table style='{TABLE}'>{rows}</table>"
        time, values = readouts.curves
        for name, handle in self._curves.items():
            exponent = _exponent(float(np.abs(values[name]).max()))
            unit = readouts.units[name]
            handle.title = _scaled(name if unit == "1" else f"{name} ({unit})", exponent)
            finite = np.isfinite(values[name])
            handle.data = (time[finite], values[name][finite] / 10.0**exponent)

    def _turn_painted(self) -> None:
        data, quat = self._loop.simulation.data, np.empty(4)
        offset = np.array(self._scene.fixed_bodies_frame.position)  # of what the camera follows
        for geom, handle in self._painted.items():
            mujoco.mju_mat2Quat(quat, data.geom_xmat[geom])
            handle.batched_positions = (data.geom_xpos[geom] + offset)[None]
            handle.batched_wxyzs = quat[None]

    def _draw_arrows(self) -> None:
        self._loop.draw(self._view)
        geoms = self._view.geoms[: self._view.ngeom]
        colors = np.array([geom.rgba[:3] for geom in geoms]).reshape(-1, 3)
        moments = np.isclose(colors, MOMENT).all(axis=1)
        for name, chosen in (("moments", moments), ("field", ~moments)):
            self._place(name, [geoms[k] for k in np.flatnonzero(chosen)], colors[chosen])

    def _place(self, name: str, geoms: list[mujoco.MjvGeom], colors: Array) -> None:
        """Show MuJoCo's arrows under a name; hide those that were shown if there are none."""
        handle = self._arrows.get(name)
        if handle is not None:
            handle.visible = bool(geoms)
        if not geoms:
            return
        ends = np.array([[g.pos, g.pos + 0.5 * g.size[2] * g.mat[:, 2]] for g in geoms])
        radius = float(max(geom.size[0] for geom in geoms))
        rgb = (255 * colors).round().astype(np.uint8)
        if handle is None:
            # The parent moves with what the camera follows.
            self._arrows[name] = self._server.scene.add_arrows(
                f"/fixed_bodies/{name}", ends, rgb,
                shaft_radius=radius, head_radius=2.5 * radius, head_length=6 * radius,
            )  # fmt: skip
            return
        handle.points, handle.colors = ends.astype(np.float32), rgb


def _serve(
    model: mujoco.MjModel, host: str, port: int, gate: Gate
) -> tuple[Any, Any, dict[int, Any]]:
    """Return a running server, and the picture of a model and its painted spheres on its page."""
    with extra("web"):
        from mjviser import ViserMujocoScene
        from viser import ViserServer
    port = _free_port(host, port)
    logging.getLogger("websockets.server").setLevel(logging.CRITICAL)  # of what others send
    # The server prints its address in a frame.
    with QUIET, redirect_stdout(io.StringIO()), gate.around_servers():
        server = ViserServer(host, port, label="magmotor", verbose=False)
    server.request_share_url = lambda verbose=True: None  # a page must not open a way in
    add = server.scene.add_batched_meshes_trimesh  # as for mjviser's bodies, or they move later
    spheres = {
        geom: add(f"/sphere_{geom}", mesh, np.eye(1, 4), np.zeros((1, 3)), lod="off")
        for geom, mesh in painted_spheres(model).items()
    }
    others = copy(model)
    others.geom_rgba[list(spheres), 3] = 0.0  # which it leaves out
    return server, ViserMujocoScene(server, others, num_envs=1), spheres


def _free_port(host: str, first: int) -> int:
    """Return the first port from a given one on that is free at an address; 0 means any."""
    for port in range(first, LAST_PORT + 1):
        try:
            family, kind, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
            with socket.socket(family, kind) as trial:
                if os.name == "posix":  # as the server, which reuses a port at once
                    trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                trial.bind(address)
        except (OSError, UnicodeError) as error:
            if getattr(error, "errno", None) == errno.EACCES:
                sentence = "must be a port that you may use, such as 8080"
                raise ArgumentError("port", first, sentence) from None
            if getattr(error, "errno", None) != errno.EADDRINUSE:
                sentence = "must be an address of this computer, such as 127.0.0.1 or 0.0.0.0"
                raise ArgumentError("host", host, sentence) from None
        else:
            return port
    raise ArgumentError("port", first, f"must leave a free port up to {LAST_PORT}; all are taken")


def _shown(host: str) -> str:
    """Return the host as others write it in an address."""
    if host in ("0.0.0.0", "::", ""):
        return socket.gethostname()
    return f"[{host}]" if ":" in host else host


def _differ(value: Any, seen: Any, tolerance: float) -> bool:
    return abs(value - seen) > tolerance if tolerance else value != seen


def _exponent(size: float) -> int:
    """Return the power of ten, a multiple of three, in which numbers of a size are shown."""
    if 1e-2 <= size < 1e4 or not 1 / HUGE < size < HUGE:
        return 0
    return 3 * math.floor(math.log10(size) / 3)


def _scaled(label: str, exponent: int) -> str:
    """Return a label such as `J (kg m^2/s)` with a power of ten in its unit."""
    label = label.replace("^2", "²")
    if exponent == 0:
        return label
    power = "10" + str(exponent).translate(style.SUPERSCRIPTS)
    name, bracket, unit = label.partition(" (")
    return f"{name} ({power} {unit}" if bracket else f"{name} ({power})"
