"""What `mm.advise` says of public models, and of our own, beside their makers' choice."""

from contextlib import nullcontext
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from pathlib import Path

import mujoco
import numpy as np

import magmotor as mm
from benchmarks.harness.records import NOT_INSTALLED, Case, Record
from benchmarks.harness.tables import table
from magmotor.advice.report import fails_from

ROOT = Path(__file__).parents[2]
CORPUS = ROOT / ".cache" / "corpus"
"""Where `python -m trials.corpus` keeps public packages."""

ERROR, DURATION, BUDGET = 0.01, 1.0, 60.0
"""What is asked for; error relative, times in s."""

SPEED = 0.5
"""Standard deviation of the initial velocities in rad/s and m/s, beside those of a keyframe."""

WHOLE = 0.999
"""Part of the duration from which on a horizon counts as the whole of it."""


@dataclass(frozen=True)
class Source:
    """Where a model comes from."""

    package: str
    """An installed package or one of the corpus; empty for this repository."""
    file: str
    magnetic: bool = False
    held: bool = False
    """Whether the servos hold the joints where they start; the keyframe has other controls."""

    @property
    def path(self) -> Path:
        """The MJCF file."""
        if not self.package:
            return ROOT / self.file
        found = find_spec(self.package)
        installed = Path(found.origin or "").parent if found else CORPUS / self.package
        return installed / self.file


SUITE = "dm_control", "suite/{}.xml"
ASSETS = "gymnasium", "envs/mujoco/assets/{}.xml"
MODELS = {
    **{
        name: Source(SUITE[0], SUITE[1].format(name))
        for name in (
            "acrobot", "ball_in_cup", "cartpole", "cheetah", "finger", "fish", "hopper", "humanoid",
            "manipulator", "quadruped", "reacher", "swimmer", "walker",
        )
    },
    "ant": Source(ASSETS[0], ASSETS[1].format("ant")),
    "double pendulum": Source(ASSETS[0], ASSETS[1].format("inverted_double_pendulum")),
    "KUKA iiwa": Source("robosuite", "models/assets/robots/iiwa/robot.xml"),
    "YAM arm, servos": Source("mjlab", "asset_zoo/robots/i2rt_yam/xmls/yam.xml"),
    "two ViperX arms": Source("gym_aloha", "assets/bimanual_viperx_transfer_cube.xml"),
    "the same, held": Source(
        "gym_aloha", "assets/bimanual_viperx_transfer_cube.xml", held=True
    ),
    "Aloha's arms and a pot": Source("mujoco_warp", "test_data/aloha_pot/scene.xml"),
    "Shadow hand": Source("gymnasium_robotics", "envs/assets/hand/reach.xml"),
    "the disk": Source("", "models/disk_magnetic.xml", magnetic=True),
    "the top": Source("", "models/top_magnetic.xml", magnetic=True),
    "the motor": Source("", "models/motor_magnetic.xml", magnetic=True),
    "magnetic pendulum": Source("", "examples/magnetic_pendulum.xml", magnetic=True),
    "magnetic assembly": Source("", "examples/magnetic_assembly.xml", magnetic=True),
}  # fmt: skip
QUICK = ("acrobot", "cartpole", "magnetic pendulum")


def cases(quick: bool) -> list[Case]:
    return [
        Case(f"advice/{name}", partial(measure, name), BUDGET / 2)
        for name in (QUICK if quick else MODELS)
    ]


def measure(name: str) -> Record:
    source = MODELS[name]
    if not source.path.exists():
        return {
            "failed": f"{NOT_INSTALLED}{source.package}, which `python -m trials.corpus` downloads"
        }
    model = mujoco.MjModel.from_xml_path(str(source.path))
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    if source.held:
        data.ctrl[:] = data.qpos[model.jnt_qposadr[model.actuator_trnid[:, 0]]]
    data.qvel += SPEED * np.random.default_rng(0).standard_normal(model.nv)
    with mm.magnetism() if source.magnetic else nullcontext():
        advice = mm.advise(
            model, data, error=ERROR, duration=DURATION, budget=BUDGET, every_element=False
        )
    record: Record = {
        "dof": model.nv, "horizon": advice.horizon, "duration": advice.duration,
        "reason": advice.reason,
    }  # fmt: skip
    if advice.own is not None:
        own = advice.own
        record["own"] = {"integrator": own.method, "timestep": own.timestep,
                         "error": own.error if np.isfinite(own.error) else None}  # fmt: skip
    if advice.method:
        limit = advice.limits.get(advice.method)
        failure = fails_from(p for p in advice.points if p.method == advice.method)
        record["advice"] = {
            "integrator": advice.method, "timestep": advice.timestep,
            "promised": advice.promised, "settings": dict(advice.settings),
            "limit": limit.found if limit and np.isfinite(limit.found) else None,
            "fails_from": failure.timestep if failure else None,
        }  # fmt: skip
        if advice.own is not None:
            record["gain"] = advice.own.seconds / advice.seconds
    return record


def draw(records: dict[str, Record], folder: Path) -> None:
    """Draw nothing: the table says it all."""


def tables(records: dict[str, Record]) -> dict[str, str]:
    columns = ["model", "dof", "its own settings", "their error", "advice", "promised error",
               "horizon", "speed", "fails from", "stable at rest up to"]  # fmt: skip
    rows = [_row(name, records[key]) for name in MODELS if (key := f"advice/{name}") in records]
    return {"advice": table(columns, rows)}


def _row(name: str, record: Record) -> list[str]:
    if "failed" in record:
        return [name, "", record["failed"], *[""] * 7]
    own, advice = record.get("own"), record.get("advice")
    cells = [name, str(record["dof"])]
    if own is None:
        cells += ["", ""]
    else:
        error = "diverges" if own["error"] is None else _percent(own["error"])
        cells += [_settings(own), error]
    horizon = ""
    if 0.0 < record["horizon"] < WHOLE * record["duration"]:
        horizon = f"{record['horizon']:.2g} s"
    if advice is None:
        return [*cells, record["reason"], "", horizon, "", "", ""]
    gain = record.get("gain", np.nan)
    speed = f"{gain:.2g} times faster" if gain >= 1 else f"{1 / gain:.2g} times slower"
    if 0.9 < gain < 1.1:
        speed = "about the same"
    limits = (
        f"{1e3 * advice[key]:.3g} ms" if advice[key] else "" for key in ("fails_from", "limit")
    )
    return [*cells, _settings(advice), _percent(advice["promised"]), horizon, speed, *limits]


def _percent(error: float) -> str:
    return f"{100 * error:.2g} %" if error > 1e-5 else "< 0.001 %"


def _settings(choice: Record) -> str:
    more = "".join(f', {name}="{value:g}"' for name, value in choice.get("settings", {}).items())
    return f"{choice['integrator']}, {1e3 * choice['timestep']:.3g} ms{more}"
