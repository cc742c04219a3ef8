"""A user-defined device: a magnetized needle on an axle, next to a magnet, in warm oil.

The needle rotates about the vertical in the field of a magnet to its north. The oil damps the
rotation, and its temperature drives it. This file is the complete device, built from the parts in
`magmotor.device`: a scene, its states, an integrator, a MuJoCo model, a guard, observables and
measures, and the content of movies. It works with `mm.simulate`, `mm.ensemble`, sweeps,
checkpoints, `mm.rerun`, movies and the live viewer.

The program compares the integrator with MuJoCo along one Brownian path, compares the temperature of
many needles with theory, and makes a movie.
"""

import math
from collections.abc import Generator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import magmotor as mm

# isort: split
# MuJoCo comes after magmotor, which selects the OpenGL backend that MuJoCo loads.
import mujoco
import numpy as np
import tyro
import xarray as xr
from numpy.typing import NDArray

from magmotor.device import (
    ENERGY_GREW,
    LARGEST_ERROR,
    LARGEST_FLUCTUATION,
    ArgumentError,
    Column,
    Device,
    Fault,
    Guard,
    Job,
    Measure,
    MovieContent,
    Observable,
    Scene,
    SmallMotion,
    between,
    check_fields,
    check_integer,
    check_step_limit,
    initial_parts,
    initial_row,
    quantity,
    register,
    userdata,
)

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Rotor(Scene):
    """A needle that rotates about the vertical, and a magnet to its north."""

    inertia: float = quantity(2e-6, "kg m^2", "moment of inertia about the axle", above=0)
    moment: float = quantity(0.5, "A m^2", "magnetic moment of the needle", above=0)
    magnet: float = quantity(20.0, "A m^2", "magnetic moment of the magnet", at_least=0)
    distance: float = quantity(0.2, "m", "distance from the axle to the magnet", above=0)
    damping: float = quantity(1e-5, "N m s", "damping c of the oil: torque = -c omega", above=0)
    kT: float = quantity(2e-5, "J", "temperature kT of the oil", at_least=0)
    angle: float = quantity(1.0, "rad", "initial angle from north")
    rate: float = quantity(0.0, "rad/s", "initial angular velocity")

    def __post_init__(self) -> None:
        check_fields(self)

    @property
    def torque(self) -> float:
        """Largest magnetic torque in N m."""
        field = mm.dipoles.field([0, 0, 0], [[0, self.distance, 0]], [[0, self.magnet, 0]])
        return self.moment * float(np.linalg.norm(field))

    @property
    def noise(self) -> float:
        """Noise of the torque, alpha = sqrt(2 c kT), in N m sqrt(s)."""
        return math.sqrt(2 * self.damping * self.kT)


class RotorStates(NamedTuple):
    """Recorded states, shape (T, replicas), and their times, shape (T,)."""

    time: Array
    theta: Array
    omega: Array


class Integrator:
    """The splitting method BAOAB in NumPy, for all replicas at once."""

    def start(self, job: Job) -> Array:
        """Return the integrator's state at the start, shape (2, replicas)."""
        return np.stack([job.initial.theta[-1], job.initial.omega[-1]])

    def run(self, job: Job) -> Generator[tuple[RotorStates, Array]]:
        """Yield recorded states in chunks, each with the integrator's state after it."""
        scene, h = job.scene, job.timestep
        theta, omega = (self.start(job) if job.state is None else job.state).copy()
        decay = math.exp(-scene.damping / scene.inertia * h)
        spread = math.sqrt(scene.kT / scene.inertia * (1 - decay**2) / h)
        for step, times in job.chunks(theta.size):
            count = len(times) * job.record_interval
            first = job.first_step + step
            increments = np.array(
                [job.path.increments(count, first=first, replica=r) for r in range(theta.size)]
            )
            records = np.empty((len(times), 2, theta.size))
            for i in range(count):
                omega = omega - 0.5 * h * scene.torque / scene.inertia * np.sin(theta)
                theta = theta + 0.5 * h * omega
                omega = decay * omega + spread * increments[:, i]
                theta = theta + 0.5 * h * omega
                omega = omega - 0.5 * h * scene.torque / scene.inertia * np.sin(theta)
                if (i + 1) % job.record_interval == 0:
                    records[i // job.record_interval] = theta, omega
            yield RotorStates(times, records[:, 0], records[:, 1]), np.stack([theta, omega])


class RotorAdapter:
    """Conversion between states and joint coordinates, and the noise of each replica."""

    control = int(mujoco.mjtState.mjSTATE_USERDATA)
    driven = True

    def __init__(self, job: Job):
        self.start = np.stack([job.initial.theta[-1], job.initial.omega[-1]], axis=-1)
        self.userdata = userdata(job.path, job.first_step, len(self.start))

    def controls(self, steps: NDArray[np.int64]) -> Array:
        """Return the user data that select the Brownian path, the same in each step."""
        return self.userdata[:, np.newaxis]

    def sums(self, before: Array, paths: Array, first: int) -> Array:
        """Return no running sums; a device can count heat and work here."""
        return paths[..., :0]

    def states(self, time: Array, qpos: Array, qvel: Array, sums: Array) -> RotorStates:
        """Convert joint coordinates, shape (replicas, T, 1), to states."""
        return RotorStates(time, qpos[..., 0].T, qvel[..., 0].T)


MODEL = """
<mujoco>
  <size nuser_site="1" nuser_body="6" nuserdata="5"/>
  <custom><text name="magmotor" data="dipoles noise"/></custom>
  <option gravity="0 0 0"/>
  <visual><global offwidth="1280" offheight="720"/></visual>
  <worldbody>
    <body name="needle" user="0 0 0 0 0 {noise}">
      <inertial pos="0 0 0" mass="0.01" diaginertia="{inertia} {inertia} {inertia}"/>
      <joint name="axle" axis="0 0 1" damping="{damping}"/>
      <site name="needle" zaxis="0 1 0" user="{moment}"/>{needle}
    </body>
    <site name="magnet" pos="0 {distance} 0" zaxis="0 1 0" user="{magnet}"/>{surroundings}
  </worldbody>
  <keyframe><key name="start" qpos="{angle}" qvel="{rate}"/></keyframe>
</mujoco>
"""
"""The text says what acts: a site's `user` value is its moment, a body's values are its noise."""

NEEDLE = """
      <geom type="capsule" fromto="0 -0.05 0 0 0 0" size="0.006" rgba="0.85 0.87 0.9 1"
        contype="0" conaffinity="0"/>
      <geom type="capsule" fromto="0 0 0 0 0.05 0" size="0.006" rgba="0.8 0.2 0.1 1"
        contype="0" conaffinity="0"/>"""

SURROUNDINGS = """
    <light pos="0.2 -0.2 1" dir="-0.2 0.2 -1" diffuse="0.45 0.45 0.45"/>
    <geom type="plane" size="1 1 0.1" pos="0 0 -0.02" rgba="0.93 0.94 0.96 1"/>
    <geom type="box" pos="0 {distance} 0" size="0.012 0.03 0.012" rgba="0.3 0.3 0.35 1"/>
    <camera name="front" pos="0 -0.35 0.3" xyaxes="1 0 0 0 0.65 0.76"/>
    <camera name="above" pos="0 0.05 0.5"/>"""


def compose(scene: Rotor, *, visual: bool) -> mujoco.MjSpec:
    """Compose the model: needle, axle and magnet, and the oil as damping and Brownian torque."""
    numbers = {name: repr(getattr(scene, name)) for name in (*vars(scene), "noise")}
    needle, surroundings = (NEEDLE, SURROUNDINGS.format(**numbers)) if visual else ("", "")
    text = MODEL.format(**numbers, needle=needle, surroundings=surroundings)
    return mujoco.MjSpec.from_string(text)


class RotorGuard(Guard):
    """Finds energies that exceed the initial energy by more than fluctuations and method error."""

    def __init__(self, scene: Rotor, first: RotorStates):
        self.scene, self.initial_energy = scene, energy(scene, first).max()

    def faults(self, states: RotorStates) -> list[Fault]:
        energies = energy(self.scene, states)
        fluctuation = LARGEST_FLUCTUATION * self.scene.kT
        error = LARGEST_ERROR * (energies + 2 * self.scene.torque)
        grew = (energies > self.initial_energy + np.maximum(fluctuation, error)).any(axis=1)
        return [Fault(grew, lambda _: ENERGY_GREW)]


def energy(scene: Rotor, states: RotorStates) -> Array:
    """Compute the kinetic and magnetic energy in J."""
    return 0.5 * scene.inertia * states.omega**2 - scene.torque * np.cos(states.theta)


class RotorMovieContent(MovieContent):
    """Movies show the angle over time, and the tip of the needle leaves a trail."""

    title, caption = "A compass needle", "It swings about north and is shaken by noise"
    near, trail = "above", 0.002
    needs: tuple[str, ...] = ("theta", "omega")

    def __init__(self, run: xr.Dataset, scene: Rotor, times: Array):
        theta = run.theta.values
        self.run, self.value = run, np.degrees(between(run, theta, times))
        self.path = 0.05 * np.stack([-np.sin(theta), np.cos(theta), 0 * theta], axis=-1)

    def plot(self, axes: Any) -> list[Any]:
        """Draw the angle over time."""
        axes.set(xlabel="t (s)", ylabel="θ (degrees)")
        return axes.plot(self.run.time, np.degrees(self.run.theta), label="angle from north")

    def lines(self, i: int) -> list[str]:
        """Return the text of frame i."""
        return [f"θ {self.value[i]:+.0f}°"]


ROTATION = Observable(
    lambda run, scene: abs(run.theta - scene.angle), "rad", "rotation from the initial angle"
)

MEASURES = {
    "turns": ROTATION.measure(
        "largest {} in turns", lambda angle: angle.max("time") / (2 * np.pi), unit="1"
    ),
    "temperature": Measure(
        lambda run, scene: scene.inertia * (run.omega**2).mean("time"),
        "J",
        "mean of I omega^2, kT at equilibrium",
    ),
}
"""Numbers that sweeps can record: a reduction of an observable, and a number with its own unit."""


class RotorDevice(Device[Rotor, RotorStates]):
    """Everything that the library needs to know about rotors."""

    movie_content = RotorMovieContent
    measures = MEASURES

    def methods(self, scene: Rotor) -> tuple[str, ...]:
        """Return the names of the methods that can simulate the scene."""
        return ("variational/baoab", "mujoco/euler", "mujoco/implicitfast", "mujoco/baoab")

    def check_run(
        self,
        scene: Rotor,
        method: str,
        timestep: float,
        replicas: int | None,
        allow_unstable: bool = False,
    ) -> None:
        """Check the replicas, and the timestep against the method's limit of stability."""
        if replicas is not None:
            check_integer("replicas", replicas, at_least=1)
            if scene.kT == 0:
                sentence = "must be None: without noise (kT = 0) all replicas are the same"
                raise ArgumentError("replicas", replicas, sentence)
        if not allow_unstable:
            check_step_limit(scene, method, timestep)

    def initial_state(
        self, scene: Rotor, initial: Mapping[str, Any] | xr.Dataset | None, replicas: int | None
    ) -> RotorStates:
        """Return the initial state: the scene's own, or parts of it from `initial`."""
        names = ["theta", "omega"]
        parts = {"theta": scene.angle, "omega": scene.rate} | initial_parts(initial, names)
        theta, omega = (initial_row(name, parts[name], replicas or 1) for name in names)
        return RotorStates(np.zeros(1), theta, omega)

    def guard(self, scene: Rotor, first: RotorStates) -> RotorGuard:
        """Return the guard that ends a run whose states are not accurate."""
        return RotorGuard(scene, first)

    def columns(self, scene: Rotor, states: RotorStates, replicas: int | None) -> dict[str, Column]:
        """Return the variables of the dataset."""

        def column(values: Array, unit: str, label: str) -> Column:
            if replicas is None:
                return Column(("time",), values[:, 0], unit, label)
            return Column(("replica", "time"), values.T, unit, label)

        return {
            "theta": column(states.theta, "rad", "angle from north"),
            "omega": column(states.omega, "rad/s", "angular velocity"),
            "energy": column(energy(scene, states), "J", "kinetic and magnetic energy"),
        }

    @property
    def variational(self) -> Integrator:
        """The integrator of the methods `variational/...`."""
        return Integrator()

    def compose(self, scene: Rotor, *, visual: bool) -> mujoco.MjSpec:
        """Compose the MuJoCo model."""
        return compose(scene, visual=visual)

    def mujoco(self, job: Job) -> RotorAdapter:
        """Return the adapter for runs in MuJoCo."""
        return RotorAdapter(job)

    def small_motion(self, scene: Rotor) -> SmallMotion:
        """Linearize about rest, for the limits of the timestep."""
        inertia, stiffness = np.array([[scene.inertia]]), np.array([[scene.torque]])
        damping = np.array([[scene.damping]])
        return SmallMotion.of(inertia, stiffness, damping, damping)

    def joints(self, run: xr.Dataset, scene: Rotor, times: Array) -> Array:
        """Interpolate MuJoCo's joint coordinates at some times, for movies."""
        return between(run, run.theta.values, times)[:, np.newaxis]


register(RotorDevice(), Rotor)


def main(out: Path = Path("out/rotor.mp4"), replicas: int = 500) -> None:
    """Compare the integrator with MuJoCo and with theory, and make a movie.

    Parameters
    ----------
    out
        The movie to write.
    replicas
        Number of rotors in the ensemble.
    """
    scene = Rotor()
    numerics = {"timestep": 0.002, "duration": 4.0, "seed": 1}
    run_here = mm.simulate(scene, method="variational/baoab", **numerics)
    run_in_mujoco = mm.simulate(scene, method="mujoco/baoab", **numerics)
    difference = float(abs(run_here.theta - run_in_mujoco.theta).max())
    print(f"BAOAB here and in MuJoCo differ by {difference:.1e} rad")

    ensemble = mm.ensemble(
        scene, method="variational/baoab", timestep=0.01, duration=4.0, replicas=replicas,
        sample_interval=5,
    )  # fmt: skip
    late = ensemble.isel(time=slice(20, None)).sel(quantity="omega")
    temperature = float(scene.inertia * late.mean_square.mean())
    print(f"{replicas} rotors have {temperature / scene.kT:.3f} times the temperature of the oil")

    out.parent.mkdir(parents=True, exist_ok=True)
    mm.render.movie(run_here, scene, out)
    print(f"wrote {out}")


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
