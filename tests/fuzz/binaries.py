"""Damaged models: binaries (.mjb) of which one index, size or text is wrong.

MuJoCo's own check lets many of them pass. They must not crash a process with magmotor unless they
crash one without it, whose plugin does nothing. Each binary is read in two forked processes.
"""

import contextlib
import ctypes
import multiprocessing
import os
import resource
import signal
import warnings
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import mujoco
import numpy as np

import magmotor as mm
import magmotor_plugin
from magmotor.mjcf import layout
from magmotor.mjcf.forces.valid_indices import INDICES, TEXTS

LARGEST = 2**31 - 1

SECONDS = 20
"""Time after which a process is ended; it then counts as crashed by SIGALRM."""

RETRIES = 3
"""How often a binary that crashed is tried without magmotor, each time with other memory."""

M_PERTURB = -6
"""mallopt's parameter: the byte with which glibc fills memory."""

MEMORY = 8 << 30
"""Bytes of address space of a process."""

MODEL = """
<mujoco>
  <option timestep="1e-3"/>
  <size nuserdata="5"/>
  <extension>
    {plugin}
    <plugin plugin="magmotor.magnetometer"><instance name="hall"/></plugin>
  </extension>
  <custom>
    <text name="other" data="words"/>
    <text name="magmotor" data="all"/>
    <numeric name="magnetic_tolerance" data="1e-3"/>
    <numeric name="field_up" data="0 0 1e-3 0 0 0 0 0"/>
    <numeric name="steel" data="1000 1.5e6"/>
    <tuple name="field of the rail">
      <element objtype="numeric" objname="field_up"/>
      <element objtype="actuator" objname="current"/>
      <element objtype="site" objname="end"/>
    </tuple>
    <tuple name="coil">
      <element objtype="actuator" objname="drive" prm="2"/>
      <element objtype="body" objname="rotor"/>
      <element objtype="site" objname="free"/>
    </tuple>
    <tuple name="coupling">
      <element objtype="body" objname="rotor" prm="2"/>
      <element objtype="body" objname="ball" prm="2"/>
    </tuple>
    <tuple name="iron">
      <element objtype="numeric" objname="steel"/>
      <element objtype="geom" objname="core"/>
    </tuple>
  </custom>
  <worldbody>
    <geom name="core" type="box" size=".02 .02 .02" pos="0 0 -.3"/>
    <site name="end" pos="1 0 0"/>
    <body name="base" pos="0 0 .1">
      <geom size=".02"/>
      <body name="rotor">
        <joint name="axle" type="hinge" damping="1e-3" user="1e-3 0 0 2e-3"/>
        <geom size=".03"/>
        {sites}
      </body>
    </body>
    <body name="ball" pos=".3 0 0" user="0 0 1e-4 0 0 0">
      <freejoint/>
      <geom size=".02"/>
      <site name="free" user=".3"/>
    </body>
    <body pos="0 .4 0"><joint type="slide" user="1e-3 0"/><geom size=".03"/><site user="1"/></body>
  </worldbody>
  <actuator>
    <general name="drive" joint="axle" gainprm="0" ctrlrange="-1 1"/>
    <general name="current" joint="axle" gainprm="0" dyntype="filter" dynprm="1e-2"/>
  </actuator>
  <sensor><plugin name="probe" instance="hall" objtype="site" objname="end"/></sensor>
</mujoco>"""
FORCES = '<plugin plugin="magmotor.forces"><instance name="m"><config key="act" value="all"/></instance></plugin>'  # noqa: E501
SITES = "".join(f'<site pos="{k / 100} 0 0" zaxis="1 {k} 0" user=".1"/>' for k in range(20))


class Mutation(NamedTuple):
    """A damaged model: its number, whether it has the plugin, and what is wrong with it."""

    number: int
    plugin: bool
    field: str
    element: int
    value: int

    def __str__(self) -> str:
        what = f"{self.field}[{self.element}] = {self.value}"
        return f"{what}, {'with the plugin' if self.plugin else 'inside magnetism()'}"


class Outcome(NamedTuple):
    """How the processes with and without magmotor ended: by a signal, or by 0."""

    mutation: Mutation
    ours: int
    bare: int

    @property
    def is_ours(self) -> bool:
        """Whether magmotor alone makes it crash."""
        return self.ours > 0 and self.bare == 0


def model(plugin: bool) -> mujoco.MjModel:
    """Return the sound model, in which everything acts."""
    return mujoco.MjModel.from_xml_string(
        MODEL.format(plugin=FORCES if plugin else "", sites=SITES)
    )


def directed() -> list[Mutation]:
    """Return -1, the largest C int and the first number out of range in all that magmotor reads."""
    sound = model(False), model(True)
    last = {name: getattr(sound[0], name).size - 1 for name in integers(sound[0])}
    last = {name: place for name, place in last.items() if name in layout.MODEL_FIELDS}
    wrong = [(field, k, value) for field, k in last.items() for value in (-1, LARGEST)]
    wrong += [(field, last[field], getattr(sound[0], limit)) for field, _, limit, *_ in INDICES]
    found = [Mutation(k, k % 2 == 1, *each) for k, each in enumerate(wrong)]
    for field, count in TEXTS:
        plugin = field == "plugin_attr"
        found.append(Mutation(len(found), plugin, field, getattr(sound[plugin], count) - 1, 1))
    return found


def integers(model: mujoco.MjModel) -> list[str]:
    """Return the fields of C ints that are not empty."""
    return [
        name
        for name in sorted(dir(model))
        if isinstance(array := getattr(model, name), np.ndarray)
        and array.dtype == np.int32
        and array.size
    ]


def random(seed: int, number: int) -> Mutation:
    """Return one of all mutations; a negative element permutes the field by the seed `value`."""
    rng = np.random.default_rng([seed, number])
    plugin = bool(rng.integers(2))
    sound = model(plugin)
    field = str(rng.choice([*integers(sound), "header"]))
    if field == "header":
        return Mutation(number, plugin, field, int(rng.integers(250)), int(rng.integers(-2, 40)))
    array = getattr(sound, field).ravel()
    if rng.random() < 0.2:
        return Mutation(number, plugin, field, -1, int(rng.integers(1000)))
    largest = int(array.max())
    values = [-1, -2, 0, 1, largest, largest + 1, largest + 2, 100, LARGEST, -LARGEST - 1]
    return Mutation(number, plugin, field, int(rng.integers(array.size)), int(rng.choice(values)))


def write(mutation: Mutation, path: Path) -> None:
    """Write a damaged binary."""
    damaged = model(mutation.plugin)
    field, element, value = mutation[2:]
    if field in dict(TEXTS):
        place = ctypes.c_void_p.from_address(
            damaged._address + getattr(layout.current(), field)
        ).value
        ctypes.c_byte.from_address((place or 0) + element).value = value
    elif field != "header":
        array = getattr(damaged, field).reshape(-1)
        if element < 0:
            array[:] = np.random.default_rng(value).permutation(array)
        else:
            array[element] = value
    mujoco.mj_saveModel(damaged, str(path), None)
    if field == "header":
        words = np.memmap(path, np.int32, "r+")
        words[element] = value
        words.flush()


def use(path: Path, ours: bool) -> None:
    """Load a binary and step it; with magmotor, do everything that reads a model, too."""
    loaded = mujoco.MjModel.from_binary_path(str(path))
    if not ours:
        data = mujoco.MjData(loaded)
        mujoco.mj_step(loaded, data, nstep=3)
        return
    with mm.magnetism(), contextlib.suppress(Exception):
        data = mujoco.MjData(loaded)
        mujoco.mj_step(loaded, data, nstep=3)
    for function in (mm.describe, mm.check):
        with contextlib.suppress(Exception):
            function(loaded)
    with contextlib.suppress(Exception):
        mm.field(loaded, mujoco.MjData(loaded), [1.0, 2.0, 3.0])


def serve(connection, folder: str, ours: bool) -> None:
    """Fork a process for each binary that arrives; send the signal that ended it, or 0."""
    os.chdir(folder)
    null = os.open(os.devnull, os.O_RDWR)
    for stream in range(3):
        os.dup2(null, stream)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    warnings.simplefilter("ignore")
    libc = ctypes.CDLL(None)
    with contextlib.nullcontext() if ours else magmotor_plugin.without_code():
        for plugin in (True, False) if ours else ():
            sound = Path(folder) / f"sound{plugin}.mjb"
            mujoco.mj_saveModel(model(plugin), str(sound), None)
            use(sound, ours)  # before the fork, so that the children have the compiled code
        connection.send(None)
        while (job := connection.recv()) is not None:
            path, fill = job
            child = os.fork()
            if child == 0:
                resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
                signal.signal(signal.SIGALRM, signal.SIG_DFL)
                signal.alarm(SECONDS)
                if hasattr(libc, "mallopt"):
                    libc.mallopt(M_PERTURB, fill)
                with contextlib.suppress(BaseException):
                    use(path, ours)
                os._exit(0)
            status = os.waitpid(child, 0)[1]
            connection.send(os.WTERMSIG(status) if os.WIFSIGNALED(status) else 0)


def tried(mutations: Iterable[Mutation]) -> Iterator[Outcome]:
    """Try damaged models one after another, with and without magmotor."""
    context = multiprocessing.get_context("spawn")
    with TemporaryDirectory() as folder:
        connections, processes = [], []
        for ours in (True, False):
            here, there = context.Pipe()
            process = context.Process(target=serve, args=(there, folder, ours), daemon=True)
            process.start()
            there.close()
            connections.append(here)
            processes.append(process)
        for connection in connections:
            connection.recv()
        with magmotor_plugin.without_code():
            for mutation in mutations:
                path = Path(folder) / "damaged.mjb"
                write(mutation, path)
                for connection in connections:
                    connection.send((path, 0))
                ours, bare = (connection.recv() for connection in connections)
                for fill in range(1, 1 + RETRIES):
                    if ours and not bare:
                        connections[1].send((path, 77 * fill))
                        bare = connections[1].recv()
                yield Outcome(mutation, ours, bare)
        for connection, process in zip(connections, processes, strict=True):
            connection.send(None)
            process.join()


def try_binaries(mutations: Iterable[Mutation], say: Callable = print) -> bool:
    """Try damaged models and report the crashes; return whether none is ours."""
    counts: Counter[str] = Counter()
    for outcome in tried(mutations):
        counts["tried"] += 1
        counts["both"] += outcome.ours > 0 and outcome.bare > 0
        counts["bare"] += outcome.bare > 0 and outcome.ours == 0
        if outcome.is_ours:
            counts["ours"] += 1
            say(f"binary {outcome.mutation}: {signal.Signals(outcome.ours).name}")
    say(
        f"{counts['tried']} damaged binaries: {counts['ours']} crashes with magmotor only,"
        f" {counts['both']} with and without it, {counts['bare']} without it only"
    )
    return counts["ours"] == 0


def mutations(count: int, seed: int) -> list[Mutation]:
    """Return the directed mutations, and further ones up to a number of all."""
    found = directed()[:count]
    return found + [random(seed, number) for number in range(len(found), count)]
