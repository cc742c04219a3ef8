"""The models of other people, and magnets on random bodies of them."""

import hashlib
from importlib.metadata import distributions
from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np

import magmotor  # noqa: F401  # registers the plugin
from trials.numpy_twin import apply_magnetism

MAGNETS = 8
"""Bodies with dipole sites in a model, of which each has one or two."""

STRENGTH = 0.1
"""Size of the magnetic forces, in weights."""

PLUGIN = """
<mujoco>
  <extension><plugin plugin="magmotor.forces"><instance name="magnets"/></plugin></extension>
  <custom><text name="magmotor" data="dipoles"/></custom>
  <worldbody>
    <site pos="0 0 1" user="1"/>
    <body><joint/><geom size="0.1"/><site user="1"/></body>
  </worldbody>
</mujoco>
"""
"""A small model in which the plugin acts, and its code is loaded."""


class Skipped(Exception):
    """There is nothing to check in a file; the message says why."""


def packages(folder: Path) -> dict[str, list[Path]]:
    """XML files of the packages that are installed in a folder, by name and version.

    A folder without packages counts as one.
    """
    found = {
        f"{package.name} {package.version}": sorted(
            folder / file for file in package.files or () if file.suffix == ".xml"
        )
        for package in distributions(path=[str(folder)])
    }
    if not found:
        found[folder.name] = sorted(folder.rglob("*.xml"))
    return dict(sorted(found.items(), key=lambda item: item[0].lower()))


def opened(path: Path) -> tuple[mujoco.MjSpec, mujoco.MjModel]:
    """Model of a file, with its specification; `Skipped` if it is not one that moves."""
    try:
        tag = ElementTree.parse(path).getroot().tag
    except ElementTree.ParseError:
        tag = ""
    if tag != "mujoco":
        raise Skipped("to be included" if tag == "mujocoinclude" else "not MJCF")
    try:
        spec = mujoco.MjSpec.from_file(str(path))
        model = spec.compile()
    except ValueError as error:
        missing = "opening file" in str(error)
        reason = "lacks a file that it names" if missing else "does not compile by itself"
        raise Skipped(reason) from error
    if model.nv == 0:
        raise Skipped("nothing moves")
    return spec, model


def digest(model: mujoco.MjModel) -> str:
    """Checksum of a compiled model."""
    content = np.zeros(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, content)
    return hashlib.sha256(content.tobytes()).hexdigest()


def has_user_numbers(model: mujoco.MjModel) -> bool:
    """Whether bodies, joints or sites have `user` numbers."""
    return any(np.any(user) for user in (model.body_user, model.jnt_user, model.site_user))


def start(model: mujoco.MjModel) -> mujoco.MjData:
    """State of the first keyframe, if there is one."""
    data = mujoco.MjData(model)
    if model.nkey > 0:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    return data


def can_move(model: mujoco.MjModel, bodies: np.ndarray) -> np.ndarray:
    """Whether each body belongs to a rigid body that has joints."""
    return model.body_dofnum[model.body_weldid[bodies]] > 0


def magnetize(
    spec: mujoco.MjSpec, model: mujoco.MjModel, seed: int
) -> tuple[mujoco.MjModel, mujoco.MjModel]:
    """Add dipole sites to random bodies of a specification, and a mark if it needs one.

    Returns
    -------
    without, with_plugin : mujoco.MjModel
    """
    rng = np.random.default_rng(seed)
    if spec.nuser_site >= 0:
        spec.nuser_site = max(spec.nuser_site, 1)
    # The callback wakes what sleeps, the plugin does not.
    spec.option.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_SLEEP)
    bodies = {body.id: body for body in spec.bodies}
    chosen = chosen_bodies(model, rng)
    for one, other in touching(model, chosen):  # an error if they overlap at the start
        for body in (one, other):
            bodies[body].name = bodies[body].name or f"body {body}"
        spec.add_exclude(bodyname1=bodies[one].name, bodyname2=bodies[other].name)
    for body in chosen:
        for _ in range(rng.integers(1, 3)):
            bodies[body].add_site(
                pos=0.1 * model.stat.extent * rng.standard_normal(3),
                quat=rng.standard_normal(4),
                userdata=[rng.choice([-1, 1]) * rng.uniform(0.5, 2)],
            )
    if has_user_numbers(model):
        spec.add_text(name="magmotor", data="dipoles")
    without = spec.compile()
    spec.activate_plugin("magmotor.forces")
    spec.add_plugin(name="magnets", plugin_name="magmotor.forces", active=True)
    with_plugin = spec.compile()
    without.site_user *= scale(without)
    with_plugin.site_user[:] = without.site_user
    return without, with_plugin


def chosen_bodies(model: mujoco.MjModel, rng: np.random.Generator) -> list[int]:
    """Random bodies, of at least two rigid bodies, of which at least one moves."""
    bodies = np.arange(model.nbody)
    moving = bodies[can_move(model, bodies)]
    first = rng.choice(moving)
    others = bodies[model.body_weldid != model.body_weldid[first]]
    second = rng.choice(others)
    rest = np.setdiff1d(bodies, [first, second])
    more = rng.choice(rest, min(MAGNETS - 2, len(rest)), replace=False)
    return [int(body) for body in (first, second, *more)]


def touching(model: mujoco.MjModel, bodies: list[int]) -> set[tuple[int, int]]:
    """Bodies that touch at the start, and that belong to different ones of these rigid bodies."""
    data, magnets = start(model), {*model.body_weldid[bodies].tolist()}
    mujoco.mj_forward(model, data)
    pairs = {tuple(map(int, model.geom_bodyid[contact.geom])) for contact in data.contact
             if (contact.geom >= 0).all()}  # fmt: skip
    return {(one, other) for one, other in pairs if {*model.body_weldid[[one, other]]} <= magnets}


def scale(model: mujoco.MjModel) -> float:
    """Factor of all moments that makes the forces `STRENGTH` weights.

    The norm of generalized forces f is sqrt(f^T M^-1 f), that of the weights at most g sqrt(mass).
    """
    data = start(model)
    mujoco.mj_forward(model, data)
    apply_magnetism(model, data)
    forces = generalized(model, data, data.xfrc_applied)
    accelerations = np.zeros((1, model.nv))
    mujoco.mj_solveM(model, data, accelerations, forces[np.newaxis])
    norm = np.sqrt(accelerations[0] @ forces)
    return np.sqrt(STRENGTH * 9.81 * np.sqrt(model.body_subtreemass[0]) / norm)


def generalized(model: mujoco.MjModel, data: mujoco.MjData, wrenches: np.ndarray) -> np.ndarray:
    """Generalized forces J^T w of wrenches (nbody, 6) at the centers of mass."""
    total = np.zeros(model.nv)
    linear, angular = np.zeros((2, 3, model.nv))
    for body in np.flatnonzero(np.any(wrenches, axis=1)):
        mujoco.mj_jacBodyCom(model, data, linear, angular, body)
        total += wrenches[body, :3] @ linear + wrenches[body, 3:] @ angular
    return total
