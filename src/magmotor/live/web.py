"""A live simulation in a browser: without a display, over SSH, in a notebook."""

import threading
import time

from mujoco import MjModel, MjvPerturb

from magmotor.common.arguments import checked
from magmotor.common.checks import check_integer
from magmotor.common.exceptions import ArgumentError
from magmotor.common.hints import Positive, Seconds
from magmotor.device.device import Scene
from magmotor.live.loop import Loop
from magmotor.live.page import LAST_PORT, Page
from magmotor.live.simulation import LiveSimulation, live_scene

FRAME = 1 / 30
"""Wall time per frame (s)."""

HOST, PORT = "127.0.0.1", 8080
"""Where the page is by default: for browsers on this computer only."""

HEIGHT = 700
"""Height of the page in a notebook, in pixels."""


class WebView:
    """A live simulation on a page that browsers open; a notebook shows the page inside.

    The simulation waits while no browser is connected. Anyone who can reach the address can move
    the sliders.

    Parameters
    ----------
    loop : Loop
    host : str
        Address on which to listen: 127.0.0.1 for this computer only, 0.0.0.0 for every network.
    port : int
        If it is taken, the next free one is used; 0 for any.

    Attributes
    ----------
    url : str
        Address of the page.

    Raises
    ------
    MissingExtra
        The extra `web` is not installed.
    ValueError
        The host is not an address of this computer.
    """

    def __init__(self, loop: Loop, *, host: str = HOST, port: int = PORT):
        self._loop, self._stopped = loop, threading.Event()
        self._page = Page(loop, host, check_integer("port", port, at_least=0, at_most=LAST_PORT))
        self._thread: threading.Thread | None = None
        self.url = self._page.url

    def run(self, until: threading.Event | None = None) -> None:
        """Step and show the simulation until an event is set, or `stop` is called.

        Raises
        ------
        RuntimeError
            It has been stopped, or runs in a thread of its own.
        """
        self._check_new()
        self._show(until)

    def _check_new(self) -> None:
        if self._stopped.is_set() or self._thread is not None:
            why = "it has been stopped" if self._stopped.is_set() else "it runs already"
            raise RuntimeError(f"this view cannot be started: {why}; make another one")

    def _show(self, until: threading.Event | None = None) -> None:
        idle = MjvPerturb()
        try:
            while not self._stopped.is_set() and not (until and until.is_set()):
                begin = time.perf_counter()
                self._page.read()
                if self._page.is_watched:
                    self._loop.step(begin, idle)
                self._loop.simulation.apply_input()
                self._page.show()
                self._stopped.wait(max(0.0, begin + FRAME - time.perf_counter()))
        except Exception as error:
            self._page.notify(f"stopped: {error}")
            raise

    def start(self) -> None:
        """Run in a thread of its own; see `run`."""
        self._check_new()
        self._thread = threading.Thread(target=self._show, name="live view", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Stop the simulation and close the page."""
        self._stopped.set()
        if self._thread is not None:
            self._thread.join()
        self._page.close()

    def _repr_html_(self) -> str:
        return f'<iframe src="{self.url}" width="100%" height="{HEIGHT}"></iframe>'


@checked
def web(
    scene: Scene | MjModel,
    *,
    speed: Positive = 1.0,
    method: str = "mujoco/euler",
    timestep: Seconds = 0.01,
    seed: int = 0,
    host: str = HOST,
    port: int = PORT,
) -> WebView:
    """Show a live simulation in a browser, while the program goes on.

    In a notebook, the returned object is displayed as the page. With the notebook on another
    computer, forward the port, too: ``ssh -L 8080:127.0.0.1:8080 ...``.

    Parameters
    ----------
    scene : Scene or mujoco.MjModel
        A model is changed in place; it keeps its own integrator and timestep.
    speed : float
        Simulated seconds per second.
    method : str
        For a scene: `mujoco/euler`, `mujoco/implicitfast` or `mujoco/rk4`.
    timestep : float
        For a scene, in its unit of time: s, or 1 if it is dimensionless.
    seed : int
        Seed of the Brownian forces.
    host : str
        Address on which to listen: 127.0.0.1 for this computer only, 0.0.0.0 for every network.
    port : int
        If it is taken, the next free one is used; 0 for any.

    Returns
    -------
    WebView
        With its address as `url` and a method `stop`.

    Raises
    ------
    MissingExtra
        The extra `web` is not installed.
    ValueError
        Names the argument, its value and what is allowed.

    Examples
    --------
    >>> import magmotor as mm
    >>> view = mm.live.web(mm.Top(), port=0)  # doctest: +SKIP
    >>> view.url  # doctest: +SKIP
    'http://127.0.0.1:45671'
    >>> view.stop()  # doctest: +SKIP
    """
    if isinstance(scene, MjModel):
        simulation = LiveSimulation(scene, seed=seed)
    elif isinstance(scene, Scene):
        simulation = live_scene(scene, method=method, timestep=timestep, seed=seed)
    else:
        raise ArgumentError("scene", scene, "must be a scene or a mujoco.MjModel")
    view = WebView(Loop(simulation, speed), host=host, port=port)
    view.start()
    return view
