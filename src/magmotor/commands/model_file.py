"""Models of MJCF files on the command line."""

import os
import re
import stat
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import mujoco

from magmotor.advice.silence import quiet
from magmotor.commands.output import MISTAKE, fail, report, warn_in_one_line
from magmotor.common.checks import did_you_mean
from magmotor.common.exceptions import SHOWN, ArgumentError, InputError
from magmotor.mjcf.lookup import decoded, given_name
from magmotor_plugin import slots

PLUGINS = [name.decode() for name in slots.NAMES]

DROPPED = "MuJoCo drops a <plugin> without an <instance>, so that nothing acts by itself"


def load(path: Path) -> mujoco.MjModel:
    """Return the model of an MJCF file, or of one that MuJoCo has compiled (.mjb).

    Raises
    ------
    ValueError
        The file is not a model.
    """
    try:
        regular = stat.S_ISREG(path.stat().st_mode)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"cannot read {shown(path)}: {reason}") from None
    if not regular:
        raise ArgumentError("path", str(path), "must be a file, not a folder, pipe or device")
    name: Any = os.fsencode(path)  # which need not be UTF-8
    if path.suffix.lower() != ".mjb":
        try:
            model = mujoco.MjModel.from_xml_path(name)
        except ValueError as error:
            said = decoded(error.object) if isinstance(error, UnicodeDecodeError) else str(error)
            raise InputError(f"cannot load {shown(path)}: {in_words(said)}") from None
        if is_dropped(path, model):
            warnings.warn(f"{shown(path)}: {DROPPED}", stacklevel=2)
        return model
    with quiet():
        try:
            return mujoco.MjModel.from_binary_path(name)
        except ValueError:
            sentence = f"must be a model that MuJoCo {mujoco.__version__} has compiled"
            raise ArgumentError("path", str(path), sentence) from None


def is_dropped(path: Path, model: mujoco.MjModel) -> bool:
    """Whether MuJoCo has dropped the plugin that an element of a model's file names."""
    if model.nplugin:
        return False
    try:
        root = ElementTree.fromstring(decoded(path.read_bytes()).lstrip("\ufeff"))
    except ElementTree.ParseError:  # of what MuJoCo reads, though it is not valid XML
        return False
    return any(element.get("plugin") in PLUGINS for element in root.iter("plugin"))


def ignore_idle() -> None:
    """Ignore the plugin's warning that nothing acts, where the command says so itself."""
    warnings.filterwarnings("ignore", "nothing acts on this model")


def in_words(message: str) -> str:
    """Return what MuJoCo's compiler or parser says, without the prefixes that name its parts."""
    words = " ".join(message.split())
    if broken := re.search(r"XML_ERROR_.*Line number=(\d+)", words):
        return f"it is not valid XML (line {broken[1]})"
    if plugin := re.search(r"plugin (\S+) not found", words):
        words = words.replace(plugin[0], plugin[0] + did_you_mean(plugin[1], PLUGINS))
    return re.sub(r"^((XML )?Error: |engine error: |XML parse error \d+: |ParseXML: )+", "", words)


def shown(path: Path) -> str:
    """Return a path for a message, of which a long one shows only the end."""
    text = str(path)
    return text if len(text) <= SHOWN else f"...{text[-SHOWN:]}"


def read(path: Path, keyframe: str = "") -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Return the model of a file, and its initial state or that of a keyframe.

    Raises
    ------
    ValueError
        The file is not a model, or has no such keyframe.
    """
    model = load(path)
    data = mujoco.MjData(model)
    if keyframe:
        names = [given_name(model, "key", k) for k in range(model.nkey)]
        if keyframe not in names:
            known = ", ".join(names) or "none"
            raise InputError(f"keyframe = {keyframe!r}: must be one of the model's: {known}")
        mujoco.mj_resetDataKeyframe(model, data, names.index(keyframe))
    return model, data


def answer(question: Callable[[], None]) -> None:
    """Call a function; a mistake in the file or the options ends the program with one line."""
    warn_in_one_line()
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(report)
    try:
        question()
    except (ValueError, mujoco.FatalError) as error:
        fail(" ".join(str(error).split()), MISTAKE)
    finally:
        mujoco.set_mju_user_warning(before)
