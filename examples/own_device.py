"""A device of one's own: a magnetized rotor on an axle, beside a magnet, in warm oil.

A needle turns about the vertical in the field of a magnet that lies north of it; the oil damps it
and its temperature shakes it. This file is the whole device, written with what `magmotor.device`
offers: a scene, its states, a reference integrator, a model for MuJoCo, what sweeps measure, what
movies show. So `mm.simulate`, `mm.ensemble`, sweeps, checkpoints, `mm.rerun` and movies take it.

The program compares the reference with MuJoCo along one Brownian path, and the temperature of many
rotors with theory.
"""

import math
from collections.abc import Generator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import magmotor as mm

# isort: split
# Above, magmotor chose who draws, as it can until MuJoCo is imported.
import mujoco
import numpy as np
import xarray as xr
from numpy.typing import NDArray
from support import run

from magmotor.device import (
    ENERGY_GREW,
    LARGEST_ERROR,
    LARGEST_FLUCTUATION,
    Column,
    Device,
    Fault,
    Guard,
    Job,
    Measure,
    Scene,
    between,
    check_fields,
    check_step_limit,
    initial_parts,
    quantity,
    register,
)
from magmotor.mjcf.forces.brownian import userdata
from magmotor.theory import SmallMotion

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Rotor(Scene):
    """A needle that turns about the vertical, and a magnet north of it."""

    inertia: float = quantity(2e-6, "kg m^2", "moment of inertia about the axle", above=0)
    moment: float = quantity(0.5, "A m^2", "magnetic moment of the needle", above=0)
    magnet: float = quantity(20.0, "A m^2", "magnetic moment of the magnet", at_least=0)
    distance: float = quantity(0.2, "m", "from the axle to the magnet", above=0)
    damping: float = quantity(1e-5, "N m s", "of the oil: torque = -c omega", above=0)
    kT: float = quantity(2e-5, "J", "temperature of the oil", at_least=0)
    angle: float = quantity(1.0, "rad", "initial angle from north")
    rate: float = quantity(0.0, "rad/s", "initial angular velocity")

    def __post_init__(self) -> None:
        check_fields(self)

    @property
    def torque(self) -> float:
        """Largest torque of the field, in N m."""
        field = mm.dipoles.field([0, 0, 0], [[0, self.distance, 0]], [[0, self.magnet, 0]])
        return self.moment * float(np.linalg.norm(field))

    @property
    def noise(self) -> float:
        """Torque of the oil per root of time, in N m sqrt(s): alpha^2 = 2 c kT."""
        return math.sqrt(2 * self.damping * self.kT)


class RotorStates(NamedTuple):
    """Recorded states, shape (T,) or (T, replicas)."""

    time: Array
    theta: Array
    omega: Array


class Reference:
    """BAOAB in NumPy, all replicas at once."""

    def start(self, job: Job) -> Array:
        return np.stack([job.initial.theta[-1], job.initial.omega[-1]])

    def run(self, job: Job) -> Generator[tuple[RotorStates, Array]]:
        scene, h = job.scene, job.timestep
        theta, omega = (self.start(job) if job.state is None else job.state).copy()
        keep = math.exp(-scene.damping / scene.inertia * h)
        spread = math.sqrt(scene.kT / scene.inertia * (1 - keep**2) / h)
        for step, times in job.chunks(theta.size):
            count = len(times) * job.record_interval
            first = job.first_step + step
            increments = np.array(
                [job.path.increments(count, first=first, replica=r) for r in range(theta.size)]
            )
            rows = np.empty((len(times), 2, theta.size))
            for i in range(count):
                omega = omega - 0.5 * h * scene.torque / scene.inertia * np.sin(theta)
                theta = theta + 0.5 * h * omega
                omega = keep * omega + spread * increments[:, i]
                theta = theta + 0.5 * h * omega
                omega = omega - 0.5 * h * scene.torque / scene.inertia * np.sin(theta)
                if (i + 1) % job.record_interval == 0:
                    rows[i // job.record_interval] = theta, omega
            yield RotorStates(times, rows[:, 0], rows[:, 1]), np.stack([theta, omega])


class InMuJoCo:
    """The joint's coordinates, and the Brownian path of each replica."""

    control = int(mujoco.mjtState.mjSTATE_USERDATA)
    driven = True

    def __init__(self, job: Job):
        self.start = np.stack([job.initial.theta[-1], job.initial.omega[-1]], axis=-1)
        self.userdata = userdata(job.path, job.first_step, len(self.start))

    def controls(self, steps: NDArray[np.int64]) -> Array:
        return self.userdata[:, np.newaxis]

    def sums(self, before: Array, paths: Array, first: int) -> Array:
        return paths[..., :0]

    def states(self, time: Array, qpos: Array, qvel: Array, sums: Array) -> RotorStates:
        return RotorStates(time, qpos[..., 0].T, qvel[..., 0].T)


MODEL = """
<mujoco>
  <size nuser_site="1" nuser_body="6" nuserdata="5"/>
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
    """The needle on its axle, and the magnet; the oil is damping and a Brownian torque."""
    numbers = {name: repr(getattr(scene, name)) for name in (*vars(scene), "noise")}
    needle, surroundings = (NEEDLE, SURROUNDINGS.format(**numbers)) if visual else ("", "")
    text = MODEL.format(**numbers, needle=needle, surroundings=surroundings)
    return mujoco.MjSpec.from_string(text)


class RotorGuard(Guard):
    """Energy may grow by what the temperature allows, and by the method's own error."""

    def __init__(self, scene: Rotor, first: RotorStates):
        self.scene, self.start = scene, energy(scene, first).max()

    def faults(self, states: RotorStates) -> list[Fault]:
        found = energy(self.scene, states)
        in_play = found + 2 * self.scene.torque
        allowed = np.maximum(LARGEST_FLUCTUATION * self.scene.kT, LARGEST_ERROR * in_play)
        grew = (found > self.start + allowed).reshape(len(found), -1).any(axis=1)
        return [Fault(grew, lambda _: ENERGY_GREW)]


def energy(scene: Rotor, states: RotorStates) -> Array:
    """Kinetic and magnetic energy, in J."""
    return 0.5 * scene.inertia * states.omega**2 - scene.torque * np.cos(states.theta)


class RotorMovieContent:
    """The angle over time; the tip of the needle leaves a trail."""

    near, trail = "above", 0.002
    needs: tuple[str, ...] = ("theta", "omega")

    def __init__(self, run: xr.Dataset, scene: Rotor, times: Array):
        self.run, self.value = run, np.degrees(between(run, run.theta.values, times))
        theta = run.theta.values
        self.path = 0.05 * np.stack([-np.sin(theta), np.cos(theta), 0 * theta], axis=-1)

    def plot(self, axes: Any) -> list[Any]:
        axes.set(xlabel="t (s)", ylabel="θ (degrees)")
        return axes.plot(self.run.time, np.degrees(self.run.theta), label="angle from north")

    def lines(self, i: int) -> list[str]:
        return [f"θ {self.value[i]:+.0f}°"]


MEASURES = {
    "turns": Measure(
        lambda run, scene: abs(run.theta - scene.angle).max("time") / (2 * np.pi),
        "1",
        "largest number of turns from the start",
    ),
    "temperature": Measure(
        lambda run, scene: scene.inertia * (run.omega**2).mean("time"),
        "J",
        "mean of I omega^2, kT at equilibrium",
    ),
}


class RotorDevice(Device[Rotor, RotorStates]):
    """Everything that the library needs to know about rotors."""

    movie_content = RotorMovieContent
    measures = MEASURES

    def methods(self, scene: Rotor) -> tuple[str, ...]:
        return ("variational/baoab", "mujoco/euler", "mujoco/implicitfast", "mujoco/baoab")

    def check_run(
        self,
        scene: Rotor,
        method: str,
        timestep: float,
        replicas: int | None,
        allow_unstable: bool = False,
    ) -> None:
        if not allow_unstable:
            check_step_limit(scene, method, timestep)

    def initial_state(
        self, scene: Rotor, initial: Mapping[str, Any] | xr.Dataset | None, replicas: int | None
    ) -> RotorStates:
        names = ["theta", "omega"]
        own = {"theta": scene.angle, "omega": scene.rate} | initial_parts(initial, names)
        rows = [np.broadcast_to(np.asarray(own[k], float), (1, replicas or 1)) for k in names]
        return RotorStates(np.zeros(1), *[row.copy() for row in rows])

    def guard(self, scene: Rotor, first: RotorStates) -> RotorGuard:
        return RotorGuard(scene, first)

    def columns(self, scene: Rotor, states: RotorStates, replicas: int | None) -> dict[str, Column]:
        found = {
            "theta": (states.theta, "rad", "angle from north"),
            "omega": (states.omega, "rad/s", "angular velocity"),
            "energy": (energy(scene, states), "J", "kinetic and magnetic energy"),
        }
        if replicas is None:
            return {
                k: Column(("time",), v[:, 0], unit, label) for k, (v, unit, label) in found.items()
            }
        dims = ("replica", "time")
        return {k: Column(dims, v.T, unit, label) for k, (v, unit, label) in found.items()}

    @property
    def variational(self) -> Reference:
        return Reference()

    def compose(self, scene: Rotor, *, visual: bool) -> mujoco.MjSpec:
        return compose(scene, visual=visual)

    def mujoco(self, job: Job) -> InMuJoCo:
        return InMuJoCo(job)

    def small_motion(self, scene: Rotor) -> SmallMotion:
        damping = np.array([[scene.damping]])
        stiffness = np.array([[scene.torque]])
        return SmallMotion.of(np.array([[scene.inertia]]), stiffness, damping, damping)

    def joints(self, run: xr.Dataset, scene: Rotor, times: Array) -> Array:
        return between(run, run.theta.values, times)[:, np.newaxis]


register(RotorDevice(), Rotor)


def main(out: Path = Path("out/rotor.mp4"), replicas: int = 500) -> None:
    """Compare and film.

    Parameters
    ----------
    out
        The movie to write.
    replicas
        How many rotors are averaged.
    """
    scene = Rotor()
    numerics = {"timestep": 0.002, "duration": 4.0, "seed": 1}
    ours = mm.simulate(scene, method="variational/baoab", **numerics)
    theirs = mm.simulate(scene, method="mujoco/baoab", **numerics)
    print(
        f"BAOAB here and in MuJoCo differ by {float(abs(ours.theta - theirs.theta).max()):.1e} rad"
    )
    many = mm.ensemble(
        scene, method="variational/baoab", timestep=0.01, duration=4.0, replicas=replicas,
        sample_interval=5,
    )  # fmt: skip
    late = many.isel(time=slice(20, None)).sel(quantity="omega")
    warm = scene.inertia * late.mean_square.mean()
    print(f"temperature of {replicas} rotors: {float(warm / scene.kT):.3f} of the oil's")
    out.parent.mkdir(parents=True, exist_ok=True)
    mm.render.movie(ours, scene, out)
    print(f"wrote {out}")


if __name__ == "__main__":
    run(main)
