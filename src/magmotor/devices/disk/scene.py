"""The scenes: a sliding disk, and an ordinary Langevin particle, in a periodic potential."""

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from magmotor.common.checks import check_choice, check_number
from magmotor.common.exceptions import ArgumentError
from magmotor.device.device import Scene
from magmotor.device.quantities import check_fields, quantity
from magmotor.numerics.reproducible import applied, product

Coefficients = tuple[tuple[float, float], ...]

MOST_WAVES = 100

NAMED: dict[str, Coefficients] = {
    "symmetric": ((1.0, 0.0),),
    "asymmetric": ((1.0, 0.0), (0.4, 0.0)),
    "flat": (),
    "cosine": ((0.0, 1.0),),
}
"""The paper's sin x, sin x + 0.4 sin 2x, 0, and cos x (the ballistic pendulum)."""


def check_potential(potential: Any) -> str | Coefficients:
    """Return a name unchanged, and coefficients as tuples of floats without trailing zeros.

    Raises
    ------
    ValueError
        The name is unknown, or the coefficients are not at most 100 pairs of finite numbers.
    """
    if isinstance(potential, str):
        check_choice("potential", potential, tuple(NAMED))
        return potential
    if not isinstance(potential, tuple | list):
        sentence = (
            "must be one of " + ", ".join(NAMED) + ", or pairs (a_k, b_k) of Fourier coefficients"
        )
        raise ArgumentError("potential", potential, sentence)
    if len(potential) > MOST_WAVES:
        raise ArgumentError(
            "number of pairs in potential", len(potential), f"must be at most {MOST_WAVES}"
        )
    pairs: list[tuple[float, float]] = []
    for i, pair in enumerate(potential):
        if not isinstance(pair, tuple | list) or len(pair) != 2:
            raise ArgumentError(
                f"potential[{i}]", pair, f"must be a pair (a_{i + 1}, b_{i + 1}) of numbers"
            )
        a, b = (
            check_number(f"potential[{i}].{name}", value)
            for name, value in zip("ab", pair, strict=True)
        )
        pairs.append((a, b))
    while pairs and pairs[-1] == (0.0, 0.0):
        pairs.pop()
    return tuple(pairs)


def derivative(coefficients: Coefficients, x: ArrayLike, order: int = 0) -> NDArray[np.float64]:
    """Return the derivative of U of a given order; U = sum_k a_k sin kx + b_k cos kx."""
    x = np.asarray(x, dtype=float)
    value = np.zeros_like(x)
    for k, (a, b) in enumerate(coefficients, start=1):
        # Each derivative shifts the phase by a quarter of a period.
        phase = k * x + order * (np.pi / 2)
        for amplitude, wave in ((a, math.sin), (b, math.cos)):
            if amplitude:
                value += k**order * amplitude * applied(wave, phase)
    return value


def steepest_curvature(coefficients: Coefficients) -> float:
    """Return max |U''| on a grid with a thousand points per shortest wave."""
    if not coefficients:
        return 0.0
    x = np.linspace(0, 2 * np.pi, 1000 * len(coefficients), endpoint=False)
    return float(np.abs(derivative(coefficients, x, 2)).max())


@dataclass(frozen=True, kw_only=True)
class _Langevin(Scene):
    """Fields of both scenes: friction and noise at one temperature, and a potential on x."""

    has_rotation: ClassVar[bool] = False
    """Whether the states include an angle theta and an angular velocity omega."""
    velocity_names: ClassVar[tuple[str, ...]] = ("v",)

    friction: float = quantity(
        0.1, "1", "friction c: force = -c times the velocity it acts on", at_least=0
    )
    noise: float = quantity(
        5.0, "1", "noise alpha: force = alpha dW/dt, along the friction", at_least=0
    )
    potential: str | tuple[tuple[float, float], ...] = quantity(
        "symmetric",
        "1",
        "symmetric, asymmetric, flat, cosine, or pairs: U = sum a_k sin kx + b_k cos kx",
    )
    x: float = quantity(0.0, "1", "initial displacement")
    v: float = quantity(0.0, "1", "initial velocity")

    def __post_init__(self) -> None:
        """Check every field, and the combinations of fields."""
        check_fields(self)
        object.__setattr__(self, "potential", check_potential(self.potential))
        if self.noise > 0 and self.friction == 0:
            raise ArgumentError(
                "friction",
                self.friction,
                "must be positive with noise, or the temperature would be infinite",
            )

    @property
    def coefficients(self) -> Coefficients:
        """Pairs (a_k, b_k) of U = sum_k a_k sin kx + b_k cos kx."""
        return NAMED[self.potential] if isinstance(self.potential, str) else self.potential

    @property
    def beta(self) -> float:
        """Inverse temperature 2c/alpha^2; infinite without noise."""
        return 2 * self.friction / self.noise**2 if self.noise else math.inf

    @property
    def masses(self) -> tuple[float, ...]:
        """Inertia of each velocity."""
        raise NotImplementedError

    @property
    def slip_directions(self) -> NDArray[np.float64]:
        """Directions of friction and noise, shape (directions, dof); see `Disk`."""
        raise NotImplementedError

    @property
    def friction_matrix(self) -> NDArray[np.float64]:
        """Matrix F of the friction force -F u on the velocities u, shape (dof, dof)."""
        wrenches = self.slip_directions.T
        return self.friction * product(wrenches, wrenches.T)

    @property
    def noise_matrix(self) -> NDArray[np.float64]:
        """Matrix G of the force G dW/dt of the noise, a column a channel, shape (dof, channels)."""
        return self.noise * self.slip_directions.T


@dataclass(frozen=True, kw_only=True)
class Disk(_Langevin):
    """The paper's sliding disk, dimensionless; the defaults are its numerical example.

    The disk slides along x and rotates by theta. Friction -c s and one white noise act on the slip
    velocity s = v + omega of the contact point, and the potential U acts on x: equation
    (slidingdisk). Background drag, which the paper does not have, acts on v and omega themselves.

    Raises
    ------
    ValueError
        A field is out of bounds; the message names the field, its value and the bound.
    """

    has_rotation: ClassVar[bool] = True
    velocity_names: ClassVar[tuple[str, ...]] = ("v", "omega")

    sigma: float = quantity(0.5, "1", "moment of inertia over m r^2", above=0)
    friction_ratio: float = quantity(
        0.0,
        "1",
        "eigenvalue of the friction matrix C on its second direction, over the first",
        at_least=0,
    )
    drag: float = quantity(
        0.0, "1", "background drag on the displacement: force = -drag v", at_least=0
    )
    rotational_drag: float = quantity(
        0.0, "1", "background drag on the rotation: torque = -drag omega", at_least=0
    )
    drag_temperature: float | None = quantity(
        None, "1", "temperature kT of the background drag (default: the disk's own)", at_least=0
    )
    theta: float = quantity(0.0, "1", "initial angle")
    omega: float = quantity(0.0, "1", "initial angular velocity")
    surface: str = quantity(
        "planar",
        "",
        "planar: friction acts on the slip itself; plane: by contact with a floor (MuJoCo only)",
        choices=("planar", "plane"),
    )

    def __post_init__(self) -> None:
        """Check every field, and the combinations of fields."""
        super().__post_init__()
        for name in ("friction_ratio", "drag", "rotational_drag"):
            if self.surface == "plane" and getattr(self, name) > 0:
                raise ArgumentError(
                    name, getattr(self, name), "must be zero when surface = 'plane'"
                )
        if self.drag_temperature and not self.noise:
            sentence = "must be zero or None when noise = 0, since all noise is then off"
            raise ArgumentError("drag_temperature", self.drag_temperature, sentence)

    @property
    def masses(self) -> tuple[float, ...]:
        """Inertia of x and of theta."""
        return 1.0, self.sigma

    @property
    def slip_directions(self) -> NDArray[np.float64]:
        """Directions (force on x, torque on theta) of friction and noise, shape (1 or 2, 2).

        Row j is the direction w_j: friction is -c sum_j w_j (w_j . u), noise is
        alpha sum_j w_j dW_j/dt. Since the paper's C = n n^T + ratio m m^T acts on momenta,
        w = diag(1, sigma) n or m, with n = (1, 1/sigma) and m = (1/sigma, -1), its orthogonal.
        """
        rows = [(1.0, 1.0)]
        if self.friction_ratio > 0:
            root = math.sqrt(self.friction_ratio)
            rows.append((root / self.sigma, -root * self.sigma))
        return np.array(rows)

    @property
    def drags(self) -> tuple[float, float]:
        """Background drag of x and of theta."""
        return self.drag, self.rotational_drag

    @property
    def friction_matrix(self) -> NDArray[np.float64]:
        """Matrix F of the friction force -F u on u = (v, omega), with the drag, shape (2, 2)."""
        matrix = super().friction_matrix
        return matrix + np.diag(self.drags) if any(self.drags) else matrix

    @property
    def noise_matrix(self) -> NDArray[np.float64]:
        """Matrix G of the force G dW/dt of the noise, a column a channel, shape (2, 1 to 4).

        The columns are those of `slip_directions`, then that of the drag of x and that of theta;
        drag without noise has no column.
        """
        kT = 1 / self.beta if self.drag_temperature is None else self.drag_temperature
        columns = np.diag([math.sqrt(2 * kT * drag) for drag in self.drags])
        return np.hstack([super().noise_matrix, columns[:, columns.any(axis=0)]])

    @property
    def has_one_temperature(self) -> bool:
        """Whether the drag has the disk's own temperature, so that the Gibbs law is stationary."""
        given = self.drag_temperature
        return given is None or not any(self.drags) or math.isclose(given, 1 / self.beta)


@dataclass(frozen=True, kw_only=True)
class LangevinParticle(_Langevin):
    """The paper's control: dX = V dt, dV = -c V dt - U'(X) dt + alpha dB, at the same temperature.

    Raises
    ------
    ValueError
        A field is out of bounds; the message names the field, its value and the bound.
    """

    @property
    def masses(self) -> tuple[float, ...]:
        """Inertia of x."""
        return (1.0,)

    @property
    def slip_directions(self) -> NDArray[np.float64]:
        """Direction of friction and noise, shape (1, 1); see `Disk`."""
        return np.array([[1.0]])
