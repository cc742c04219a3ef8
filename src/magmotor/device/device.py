"""Scenes and devices: the parameters of a simulation, and the object that runs and describes it.

A scene is data. Its device is everything that the library needs to know about one class of scenes.
To add a device, write these two classes; see `CONTRIBUTING.md`.
"""

import dataclasses
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, ClassVar, Generic, Self, TypeVar

import xarray as xr

from magmotor.common.arrays import Array
from magmotor.common.checks import check_choice
from magmotor.common.exceptions import ArgumentError
from magmotor.device.engine import Engine, Equation, MujocoAdapter
from magmotor.device.guard import Guard
from magmotor.device.job import Job
from magmotor.device.movie import Gauge, MovieContent
from magmotor.device.observable import Measure
from magmotor.device.overview import draw_variables
from magmotor.device.quantities import add_parameters
from magmotor.device.readout import Readout
from magmotor.device.sliders import Slider
from magmotor.device.states import Column
from magmotor.numerics.linear_stability import SmallMotion

SCENES: dict[str, type["Scene"]] = {}
"""The registered scene classes by name, which datasets record as their attribute `scene`."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Scene:
    """Base of all scene classes: frozen dataclasses whose fields are declared with `quantity`.

    Attributes
    ----------
    device : Device
        Set by `register`.
    """

    device: ClassVar["Device[Any, Any]"]

    @classmethod
    def registered(cls) -> list[type["Scene"]]:
        """Return the registered scene classes that derive from this one."""
        return [known for known in SCENES.values() if issubclass(known, cls)]

    def replace(self, **changes: Any) -> Self:
        """Return a copy with some fields changed; all fields are checked again."""
        return dataclasses.replace(self, **changes)


S = TypeVar("S", bound=Scene)
T = TypeVar("T", bound=tuple[Any, ...])


class Device(ABC, Generic[S, T]):
    """Everything that the library needs to know about one class of scenes.

    A device has no state of its own: every method takes the scene. Abstract methods are required;
    the others have defaults, which refuse the feature or do without it. S is the scene class, T a
    named tuple of columns for the states, whose first is `time`; the first axis of every column is
    time.

    Attributes
    ----------
    time_unit : str
        Unit of time of the scenes; "1" if they are dimensionless.
    is_random : bool
        Whether scenes can have noise. If not, a sweep runs one seed only.
    measures : mapping of str to Measure
        Numbers that a sweep can record for each run, by name.
    movie_content : type, optional
        Class of the text, curves and cameras of movies; without it, there are no movies.
    gauge : Gauge, optional
        The bar in each picture of a contact sheet; without it, there are no contact sheets.
    ensemble_dimensions : frozenset of str
        Dimensions that only the datasets of its own function `ensemble` have.
    """

    time_unit: ClassVar[str] = "s"
    is_random: ClassVar[bool] = True
    measures: ClassVar[Mapping[str, Measure]] = {}
    movie_content: ClassVar[type[MovieContent] | None] = None
    gauge: ClassVar[Gauge | None] = None
    ensemble_dimensions: ClassVar[frozenset[str]] = frozenset()

    @abstractmethod
    def methods(self, scene: S) -> tuple[str, ...]:
        """Return the names `engine/scheme` of the methods that can integrate the scene."""

    def check_method(self, scene: S, method: str) -> None:
        """Check that a method is one of `methods(scene)`.

        Raises
        ------
        ValueError
            It is not; the message names those that are.
        """
        check_choice("method", method, self.methods(scene))

    @abstractmethod
    def check_run(
        self,
        scene: S,
        method: str,
        timestep: float,
        replicas: int | None,
        allow_unstable: bool = False,
    ) -> None:
        """Check the arguments of a run against the scene, before the run starts.

        `method` is one of `methods(scene)`; `replicas` is None for a single run. Accept any
        timestep if `allow_unstable`; `check_step_limit` checks it against linear theory.

        Raises
        ------
        ValueError
            The replicas would all be the same, or the method is unstable at this timestep.
        """

    @abstractmethod
    def initial_state(
        self, scene: S, initial: Mapping[str, Any] | xr.Dataset | None, replicas: int | None
    ) -> T:
        """Return the initial state of a run, as one row.

        Parts that `initial` (see `simulate`, and `initial_parts`) does not give come from the
        scene.

        Raises
        ------
        ValueError
            A part is unknown or invalid; the message names the part, its value and the bound.
        """

    def followed(self, scene: S, first: T, method: str) -> T:
        """Return the initial state, with None for each column that the method does not compute."""
        return first

    @abstractmethod
    def guard(self, scene: S, first: T) -> Guard:
        """Return the guard of a run that starts from `first`; it sees every recorded state."""

    @abstractmethod
    def columns(self, scene: S, states: T, replicas: int | None) -> dict[str, Column]:
        """Return the variables of a run's dataset by name, computed from its states.

        Dimensions are ("time", ...), or ("replica", "time", ...) unless `replicas` is None.
        """

    @property
    def variational(self) -> Engine:
        """The engine of the methods `variational/...`: the reference integrators."""
        raise self._lacks("method", "variational/...", "variational")

    @property
    def ode(self) -> Equation:
        """The equation that the method `scipy/dop853` solves."""
        raise self._lacks("method", "scipy/dop853", "ode")

    def compose(self, scene: S, *, visual: bool) -> Any:
        """Return the scene as a PyMJCF tree or an MjSpec, whose keyframe 0 is the initial state.

        Add lights, cameras and decoration if `visual`; they must not change the dynamics.

        Raises
        ------
        ValueError
            The scene has no MuJoCo model.
        """
        raise ArgumentError("scene", scene, f"a {type(scene).__name__} has no MuJoCo model")

    def ensemble(self, scene: S) -> Callable[..., xr.Dataset] | None:
        """Return a function of its own for `mm.ensemble`, which replaces the general one.

        It receives the scene, the `EnsembleOptions`, and the function `simulate`, for methods
        without an ensemble of their own. By default None: `mm.ensemble` runs `simulate` with
        replicas, and keeps their moments.
        """
        return None

    def ensemble_times(
        self, scene: S, timestep: float, duration: float, sample_interval: int, burn_in: float
    ) -> Array | None:
        """Return the times of all records of such an ensemble, which `mm.rerun` verifies.

        Only needed with a function `ensemble` of its own. By default None: time 0, and every
        `sample_interval` steps from there to the end.

        Raises
        ------
        ValueError
            The function `ensemble` accepts no such arguments.
        """
        return None

    def mujoco(self, job: Job) -> MujocoAdapter:
        """Return the adapter of one run, for the methods `mujoco/...`."""
        raise self._lacks("method", f"mujoco/{job.scheme}", "mujoco")

    def poses(self, scene: S) -> list[S]:
        """Return scenes at rest that bracket a scripted motion, for the limit on the timestep.

        The stiffest pose of a run must be among them.
        """
        return [scene]

    @abstractmethod
    def small_motion(self, scene: S) -> SmallMotion:
        """Return the equations of motion, linearized about the stiffest state of rest.

        They set the largest stable timestep of every method.
        """

    def contact_limit(self, scene: S, method: str) -> float:
        """Return the timestep at which a contact becomes unstable; infinite without contacts."""
        return math.inf

    @property
    def charted(self) -> Scene | None:
        """The scene whose speed and accuracy are measured for `mm.recommend`; None without charts.

        It may belong to a similar scene class.
        """
        return None

    def check_charted(self, scene: S) -> None:
        """Check that the scene has no physics that `charted` lacks.

        Raises
        ------
        ValueError
            It has: errors measured for `charted` say nothing about the scene.
        """

    def uncharted(self, scene: S) -> str:
        """Return what the scene has beyond `charted`, and whose error no chart tells; or nothing.

        In contrast to `check_charted`, it does not change what is charted.
        """
        return ""

    def rates(self, scene: S) -> tuple[float, ...]:
        """Return the rates (1/unit of time) that a timestep must resolve; 0 for absent ones.

        `mm.recommend` scales charted timesteps by them, one by one; their order is fixed.
        """
        motion = self.small_motion(scene)
        return motion.frequency, float(motion.decay.max())

    def quantities(self, scene: S) -> tuple[str, ...]:
        """Return the default quantities of `mm.recommend`, which uses the first charted one."""
        return ("position",)

    def energy_balance(self, run: xr.Dataset, scene: S) -> xr.Dataset:
        """Return the energy balance of a run; see `magmotor.observables.energy_balance`."""
        raise ArgumentError("scene", scene, f"a {type(scene).__name__} has no energy balance")

    def check_result(self, scene: S, run: xr.Dataset) -> None:
        """Warn of what is wrong with a finished run, although its guard let every state pass.

        Warns
        -----
        UserWarning
            For example, energy, heat and work do not balance.
        """

    def overview(self, run: xr.Dataset, scene: S, path: str | Path, dpi: int) -> None:
        """Write a picture that summarizes a run; see `magmotor.plots.overview`."""
        draw_variables(run, path, dpi)

    def joints(self, run: xr.Dataset, scene: S, times: Array) -> Array:
        """Return MuJoCo's `qpos` at these times (s), shape (T, nq), for movies."""
        raise self._lacks("scene", scene, "joints")

    def has_script(self, scene: S) -> bool:
        """Whether bodies of the scene follow a script, so that `place` must be called."""
        return False

    def place(self, scene: S, data: Any, time: float) -> None:
        """Put the scripted bodies of an `mjData` where they are at a time (s).

        Called for every frame of a movie, and every step of a live simulation.
        """

    def why_lost(self, scene: S, model: Any, data: Any) -> str:
        """Return why the scene no longer describes a live simulation; empty if it still does.

        Called after every step; the live simulation stops and shows the reason.
        """
        return ""

    def sliders(self, scene: S) -> dict[str, Slider]:
        """Return the sliders that the live viewer shows, by name."""
        return {}

    def readouts(self, scene: S) -> dict[str, Readout]:
        """Return the readouts of live views by name, beside temperature or kinetic energy."""
        return {}

    def scene_at(self, scene: S, values: Mapping[str, float]) -> S:
        """Return the scene with its sliders at these values; called when one has moved.

        Raises
        ------
        ValueError
            A value is out of bounds; the message names the field, its value and the bound.
        """
        return scene

    def _lacks(self, name: str, value: Any, missing: str) -> ValueError:
        """Return the error for a feature that the device does not define."""
        classes = [known for known in SCENES.values() if getattr(known, "device", None) is self]
        kind = " or ".join(known.__name__ for known in classes) or "scene"
        sentence = f"a {kind} needs {type(self).__name__}.{missing}, which is missing"
        return ArgumentError(name, value, sentence)


def register(device: Device[Any, Any], scene_class: type[Scene]) -> None:
    """Register a device for a scene class, which datasets and sweeps can name from then on.

    The docstring of the class gets a section on its fields.

    Raises
    ------
    ValueError
        Another module has registered a scene class of that name.
    """
    name = scene_class.__name__
    known = SCENES.setdefault(name, scene_class)
    if known.__module__ != scene_class.__module__:
        sentence = f"{known.__module__} has registered a scene class of this name"
        raise ArgumentError("name of the scene class", name, sentence)
    SCENES[name] = scene_class
    scene_class.device = device
    add_parameters(scene_class)
