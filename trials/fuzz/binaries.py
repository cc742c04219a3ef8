"""Damaged models: binaries (.mjb) of which one or two integers, sizes or texts are wrong.

MuJoCo's own check lets many of them pass. They must not crash a process with magmotor unless they
crash one without it, whose plugin does nothing, and they must be refused by a clear error or have
the forces that plain NumPy finds in their arrays. Which fields there are is asked of MuJoCo. Each
binary is read in two forked processes.
"""

import contextlib
import ctypes
import os
import resource
import signal
import warnings
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import mujoco
import numpy as np
from mujoco.introspect import structs

import magmotor as mm
from magmotor_plugin.slots import without_code

from .pool import CONTEXT
from .sound_models import COMPARED, Sound, wrong_forces

LARGEST = 2**31 - 1

SECONDS = 20
"""Time after which a process is ended; it then counts as crashed by SIGALRM."""

RETRIES = 3
"""How often a binary that crashed is tried without magmotor, each time with other memory."""

M_PERTURB = -6
"""mallopt's parameter: the byte with which glibc fills memory."""

MEMORY = 8 << 30
"""Bytes of address space of a process."""

CLEAR = ValueError, mujoco.FatalError
"""Errors that say what is wrong."""


class Edit(NamedTuple):
    """What is wrong in a field: the value of an element, or a permutation with the seed `value`."""

    field: str
    element: int
    """Negative for a permutation."""
    value: int

    def __str__(self) -> str:
        if self.element < 0:
            return f"{self.field} permuted (seed {self.value})"
        return f"{self.field}[{self.element}] = {self.value}"


class Mutation(NamedTuple):
    """A damaged model, and its number."""

    number: int
    sound: Sound
    edits: tuple[Edit, ...]

    def __str__(self) -> str:
        where = "with the plugin" if self.sound.plugin else "inside magnetism()"
        what = f" with {COMPARED}" if self.sound.compared else ""
        return f"{self.number}: {' and '.join(map(str, self.edits))}, {where}{what}"


class Outcome(NamedTuple):
    """How the processes with and without magmotor ended: by a signal, or by 0."""

    mutation: Mutation
    ours: int
    bare: int
    said: str
    """What the one with magmotor found to be wrong."""

    @property
    def is_ours(self) -> bool:
        """Whether magmotor alone makes it crash."""
        return self.ours > 0 and self.bare == 0


@cache
def fields(sound: Sound) -> dict[str, list[str]]:
    """Return the names of integers, characters and sizes in mjModel, by MuJoCo's types of them."""
    model, found = sound.model, {"int *": [], "char *": [], "mjtSize": []}
    for field in structs.STRUCTS["mjModel"].fields:
        kind = str(field.type)
        if kind in found and (
            kind == "mjtSize" or len(getattr(model, field.name)) > (kind == "char *")
        ):
            found[kind].append(field.name)
    return found


def mutation(seed: int, number: int) -> Mutation:
    """Return one of all mutations; numbers in a row damage all fields of integers."""
    rng = np.random.default_rng([seed, number])
    sound = Sound(bool(rng.integers(2)), bool(rng.integers(2)))
    of = fields(sound)
    if rng.random() < 0.1:
        return Mutation(number, sound, (Edit("header", int(rng.integers(250)), value(rng)),))
    if rng.random() < 0.05:
        text = str(rng.choice(of["char *"]))
        place = len(getattr(sound.model, text)) - 1
        return Mutation(number, sound, (Edit(text, place, int(rng.integers(1, 128))),))
    names = [of["int *"][number % len(of["int *"])], str(rng.choice(of["int *"]))]
    edits = (edit(rng, sound, name) for name in names[: 1 + (rng.random() < 0.4)])
    return Mutation(number, sound, tuple(edits))


def edit(rng: np.random.Generator, sound: Sound, field: str) -> Edit:
    """Return something that may be wrong with a field of integers."""
    model = sound.model
    array = getattr(model, field).ravel()
    if rng.random() < 0.2:
        return Edit(field, -1, int(rng.integers(1000)))
    size = getattr(model, str(rng.choice(fields(sound)["mjtSize"])))
    near = int(rng.choice(array)) + int(rng.integers(-2, 3))
    given = rng.choice([value(rng), near, int(array.max()) + 1, min(size, LARGEST)])
    return Edit(field, int(rng.integers(array.size)), int(np.clip(given, -LARGEST - 1, LARGEST)))


def value(rng: np.random.Generator) -> int:
    """Return an integer that is probably out of range."""
    return int(rng.choice([-1, -2, 0, 1, 100, int(rng.integers(40)), LARGEST, -LARGEST - 1]))


def write(mutation: Mutation, path: Path) -> None:
    """Write a damaged binary."""
    damaged, texts = mutation.sound.model, {}
    for field, element, given in mutation.edits:
        if field != "header" and isinstance(array := getattr(damaged, field), bytes):
            texts[array] = element, given  # read-only
        elif field != "header":
            array = getattr(damaged, field).reshape(-1)
            if element < 0:
                array[:] = np.random.default_rng(given).permutation(array)
            else:
                array[element] = given
    mujoco.mj_saveModel(damaged, str(path), None)
    content = bytearray(path.read_bytes())
    for text, (element, given) in texts.items():
        content[content.index(text) + element] = given
    for field, element, given in mutation.edits:
        if field == "header":
            content[4 * element : 4 * element + 4] = given.to_bytes(4, "little", signed=True)
    path.write_bytes(content)


def use(path: Path, ours: bool, compared: bool) -> str:
    """Load a binary and step it; with magmotor, return what is wrong in all that reads a model."""
    try:
        loaded = mujoco.MjModel.from_binary_path(str(path))
    except CLEAR:
        return ""
    if not ours:
        data = mujoco.MjData(loaded)
        mujoco.mj_step(loaded, data, nstep=3)
        return ""

    def stepped() -> str:
        with mm.magnetism():
            data = mujoco.MjData(loaded)
            data.qfrc_applied[:] = data.xfrc_applied[:] = 0  # a history may have overwritten them
            mujoco.mj_forward(loaded, data)
            found = wrong_forces(loaded, data) if compared else ""
            mujoco.mj_step(loaded, data, nstep=3)
        return found

    calls = {
        "step": stepped,
        "describe": lambda: mm.describe(loaded) and "",
        "check": lambda: mm.check(loaded) and "",
        "field": lambda: len(mm.field(loaded, mujoco.MjData(loaded), [1.0, 2.0, 3.0])) * "",
    }
    wrong = []
    for name, call in calls.items():
        try:
            said = call()
        except CLEAR:
            continue
        except Exception as error:
            said = f"{type(error).__name__}: {error}"
        wrong += [f"{name}: {said}"] if said else []
    return "; ".join(wrong)


def serve(connection, folder: str, ours: bool) -> None:
    """Fork a process for each binary; send the signal that ended it or 0, and what it said."""
    os.chdir(folder)
    null = os.open(os.devnull, os.O_RDWR)
    for stream in range(3):
        os.dup2(null, stream)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    warnings.simplefilter("ignore")
    libc = ctypes.CDLL(None)
    with contextlib.nullcontext() if ours else without_code():
        verdict = Path(folder) / f"verdict{ours}"
        for sound in (Sound(p, c) for p in (True, False) for c in (True, False)) if ours else ():
            path = Path(folder) / "sound.mjb"
            mujoco.mj_saveModel(sound.model, str(path), None)
            # Before the fork, so that the children have the compiled code:
            if said := use(path, ours, sound.compared):
                raise AssertionError(f"the sound model is not: {said}")
        connection.send(None)
        while (job := connection.recv()) is not None:
            path, fill, compared = job
            verdict.write_text("")
            child = os.fork()
            if child == 0:
                resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
                signal.signal(signal.SIGALRM, signal.SIG_DFL)
                signal.alarm(SECONDS)
                if hasattr(libc, "mallopt"):
                    libc.mallopt(M_PERTURB, fill)
                with contextlib.suppress(BaseException):
                    verdict.write_text(use(path, ours, compared))
                os._exit(0)
            status = os.waitpid(child, 0)[1]
            ended = os.WTERMSIG(status) if os.WIFSIGNALED(status) else 0
            connection.send((ended, verdict.read_text()))


def tried(mutations: Iterable[Mutation]) -> Iterator[Outcome]:
    """Try damaged models one after another, with and without magmotor."""
    with TemporaryDirectory() as folder:
        connections, processes = [], []
        for ours in (True, False):
            here, there = CONTEXT.Pipe()
            process = CONTEXT.Process(target=serve, args=(there, folder, ours), daemon=True)
            process.start()
            there.close()
            connections.append(here)
            processes.append(process)
        for connection in connections:
            connection.recv()
        with without_code():
            for mutation in mutations:
                path = Path(folder) / "damaged.mjb"
                write(mutation, path)
                for connection in connections:
                    connection.send((path, 0, mutation.sound.compared))
                (ours, said), (bare, _) = (connection.recv() for connection in connections)
                for fill in range(1, 1 + RETRIES):
                    if ours and not bare:
                        connections[1].send((path, 77 * fill, False))
                        bare, _ = connections[1].recv()
                yield Outcome(mutation, ours, bare, said)
        for connection, process in zip(connections, processes, strict=True):
            connection.send(None)
            process.join()


def try_binaries(mutations: Iterable[Mutation], say: Callable = print) -> bool:
    """Try damaged models, report crashes, wrong forces and raw errors; return whether none is ours.

    What a model does that crashes without magmotor does not count.
    """
    counts: Counter[str] = Counter()
    for outcome in tried(mutations):
        counts["tried"] += 1
        counts["both"] += outcome.ours > 0 and outcome.bare > 0
        counts["bare"] += outcome.bare > 0 and outcome.ours == 0
        if outcome.is_ours:
            counts["ours"] += 1
            say(f"binary {outcome.mutation}: {signal.Signals(outcome.ours).name}")
        elif outcome.said and not outcome.bare:
            counts["wrong"] += 1
            say(f"binary {outcome.mutation}: {outcome.said}")
    say(
        f"{counts['tried']} damaged binaries: {counts['ours']} crashes with magmotor only,"
        f" {counts['both']} with and without it, {counts['bare']} without it only;"
        f" {counts['wrong']} with wrong forces or raw errors"
    )
    return counts["ours"] + counts["wrong"] == 0


def mutations(count: int, seed: int) -> list[Mutation]:
    """Return the first mutations of a seed."""
    return [mutation(seed, number) for number in range(count)]
