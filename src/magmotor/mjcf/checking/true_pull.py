"""Forces of magnets of true shape where they touch, computed by what computes them in runs.

Two magnets are alone in a small model of their own, where MuJoCo moves one of them as a rigid body.
"""

from functools import lru_cache

import mujoco
import numpy as np

from magmotor.common.arrays import Array
from magmotor.mjcf.checking.strengths import Magnet
from magmotor.mjcf.declarations.meshes import MESH
from magmotor.mjcf.declarations.model_numbers import NAME
from magmotor.mjcf.declarations.table import PIECES, PLANES
from magmotor.mjcf.declared import coil_of_geoms, rows
from magmotor.mjcf.forces.iron_pieces import ellipsoid
from magmotor.mjcf.hooks import errors_raised
from magmotor.mjcf.unit_system import declares_units, magnetic_constant, moment_scale
from magmotor.numerics.demagnetization import VACUUM_PERMEABILITY

TYPES = {int(kind): name[len("mjGEOM_") :].lower()
         for name, kind in mujoco.mjtGeom.__members__.items()}  # fmt: skip
"""Names of the types of geoms, as in MJCF."""

MODEL = """
<mujoco>
  <extension><plugin plugin="magmotor.forces"><instance name="magnets">
    <config key="act" value="dipoles magnets coils iron"/>
  </instance></plugin></extension>
  <compiler angle="radian"/>
  <option gravity="0 0 0"><flag contact="disable"/></option>
  <custom>{custom}</custom>
  <asset>{assets}</asset>
  <worldbody>
    <body pos="0 0 {away:g}">
      <freejoint/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>{one}
    </body>
    {other}<site name="fixed"/>
  </worldbody>
  <actuator><general name="on" site="fixed" gainprm="0"/></actuator>
</mujoco>"""


class Duo:
    """Two magnets without anything else; the second one may be a plane of iron."""

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, magnets: tuple[Magnet, Magnet]
    ) -> None:
        text = _Text(model, data)
        one, other = (text.elements(magnet) for magnet in magnets)
        self._frames = [_frame(model, data, magnet) for magnet in magnets]
        away = 10 * model.stat.extent  # MuJoCo's compiler evaluates the forces there
        assets = "".join(text.assets)
        self._text = MODEL.format(
            custom=text.custom(), assets=assets, away=away, one=one, other=other
        )
        _compiled(self._text)
        self.normal = self._frames[1][1][:, 2]
        """Of the plane of iron, if the second one is one."""

    def force(self, turn: Array, shift: Array) -> Array:
        """Return the force in N on the first magnet; NaN where it is undefined.

        The magnets are where they are at present, but the second one is turned about the origin,
        and then shifted: a point x of it is at `turn` x + `shift`.
        """
        (place, frame), (base, axes) = self._frames
        there = (turn @ axes).T
        quaternion = np.empty(4)
        mujoco.mju_mat2Quat(quaternion, (there @ frame).ravel())
        pose = [*(there @ (place - shift - turn @ base)).tolist(), *quaternion.tolist()]
        return there.T @ force_in_pose(
            self._text, tuple(round(number, 12) + 0.0 for number in pose)
        )


def duo_of(
    model: mujoco.MjModel, data: mujoco.MjData, magnets: tuple[Magnet, Magnet]
) -> Duo | None:
    """Return two magnets alone, if their forces are defined.

    They are not where pieces of iron of one body are too near each other for their nodes.
    """
    try:
        return Duo(model, data, magnets)
    except ValueError as error:
        if "engine error" in str(error):  # of the plugin, where MuJoCo's compiler calls it
            return None
        raise


def _frame(model: mujoco.MjModel, data: mujoco.MjData, magnet: Magnet) -> tuple[Array, Array]:
    """Return the frame of a magnet: its origin, and its axes as columns."""
    if magnet.images:
        plane = int(magnet.elements[0]) - model.nsite
        return data.geom_xpos[plane], data.geom_xmat[plane].reshape(3, 3)
    return data.xpos[magnet.body], data.xmat[magnet.body].reshape(3, 3)


@lru_cache(maxsize=64)
def _compiled(text: str) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(text)


@lru_cache(maxsize=10_000)
def force_in_pose(text: str, pose: tuple[float, ...]) -> Array:
    """Return the force in N on the first magnet, in a pose that alike magnets often share."""
    model = _compiled(text)
    data = mujoco.MjData(model)
    data.qpos[:], data.ctrl[:] = pose, 1.0
    try:
        with errors_raised():
            mujoco.mj_forward(model, data)
    except mujoco.FatalError:  # such as of dipoles that coincide
        return np.full(3, np.nan)
    return data.qfrc_passive[:3].copy()


class _Text:
    """The elements of magnets as XML, alike for magnets that are alike."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        self._model, self._data, self._scale = model, data, moment_scale(model)
        found = [*rows(model, PIECES), *rows(model, PLANES)]
        self._material_of = {int(row.geom): int(row.material) for row in found}
        self._coiled = coil_of_geoms(model) >= 0
        self._coils: list[str] = []
        self._iron: dict[int, list[str]] = {}
        self._count = 0
        self.assets: list[str] = []

    def elements(self, magnet: Magnet) -> str:
        """Return the sites and geoms of a magnet in its frame."""
        model, found = self._model, []
        origin, axes = _frame(model, self._data, magnet)
        for n, element in enumerate(magnet.elements.tolist()):
            place = (magnet.positions[n] - origin) @ axes
            if element >= model.nsite:
                strength = magnet.strengths[n] if magnet.extents[n] > 0 else 0.0
                found.append(self._geom(element - model.nsite, origin, axes, strength))
            else:
                moment = magnet.strengths[n] / self._scale
                axis = magnet.axes[n] @ axes
                found.append(
                    f'<site pos="{_numbers(place)}" zaxis="{_numbers(axis)}" user="{moment:.12g}"/>'
                )
        return "".join(found)

    def _geom(self, geom: int, origin: Array, axes: Array, strength: float) -> str:
        """Return a geom that is a magnet, whose moment is its `strength`, or iron."""
        model, own = self._model, self._data.geom_xmat[geom].reshape(3, 3)
        quaternion, name, kind = np.empty(4), f"g{self._count}", int(model.geom_type[geom])
        self._count += 1
        mujoco.mju_mat2Quat(quaternion, (axes.T @ own).ravel())
        place = (self._data.geom_xpos[geom] - origin) @ axes
        text = f'<geom name="{name}" type="{TYPES[kind]}" pos="{_numbers(place)}"'
        text += f' quat="{_numbers(quaternion)}"'
        polarization = model.geom_user[geom, :3]
        if self._coiled[geom]:
            volume = ellipsoid(kind, *model.geom_size[geom])[3] / VACUUM_PERMEABILITY
            own = np.linalg.norm(polarization) * volume / self._scale
            polarization = polarization * (strength / own)
            self._coils.append(name)
        if not strength:
            self._iron.setdefault(self._material_of[geom], []).append(name)
        if kind == MESH:
            mesh, turn = int(model.geom_dataid[geom]), np.empty(9)
            mujoco.mju_quat2Mat(turn, model.mesh_quat[mesh])
            polarization = polarization @ turn.reshape(3, 3)
            text += f' mesh="{name}"'
            self.assets.append(_mesh(model, mesh, name))
        else:
            text += f' size="{_numbers(model.geom_size[geom])}"'
        return text + (f' user="{_numbers(polarization)}"/>' if strength else "/>")

    def custom(self) -> str:
        """Return the materials of iron, the coil, which is on, and the magnetic constant."""
        found = []
        if self._coils:
            inner = "".join(f'<element objtype="geom" objname="{name}"/>' for name in self._coils)
            inner = f'<element objtype="actuator" objname="on"/>{inner}'
            found.append(f'<tuple name="coil">{inner}</tuple>')
        if declares_units(self._model):
            found.append(f'<numeric name="{NAME}" data="{magnetic_constant(self._model):.17g}"/>')
        for k, (material, names) in enumerate(self._iron.items()):
            listed = [("numeric", f"m{k}"), *(("geom", name) for name in names)]
            inner = "".join(f'<element objtype="{a}" objname="{b}"/>' for a, b in listed)
            numbers = _numbers(self._model.numeric(material).data)
            found.append(f'<numeric name="m{k}" data="{numbers}"/>')
            found.append(f'<tuple name="iron{k}">{inner}</tuple>')
        return "".join(found)


def _mesh(model: mujoco.MjModel, mesh: int, name: str) -> str:
    """Return a mesh as the model has it, in the frame that MuJoCo gave it."""
    first, start = model.mesh_vertadr[mesh], model.mesh_faceadr[mesh]
    vertices = model.mesh_vert[first : first + model.mesh_vertnum[mesh]].astype(float)
    faces = model.mesh_face[start : start + model.mesh_facenum[mesh]]
    corners = " ".join(map(str, faces.ravel().tolist()))
    return f'<mesh name="{name}" vertex="{_numbers(vertices.ravel())}" face="{corners}"/>'


def _numbers(values: Array) -> str:
    """Return numbers as text, rounded so that magnets that are alike have the same."""
    return " ".join(f"{value + 0.0:.12g}" for value in np.where(abs(values) < 1e-15, 0, values))
