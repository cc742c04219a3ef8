"""Scenes and devices: what is simulated, and the one object that knows how.

A scene is data. Its device is everything that the programs must know of scenes of this kind; who
adds a device writes these two classes, see `CONTRIBUTING.md`.
"""

import dataclasses
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Mapping
from pathlib import Path
from typing import Any, ClassVar, Generic, NamedTuple, Protocol, Self, TypeVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from magmotor.common.checks import reject
from magmotor.device.guard import Guard
from magmotor.device.job import Job
from magmotor.device.movie import Gauge, MovieContent
from magmotor.device.overview import draw_variables
from magmotor.device.sliders import Slider
from magmotor.device.states import Column
from magmotor.numerics.linear_stability import SmallMotion

Array = NDArray[np.float64]

SCENES: dict[str, type["Scene"]] = {}
"""The kinds of scenes that have a device, by name: datasets name theirs."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Scene:
    """What is simulated; a kind of scene is a frozen dataclass with fields made by `quantity`.

    Attributes
    ----------
    device : Device
        The one that was registered for scenes of this kind.
    """

    device: ClassVar["Device[Any, Any]"]

    @classmethod
    def registered(cls) -> list[type["Scene"]]:
        """The kinds of scenes of this class that have a device."""
        return [kind for kind in SCENES.values() if issubclass(kind, cls)]

    def replace(self, **changes: Any) -> Self:
        """A copy with some fields changed, checked anew."""
        return dataclasses.replace(self, **changes)


S = TypeVar("S", bound=Scene)
T = TypeVar("T", bound=tuple[Any, ...])


class Engine(Protocol):
    """What makes runs: an object, or a module."""

    def start(self, job: Job) -> Array:
        """The engine's state at the beginning of a run."""
        ...

    def run(self, job: Job) -> Generator[tuple[Any, Array]]:
        """Yield the recorded states that follow the initial one, in chunks; see `Job`."""
        ...


class Equation(Protocol):
    """An ordinary differential equation, for SciPy's solver."""

    def problem(self, scene: Any, initial: Any) -> tuple[Callable, Array, Array]:
        """Right-hand side f(t, y), initial y, and the natural scale of each variable."""
        ...

    def states(self, scene: Any, time: Array, rows: Array) -> Any:
        """Recorded states from rows of the solution."""
        ...


class MujocoAdapter(Protocol):
    """What a run in MuJoCo must know of a device; it is made from the job.

    Attributes
    ----------
    start : ndarray, shape (replicas, nq + nv + k)
        Joint coordinates of the initial states, and k running sums.
    driven : bool
        Whether anything acts through the compiled callback.
    control : int
        What `controls` holds, as bits of `mjtState`.
    """

    start: Array
    driven: bool
    control: int

    def controls(self, steps: NDArray[np.int64]) -> Array | None:
        """What MuJoCo is given in these steps, shape (replicas, steps or 1, n)."""
        ...

    def sums(self, before: Array, paths: Array, first: int) -> Array:
        """Running sums after each step, shape (replicas, steps, k).

        `before` (replicas, nq + nv + k) is the state before step number `first` of the run,
        `paths` (replicas, steps, nq + nv) the states after it and those that follow.
        """
        ...

    def states(self, time: Array, qpos: Array, qvel: Array, sums: Array) -> Any:
        """States from joint coordinates and sums, shape (replicas, T, nq, nv or k)."""
        ...


class Measure(NamedTuple):
    """A number that a sweep records for each run, or for each replica of a run."""

    function: Callable[[xr.Dataset, Any], Any]
    unit: str
    label: str
    observable: "Observable | None" = None
    """The observable that the measure reduces, if there is one."""


class Observable(NamedTuple):
    """A quantity over time that is computed from a run, with its unit and its label."""

    function: Callable[[xr.Dataset, Any], xr.DataArray]
    unit: str
    label: str

    def __call__(self, run: xr.Dataset, scene: Any) -> xr.DataArray:
        """Return the values over time, with the unit and the label in their attributes."""
        return self.function(run, scene).assign_attrs(units=self.unit, long_name=self.label)

    def measure(
        self, label: str, reduction: Callable[[xr.DataArray], Any], unit: str | None = None
    ) -> Measure:
        """Return the measure that reduces the values over time to one number.

        Parameters
        ----------
        label : str
            The measure's label; `{}` stands for the label of the observable.
        reduction : callable
            Maps the values over time to a number, or to one number for each replica.
        unit : str, optional
            The measure's unit if it differs from that of the observable.
        """
        return Measure(
            lambda run, scene: reduction(self(run, scene)),
            self.unit if unit is None else unit,
            label.format(self.label),
            self,
        )


class Device(ABC, Generic[S, T]):
    """All that the programs must know of one kind of scene.

    What is abstract every device has. What is not has a default: what it serves is then refused, or
    does without.

    Attributes
    ----------
    time_unit : str
        Of the scenes' time; "1" if they are dimensionless.
    is_random : bool
        Whether a scene of this kind can have noise.
    measures : mapping of str to Measure
        What a sweep can record.
    movie_content : type, optional
        What movies tell of a run beside its pictures.
    gauge : Gauge, optional
        What a contact sheet shows of a run.
    """

    time_unit: ClassVar[str] = "s"
    is_random: ClassVar[bool] = True
    measures: ClassVar[Mapping[str, Measure]] = {}
    movie_content: ClassVar[type[MovieContent] | None] = None
    gauge: ClassVar[Gauge | None] = None

    @abstractmethod
    def methods(self, scene: S) -> tuple[str, ...]:
        """Names `engine/scheme` of the methods that the scene takes."""

    @abstractmethod
    def check_run(
        self,
        scene: S,
        method: str,
        timestep: float,
        replicas: int | None,
        allow_unstable: bool = False,
    ) -> None:
        """Check what depends on the scene; of the timestep nothing if it may be unstable.

        Raises
        ------
        ValueError
            Replicas that would be the same, or a timestep at which the method is unstable.
        """

    @abstractmethod
    def initial_state(
        self, scene: S, initial: Mapping[str, Any] | xr.Dataset | None, replicas: int | None
    ) -> T:
        """The state that a run starts from, as one row; see `simulate` for `initial`.

        Raises
        ------
        ValueError
            Names the part, its value and the bound.
        """

    def followed(self, first: T, method: str) -> T:
        """The initial state without what a method does not follow."""
        return first

    @abstractmethod
    def guard(self, scene: S, first: T) -> Guard:
        """What looks for the first recorded state that no accurate solution can have."""

    @abstractmethod
    def columns(self, scene: S, states: T, replicas: int | None) -> dict[str, Column]:
        """The variables of a run's dataset."""

    @property
    def variational(self) -> Engine:
        """The reference integrators, of the methods `variational/...`."""
        raise NotImplementedError

    @property
    def ode(self) -> Equation:
        """The equation that `scipy/dop853` solves."""
        raise NotImplementedError

    def compose(self, scene: S, *, visual: bool) -> Any:
        """The scene as a PyMJCF tree or an MjSpec, with lights, cameras, decoration if `visual`.

        Its keyframe 0 is the scene's initial state.

        Raises
        ------
        ValueError
            There is no such scene in MuJoCo.
        """
        kind = type(scene).__name__
        raise reject(
            "scene", scene, f"must be of a kind that has a MuJoCo model, which {kind} has not"
        )

    def ensemble(self, scene: S) -> Callable[..., xr.Dataset] | None:
        """What makes ensembles, with the arguments of `mm.ensemble`; None for moments alone."""
        return None

    def mujoco(self, job: Job) -> MujocoAdapter:
        """What is particular to a run in MuJoCo."""
        raise NotImplementedError

    def poses(self, scene: S) -> list[S]:
        """Scenes at rest, one of which is the stiffest that a run of this scene meets."""
        return [scene]

    @abstractmethod
    def small_motion(self, scene: S) -> SmallMotion:
        """The scene, linearized about the resting state in which it is stiffest."""

    def contact_limit(self, scene: S, method: str) -> float:
        """Timestep at which a contact of the scene is unstable; infinite without one."""
        return math.inf

    @property
    def charted(self) -> Scene | None:
        """The scene of this kind, or of one like it, that the charts of methods show."""
        return None

    def rates(self, scene: S) -> tuple[float, ...]:
        """Rates, over the unit of time, that steps must be short against; 0 of what is not."""
        motion = self.small_motion(scene)
        return motion.frequency, float(motion.decay.max())

    def quantities(self, scene: S) -> tuple[str, ...]:
        """Of what an error is to be, by default: the first of these that is charted."""
        return ("position",)

    def energy_balance(self, run: xr.Dataset, scene: S) -> xr.Dataset:
        """Energy of a run against heat and work; see `magmotor.observables.energy_balance`."""
        kind = type(scene).__name__
        raise reject(
            "scene", scene, f"must be of a kind that has an energy balance, which {kind} has not"
        )

    def overview(self, run: xr.Dataset, scene: S, path: str | Path) -> None:
        """Write one picture of a run; see `magmotor.plots.overview`."""
        draw_variables(run, path)

    def joints(self, run: xr.Dataset, scene: S, times: Array) -> Array:
        """MuJoCo's joint coordinates at some times (s), shape (T, nq)."""
        raise NotImplementedError

    def has_script(self, scene: S) -> bool:
        """Whether bodies of the scene move on a script."""
        return False

    def place(self, scene: S, data: Any, time: float) -> None:
        """Put the bodies of `mjData` that nothing else moves where they are at a time (s)."""

    def why_lost(self, scene: S, model: Any, data: Any) -> str:
        """Why a state that one watches is none that the scene describes; empty if it is one."""
        return ""

    def sliders(self, scene: S) -> dict[str, Slider]:
        """The sliders of a scene that is watched, by name."""
        return {}

    def scene_at(self, scene: S, values: Mapping[str, float]) -> S:
        """The scene with its sliders at these values, one for each.

        Raises
        ------
        ValueError
            Names the field, its value and the bound.
        """
        return scene


def register(device: Device[Any, Any], kind: type[Scene]) -> None:
    """Make a device that of a kind of scenes, which datasets and sweeps name from then on.

    Raises
    ------
    ValueError
        There is another kind of scenes of that name.
    """
    known = SCENES.setdefault(kind.__name__, kind)
    if known.__module__ != kind.__module__:
        sentence = f"must be another: there is one in {known.__module__}"
        raise reject("name of a kind of scenes", kind.__name__, sentence)
    SCENES[kind.__name__] = kind
    kind.device = device
