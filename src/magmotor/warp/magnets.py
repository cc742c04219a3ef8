"""What acts on a model of MuJoCo Warp, and the hooks by which it acts."""

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
import warp as wp

from magmotor.dipoles import PERMEABILITY_OVER_4PI
from magmotor.mjcf import declared
from magmotor.mjcf.declarations import table
from magmotor.mjcf.declarations.marks import COILS, FIELDS, IRON, NOISE, POTENTIALS
from magmotor.mjcf.declarations.model_numbers import scale_of
from magmotor.noise import BrownianPath
from magmotor.warp.bodies import Bodies
from magmotor.warp.dipoles import Dipoles
from magmotor.warp.drives import Drives
from magmotor.warp.fields import Field
from magmotor.warp.magnetometers import Magnetometers
from magmotor.warp.mirrors import Mirror
from magmotor.warp.noise import Noise
from magmotor.warp.potentials import Potentials

UNPREPARED = "magmotor must allocate: step d once, or call m.magmotor.prepare(d), before a capture"


@dataclass
class Room:
    """Arrays for the worlds of a `mujoco_warp.Data`, which are made before its first step.

    `place` and `moment` (nworld, dipoles) are those of the dipoles, `drive` (nworld, drives) those
    of coils and fields, `wrench` (nworld, places) those on bodies, and `time` and `step` (nworld,)
    are of the last step with noise. `owner` are the magnets for which the room was made.
    """

    owner: Any
    place: Any
    moment: Any
    drive: Any
    wrench: Any
    time: Any
    step: Any


class Magnets:
    """The magnets, noise and potentials of a model: `m.magmotor`, if `put_model` has made `m`.

    Some arrays may be set, and may have a row for each world: `dipoles.moments`,
    `fields["NAME"].numbers`, `noise.rows`, `noise.paths` and `potentials.waves`.

    Parameters
    ----------
    model : mujoco.MjModel
    kinds : int
        The bits of what acts.
    path : BrownianPath

    Attributes
    ----------
    dipoles : Dipoles
    fields : dict of str to Field
        Applied fields by the names of their numerics.
    noise : Noise or None
    potentials : Potentials or None
    """

    def __init__(self, model: mujoco.MjModel, kinds: int, path: BrownianPath):
        permeability = PERMEABILITY_OVER_4PI * _scale(model) ** 2
        self.dipoles = Dipoles(model, kinds, permeability)
        coils = [*declared.rows(model, table.COILS)] if kinds & COILS else []
        fields = [*declared.rows(model, table.FIELDS)] if kinds & FIELDS else []
        driven = [row for row in fields if row.actuator >= 0]
        self._drives = Drives(model, coils + driven)
        self.fields: dict[str, Field] = {}
        for row in fields:
            number = len(coils) + driven.index(row) if row.actuator >= 0 else -1
            field = Field(model, row, number)
            self.fields[field.name] = field
        planes = declared.rows(model, table.PLANES) if kinds & IRON else []
        mirrors = [mirror for row in planes if (mirror := Mirror(model, row)).strength != 0.0]
        self._mirror = mirrors[-1] if mirrors else None
        noisy = kinds & NOISE and model.nuser_body and model.body_user.any()
        self.noise = Noise(model, path) if noisy else None
        waves = kinds & POTENTIALS and model.nuser_jnt and model.jnt_user.any()
        self.potentials = Potentials(model) if waves else None
        sensors = declared.rows(model, table.MAGNETOMETERS)
        self._magnetometers = Magnetometers(model, sensors) if len(sensors) else None
        self._bodies = self._place_wrenches(model)

    def _place_wrenches(self, model: mujoco.MjModel) -> Bodies:
        """Give a place to each wrench."""
        dipoles, reacting = self.dipoles, [f for f in self.fields.values() if f.reacts]
        owners = [f.owner for f in reacting]
        driven = self.noise.bodies if self.noise else []
        bodies = Bodies(model, np.concatenate([dipoles.owner, owners, driven]).astype(np.int64))
        ends = np.cumsum([len(dipoles.owner), len(owners)])
        of_dipoles, of_fields, of_noise = np.split(bodies.place, ends)
        dipoles.slot = wp.array(of_dipoles, dtype=int)
        for field, slot in zip(reacting, of_fields.tolist(), strict=True):
            field.slot = slot
        if self.noise:
            self.noise.slot = wp.array(of_noise, dtype=int)
        return bodies

    @property
    def acts(self) -> bool:
        """Whether anything acts, or is measured."""
        return bool(self._bodies.place.size or self.potentials or self._magnetometers)

    @property
    def measures(self) -> bool:
        """Whether there are magnetometers."""
        return self._magnetometers is not None

    def add_forces(self, m: Any, d: Any) -> None:
        """Add all forces to `d.qfrc_passive`: the hook `m.callback.passive`."""
        self.prepare(d)
        if self._bodies.place.size:
            body = self._bodies.body
            self._gather(m, d)
            self.dipoles.set_wrenches(d, body)
            for field in self.fields.values():
                field.add_wrenches(d, self.dipoles, body)
            if self._mirror:
                self._mirror.add_wrenches(d, self.dipoles, body)
            if self.noise:
                self.noise.set_wrenches(m, d)
            self._bodies.apply(m, d, d.magmotor.wrench)
        if self.potentials:
            self.potentials.add_forces(m, d)

    def measure(self, m: Any, d: Any, stage: int) -> None:
        """Write the data of magnetometers: the hook `m.callback.sensor`.

        As in C, they are written after the control callback, with its controls.
        """
        if self._magnetometers and stage == mujoco.mjtStage.mjSTAGE_ACC:
            self.prepare(d)
            self._gather(m, d)
            self._magnetometers.measure(d, self.dipoles, self._mirror, self.fields)

    def _gather(self, m: Any, d: Any) -> None:
        """Write what dipoles and drives are now."""
        if self._drives.count:
            self._drives.read(m, d, d.magmotor.drive)
        if len(self.dipoles.sites):
            self.dipoles.gather(d)

    def prepare(self, d: Any) -> None:
        """Make the arrays that belong to `d`, which its first step does, too.

        Raises
        ------
        RuntimeError
            A graph is being captured, and there are none yet.
        """
        if getattr(getattr(d, "magmotor", None), "owner", None) is self:
            return
        if wp.get_device().is_capturing:
            raise RuntimeError(UNPREPARED)
        size = len(self.dipoles.sites)
        place, moment = (wp.zeros((d.nworld, size), dtype=wp.vec3) for _ in range(2))
        drive = wp.zeros((d.nworld, self._drives.count), dtype=float)
        wrench = wp.zeros((d.nworld, self._bodies.place.size), dtype=wp.spatial_vector)
        time = wp.full(d.nworld, np.nan, dtype=float)
        d.magmotor = Room(
            self, place, moment, drive, wrench, time, wp.zeros(d.nworld, dtype=wp.int64)
        )


def _scale(model: mujoco.MjModel) -> float:
    """Return the factor of moments that makes mu0 that of SI."""
    constant = declared.header(model).constant
    if constant < 0:
        return 1.0
    return scale_of(float(model.numeric_data[model.numeric_adr[constant]]))
