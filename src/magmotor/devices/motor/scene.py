"""The fluctuation-driven motor: a ball on a plane under a fixed and a rotating ring."""

from dataclasses import dataclass
from typing import Any

from magmotor.common.checks import check_choice
from magmotor.devices.motor.bill_of_materials import BillOfMaterials, bill_of_materials
from magmotor.devices.motor.groups import (
    MotorGroups,
    MotorUnits,
    motor_groups,
    motor_units,
    resized,
)
from magmotor.devices.motor.parameters import MotorParameters

PAPER = {
    "nonuniform-a": ("nonuniform", 2e-4, 1),
    "nonuniform-b": ("nonuniform", 2e-4, 2),
    "nonuniform-c": ("nonuniform", 2.5e-4, 3),
    "uniform-a": ("uniform", 1e-3, 1),
    "uniform-b": ("uniform", 1e-3, 2),
    "uniform-c": ("uniform", 7.5e-4, 3),
    "uniform-d": ("uniform", 7.5e-4, 4),
}
"""The paper's seven runs: temperature, alpha in N m sqrt(s), and the seed that we use."""


@dataclass(frozen=True, kw_only=True)
class Motor(MotorParameters):
    """The paper's motor; the defaults are its simulation at uniform temperature, alpha = 1e-3.

    Ball, inner ring and outer ring carry dipoles. The inner ring rotates freely about its fixed
    center; the outer ring is fixed. At uniform `temperature`, friction and noise act on the slip of
    the contact point and on the inner ring, and their ratio is that of one temperature. At
    nonuniform `temperature` they are independent; in the paper, noise acts only on the ring and
    friction only on the ball.

    Raises
    ------
    ValueError
        The message names the field, its value and the bound.
    """

    @classmethod
    def paper(cls, run: str = "uniform-a", **changes: Any) -> "Motor":
        """Return one of the paper's seven runs, a key of `PAPER`; `changes` replace fields."""
        check_choice("run", run, tuple(PAPER))
        temperature, alpha, _ = PAPER[run]
        fields: dict[str, Any] = {"temperature": temperature, "alpha_ring": alpha}
        if temperature == "uniform":
            fields["alpha_ball"] = alpha
        return cls(**(fields | changes))

    @classmethod
    def si(cls, **changes: Any) -> "Motor":
        """Return the motor with the paper's moments in SI: 20 times the coupling.

        The ball then never leaves its first well.
        """
        reading: dict[str, Any] = {"coupling": 4e-5}
        return cls(**(reading | changes))

    @classmethod
    def desk(
        cls,
        run: str = "uniform-a",
        *,
        inner_radius: float = 0.2,
        grade: str = "N42",
        magnet_fraction: float = 0.42,
        **changes: Any,
    ) -> "Motor":
        """Return one of the paper's runs at a size that stands on a desk, with stronger magnets.

        All dimensionless groups (see `groups`) are the paper's, except for the weight, which
        matters only for whether the ball stays on its plane. The ball has a spherical magnet in a
        shell of the same density; see `bill_of_materials`.

        Parameters
        ----------
        run : str
            A key of the paper's runs; see `paper`.
        inner_radius : float
            Radius of the inner ring, in m.
        grade : str
            Material of the magnets, as in `magnet`.
        magnet_fraction : float
            Part of the ball's volume that is a magnet. A smaller one leaves more of the inner
            ring's mass to what carries its magnets, and makes the motor slower.
        **changes
            These replace fields.
        """
        scene = resized(cls.paper(run), inner_radius, grade, magnet_fraction)
        return scene.replace(**changes)

    def bill_of_materials(self, grade: str) -> BillOfMaterials:
        """Return the ball and the magnets of a motor whose magnets are of this grade.

        The energy of ball and inner ring is `ball_ring_factor` = F times that of two dipoles of the
        scene's `moment`, and the energy of any other pair is once that of two of them. Magnets have
        these energies if those of the ball and of the inner ring have sqrt(F) times this moment,
        and those of the outer ring 1/sqrt(F) times.

        Parameters
        ----------
        grade : str
            Material of all magnets, as in `magnet`.

        Raises
        ------
        ValueError
            The ball's magnet does not fit into the ball, or the inner ring's magnets are heavier
            than the inner ring.
        """
        return bill_of_materials(self, grade)

    @property
    def groups(self) -> MotorGroups:
        """Dimensionless groups, by which motors of different sizes are compared."""
        return motor_groups(self)

    @property
    def units(self) -> MotorUnits:
        """Units of length (m), mass (kg) and time (s) of the groups."""
        return motor_units(self)
