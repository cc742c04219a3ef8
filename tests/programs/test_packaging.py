"""The wheel and its extras: what is in them, and what the core does without any extra."""

import json
import os
import re
import subprocess
import sys
import tarfile
import tomllib
import warnings
import zipfile
from importlib.metadata import distribution
from pathlib import Path
from shutil import copy, which
from types import SimpleNamespace
from typing import Any

import pytest
from packaging.requirements import Requirement

from library import wheel as build_hook
from magmotor.commands import COMMANDS, EXTRAS, completion, main
from magmotor.common import optional
from magmotor.common.versions import package_checksum
from magmotor.numerics import native_library

ROOT = Path(__file__).parents[2]
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PROJECT = PYPROJECT["project"]
DEPENDENCIES = [
    *PYPROJECT["tool"]["hatch"]["metadata"]["hooks"]["custom"]["dependencies"],
    *PROJECT["optional-dependencies"]["numba"],
]
"""Those of a wheel without the library of compiled functions."""

NEEDLE = """
<mujoco>
  <extension><plugin plugin="magmotor.forces"><instance name="magnets">
    <config key="act" value="dipoles"/>
  </instance></plugin></extension>
  <worldbody>
    <site name="magnet" pos="0 0.1 0" zaxis="0 1 0" user="5"/>
    <body>
      <joint type="hinge" axis="0 0 1" damping="1e-4"/>
      <geom type="capsule" fromto="-0.03 0 0 0.03 0 0" size="0.003"/>
      <site name="needle" zaxis="1 0 0" user="0.2"/>
    </body>
  </worldbody>
</mujoco>
"""

SHORT = "method='variational/euler', timestep=0.025, duration=1.0"
"""Arguments of a run without MuJoCo."""

VARY = "vary={'tilt': [0.0]}, measure=['max_spin']"

SCENES = 'pip install "magmotor[scenes]"'


def closure(requirements):
    """Return the names of these packages and of all that they require."""
    names, pending = set(), [Requirement(line) for line in requirements]
    while pending:
        requirement = pending.pop()
        if requirement.name in names or not _applies(requirement, {""}):
            continue
        names.add(requirement.name)
        within = requirement.extras or {""}
        needed = map(Requirement, distribution(requirement.name).requires or ())
        pending += [inner for inner in needed if _applies(inner, within)]
    return names


def _applies(requirement, extras):
    marker = requirement.marker
    return marker is None or any(marker.evaluate({"extra": extra}) for extra in extras)


@pytest.fixture(scope="module")
def core(tmp_path_factory):
    """Run Python in an environment that has no extra: links to the packages of the core alone."""
    folder = tmp_path_factory.mktemp("site-packages")
    for name in closure([*DEPENDENCIES, "magmotor"]):
        found = distribution(name)
        parts = {file.parts[0] for file in found.files or () if file.parts[0] != ".."}
        for part in parts - {"__pycache__"}:
            if not (folder / part).exists():
                try:
                    (folder / part).symlink_to(found.locate_file(part))
                except OSError:
                    pytest.skip("this system creates no symbolic links")
    path = os.pathsep.join([str(ROOT / "src"), str(folder)])

    def run(*arguments):
        return subprocess.run(
            [sys.executable, "-S", *arguments], env={**os.environ, "PYTHONPATH": path},
            capture_output=True, text=True, check=False, cwd=folder.parent,
        )  # fmt: skip

    return run


def test_the_core_has_no_extra(core):
    program = "from magmotor.common.optional import missing_packages as m; print(*m('all'))"
    found = core("-c", program)
    assert found.stderr == ""
    missing = set(found.stdout.split())
    assert missing == set(optional.packages("all")) - {"numba"}  # here, there is no library
    assert {"dm-control", "netcdf4", "matplotlib", "mediapy", "distributed", "gymnasium"} < missing


def test_the_core_simulates_checks_describes_and_heats_any_model(core, tmp_path):
    program = f"""
import magmotor as mm, mujoco, sys
model = mujoco.MjModel.from_xml_string('''{NEEDLE}''')
data = mujoco.MjData(model)
mujoco.mj_step(model, data, nstep=5000)
print(data.qpos.round(4))
print(mm.describe(model))
print(mm.check(model))
mm.magnet("sphere", size=0.01, grade="N42")
run = mm.Langevin(model, kT=2e-4).sample(2000 * model.opt.timestep, replicas=4, record_interval=20)
found = mm.kinetic_temperature(model, run)
print("temperature", float(found.total) / 2e-4)
rest = ("dm_control", "netCDF4", "matplotlib", "PIL", "mediapy", "distributed", "gymnasium")
print("extras", [name for name in rest if name in sys.modules])
"""
    found = core("-W", "error", "-c", program)
    assert found.returncode == 0, found.stderr
    assert found.stdout.startswith("[1.5708]\n")
    assert "dipoles: 1 on world, 1 on body 1" in found.stdout
    assert found.stdout.endswith("extras []\n")
    (ratio,) = map(float, re.findall(r"temperature (\S+)", found.stdout))
    assert abs(ratio - 1) < 0.5  # 0.07


def test_parts_of_scipy_are_imported_where_they_are_used():
    """With them, a process of a sweep took 3.5 s to import everything, instead of 2.5 s."""
    program = (
        "import sys; import magmotor as mm; mm.Top, mm.Motor, mm.Disk, mm.sweep.run;"
        "parts = 'interpolate', 'ndimage', 'optimize', 'stats';"
        "print([part for part in parts if f'scipy.{part}' in sys.modules])"
    )
    command = [sys.executable, "-c", program]
    assert subprocess.run(command, check=True, capture_output=True, text=True).stdout == "[]\n"


NEEDS = [
    ("mm.build(mm.Top())", "dm_control", "scenes"),
    ("mm.simulate(mm.Top(), duration=1.0)", "dm_control", "scenes"),
    (f"mm.sweep.run(mm.sweep.Sweep(scene=mm.Top(), {VARY}, {SHORT}), 'out')", "netCDF4", "sweep"),
    ("mm.advise(mujoco.MjModel.from_xml_string('<mujoco/>'), picture='a.png')",
     "matplotlib", "movies"),
    (f"mm.plots.overview(mm.simulate(mm.Top(), {SHORT}), None, 'a.png')", "matplotlib", "movies"),
    ("mm.sweep.local_cluster().__enter__()", "distributed", "cluster"),
    ("import magmotor.gym", "gymnasium", "gym"),
    ("import magmotor.warp", "mujoco_warp", "warp"),
]  # fmt: skip
"""Code, the package that it misses first, and the extra to install."""


def test_what_needs_an_extra_says_which(core):
    program = f"""
import magmotor as mm, mujoco
for code in {[code for code, *_ in NEEDS]!r}:
    try:
        exec(code)
    except ModuleNotFoundError as missing:
        print(missing)
"""
    found = core("-c", program)
    assert len(found.stdout.splitlines()) == len(NEEDS), found.stderr
    for line, (_, package, extra) in zip(found.stdout.splitlines(), NEEDS, strict=True):
        assert line.startswith(f'{package} is not installed: pip install "magmotor[{extra}]"')


NEED = {
    "movie top": "movies",
    "sweep top": "sweep",
    "rerun run.nc": "scenes",
    "view top": "scenes",
    "view top --web": "scenes,web",
}
"""Commands, and the extra that each needs."""

COMMANDS_IN_A_ROW = """
import contextlib, io, json, sys
from magmotor.commands import main
found = []
for line in sys.argv[1:]:
    sys.argv[1:] = line.split()
    said, error = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(error):
        try:
            code = main()
        except SystemExit as end:
            code = end.code
    found.append((code or 0, said.getvalue(), error.getvalue()))
print(json.dumps(found))
"""


def test_without_extras_commands_help_act_on_any_model_or_say_which_extra_they_need(core, tmp_path):
    (tmp_path / "needle.xml").write_text(NEEDLE)
    work = f"check {tmp_path / 'needle.xml'}", "--help", "movie --help"
    done = core("-c", COMMANDS_IN_A_ROW, *work, *NEED)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert [(code, error) for code, _, error in found[:3]] == [(0, "")] * 3
    assert set(EXTRAS) < set(COMMANDS)
    for (code, said, error), (command, extra) in zip(found[3:], NEED.items(), strict=True):
        assert (code, said) == (2, ""), command
        (line,) = error.splitlines()
        name = command.split()[0]
        assert re.match(rf"magmotor {name}: [\w, -]*netcdf4[\w, -]* are not installed: ", line)
        assert f'pip install "magmotor[{extra}]"' in line
    assert core("-m", "magmotor", "movie", "top").stderr == found[3][2]


def test_the_extras_that_the_code_names_exist():
    named = set(EXTRAS.values())
    for file in (ROOT / "src").rglob("*.py"):
        named |= set(re.findall(r'\b(?:extra|require)\("(\w+)"', file.read_text(encoding="utf-8")))
    extras = set(PROJECT["optional-dependencies"])
    assert {"scenes", "movies", "sweep", "cluster", "gym"} <= named <= extras
    named -= {"parquet", "warp"}  # large, and for one format of files, or one engine
    everything = {name for extra in named for name in optional.packages(extra)}
    assert everything <= set(optional.packages("all"))


@pytest.mark.parametrize(
    ("version", "missing", "remedy"),
    [
        ((3, 12), ["dm-control"], SCENES),
        ((3, 13), ["dm-control"], optional.LABMAZE),
        (
            (3, 14),
            ["dm-control", "lxml"],
            f'pip install "magmotor[scenes]", then {optional.LABMAZE}',
        ),
        ((3, 14), ["lxml"], SCENES),
    ],
)
def test_where_labmaze_has_no_wheel_the_remedy_says_so(monkeypatch, version, missing, remedy):
    monkeypatch.setattr(sys, "version_info", version)
    assert optional.remedy("scenes", missing) == remedy


COMPLETED = {
    "des": {"describe"},
    "movie top --til": {"--tilt", "--tilt-azimuth"},
    "movie x": set(),
    "movie ''": {"top", "motor"},
    "sweep st": {"status"},
    "check ''": set(),
    "examples show magnetic_": {
        "magnetic_assembly",
        "magnetic_beads",
        "magnetic_gripper",
        "magnetic_pendulum",
    },
    "examples run pick_and_place --m": {"--movie"},
}
"""Words before the key TAB, and those that bash offers then."""


@pytest.mark.parametrize("command", ["movie", "view", "sweep", "export", "completion", "examples"])
def test_the_shell_completes_the_words_that_a_command_allows(command, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["magmotor", command, "zzz"])
    monkeypatch.setattr(warnings, "showwarning", warnings.showwarning)  # commands set it
    with pytest.raises(SystemExit):
        main()
    error = capsys.readouterr().err
    (allowed,) = re.findall(r"(?:must be one of|must be|Expected one of) ([^;\n]+)", error)
    words = set(re.findall(r"\w+", allowed.partition(", or an MJCF")[0])) - {"or"}
    assert words == set(completion.FIRST[command].split())


@pytest.mark.skipif(which("bash") is None, reason="there is no bash")
def test_bash_completes_commands_and_flags(tmp_path):
    magmotor = f"magmotor() {{ '{sys.executable}' -m magmotor \"$@\"; }}"
    script = f'set -e\n{magmotor}\neval "$(magmotor completion bash)"\nset +e\n'
    for words in COMPLETED:
        script += f"COMP_WORDS=(magmotor {words}) COMP_CWORD={len(words.split())}\n"
        script += '_magmotor\necho "${COMPREPLY[@]}"\n'
    found = subprocess.run(
        ["bash", "-c", script], capture_output=True, text=True, check=False, cwd=tmp_path
    )
    assert found.stderr == ""
    lines = [set(line.split()) for line in found.stdout.splitlines()]
    assert dict(zip(COMPLETED, lines, strict=True)) == COMPLETED


def test_zsh_uses_the_script_of_bash():
    first, rest = completion.ZSH.split("\n", 1)
    assert first.endswith("bashcompinit")
    assert rest == completion.BASH


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """Build the sdist, and the wheel from what it contains; return their files."""
    out = tmp_path_factory.mktemp("dist")
    _build(ROOT, "sdist", out)
    (sdist,) = out.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        archive.extractall(out, filter="data")
    (source,) = (path for path in out.iterdir() if path.is_dir())
    _build(source, "wheel", out)
    (wheel,) = out.glob("*.whl")
    return source, wheel


def _build(folder, kind, out):
    command = [sys.executable, "-m", "hatchling", "build", "-t", kind, "-d", str(out)]
    subprocess.run(command, cwd=folder, check=True, capture_output=True)


def test_the_wheel_contains_the_package_its_models_and_examples_and_nothing_else(built, tmp_path):
    _, wheel = built
    assert wheel.stat().st_size < 1.2e6  # 1.02 MB
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
        archive.extractall(tmp_path)
    tops = {name.split("/")[0] for name in names}
    assert {re.sub(r"-.*", "", top) for top in tops} == {"magmotor", "magmotor_plugin"}
    for folder in ("models", "models/parts", "examples"):
        here = {f"magmotor/{folder}/{file.name}" for file in (ROOT / folder).glob("*.*")}
        assert here
        assert here <= names
    assert {"magmotor/py.typed", "magmotor/__init__.pyi", "magmotor/run/front.json"} < names
    kinds = {Path(name).suffix for name in names if not name.startswith("magmotor-")}
    assert kinds == {".py", ".pyi", ".typed", ".json", ".xml"}
    program = (
        "from magmotor.common.versions import package_checksum as c, data_folder as d;"
        "print(c(), d('examples'), d('models'))"
    )
    found = subprocess.run(
        [sys.executable, "-c", program], env={**os.environ, "PYTHONPATH": str(tmp_path)},
        capture_output=True, text=True, check=True, cwd=tmp_path,
    )  # fmt: skip
    inside = tmp_path / "magmotor"
    assert found.stdout.split() == [
        str(package_checksum()), str(inside / "examples"), str(inside / "models")
    ]  # fmt: skip


@pytest.fixture
def with_library(tmp_path, monkeypatch):
    """The build hook, in a folder where the libraries are texts, and where nothing is compiled."""
    commands = []
    monkeypatch.setattr(build_hook.subprocess, "run", lambda command, **_: commands.append(command))
    folder = tmp_path / build_hook.FOLDER
    folder.mkdir(parents=True)
    for level in build_hook.LEVELS["x86_64"]:
        (folder / f"libmagmotor-{level}.so").write_text("GLIBC_2.2.5 GLIBC_2.17")
    monkeypatch.setattr(build_hook.platform, "machine", lambda: "x86_64")
    monkeypatch.setattr(build_hook.sys, "platform", "linux")
    core = SimpleNamespace(
        dependencies=["mujoco>=3.11"], optional_dependencies={"scenes": ["scipy"]}
    )
    metadata = SimpleNamespace(core=core)
    return SimpleNamespace(root=str(tmp_path), metadata=metadata, commands=commands)


def test_the_switch_puts_the_library_into_the_wheel_and_takes_numba_out(with_library, monkeypatch):
    data, metadata = {"force_include": {}}, {}
    config: Any = SimpleNamespace(config={"dependencies": ["mujoco>=3.11", "numpy>=2.1"]})
    monkeypatch.delenv("MAGMOTOR_LIBRARY", raising=False)
    build_hook.Library.initialize(with_library, "standard", data)
    build_hook.Dependencies.update(config, metadata)
    assert data == {"force_include": {}}
    assert build_hook.Library.dependencies(with_library) == []
    assert metadata["dependencies"] == ["mujoco>=3.11", "numba>=0.63", "numpy>=2.1"]
    monkeypatch.setenv("MAGMOTOR_LIBRARY", "1")
    build_hook.Library.initialize(with_library, "editable", data)
    assert data == {"force_include": {}}
    assert with_library.commands == []
    build_hook.Library.initialize(with_library, "standard", data)
    (command,) = with_library.commands
    assert command[1:] == ["-m", "library.build", "x86-64-v3", "x86-64-v4"]
    needed = build_hook.Library.dependencies(with_library)
    assert needed == ["mujoco>=3.11", "scipy", "numba>=0.63"]
    build_hook.Dependencies.update(config, metadata)
    assert {Path(name).name for name in data["force_include"]} == {
        "libmagmotor-x86-64-v3.so", "libmagmotor-x86-64-v4.so"
    }  # fmt: skip
    assert (data["tag"], data["pure_python"]) == ("py3-none-manylinux_2_17_x86_64", False)
    assert metadata["dependencies"] == ["mujoco>=3.11", "numpy>=2.1"]


def test_the_switch_is_0_or_1(monkeypatch):
    monkeypatch.setenv("MAGMOTOR_LIBRARY", "yes")
    with pytest.raises(RuntimeError, match="MAGMOTOR_LIBRARY = 'yes': must be 0 or 1"):
        build_hook.wanted()


def test_a_library_that_the_tag_would_not_describe_makes_no_wheel(with_library, monkeypatch):
    monkeypatch.setenv("MAGMOTOR_LIBRARY", "1")
    folder = Path(with_library.root, build_hook.FOLDER)
    (folder / "libmagmotor-x86-64-v4.so").write_text("GLIBC_2.2.5 GLIBC_2.34")
    with pytest.raises(RuntimeError, match=r"needs glibc \(2, 34\)"):
        build_hook.Library.initialize(with_library, "standard", {"force_include": {}})
    monkeypatch.setattr(build_hook.platform, "machine", lambda: "m68k")
    with pytest.raises(RuntimeError, match="there is no library for linux on m68k"):
        build_hook.Library.initialize(with_library, "standard", {"force_include": {}})
    monkeypatch.setattr(build_hook.platform, "machine", lambda: "x86_64")
    monkeypatch.setattr(build_hook.sys, "platform", "darwin")
    with pytest.raises(RuntimeError, match="there is no library for darwin"):
        build_hook.Library.initialize(with_library, "standard", {"force_include": {}})


def test_the_wheel_has_the_kinds_of_processors_that_python_looks_for():
    assert {key: {*kinds} for key, kinds in build_hook.LEVELS.items()} == {
        key: {*kinds} for key, kinds in native_library.LEVELS.items()
    }
    assert Path(build_hook.FOLDER) == native_library.FOLDER.relative_to(ROOT)
    (compiler,) = PROJECT["optional-dependencies"]["numba"]
    assert compiler == build_hook.COMPILER


def test_the_sdist_contains_what_its_tests_need(built):
    source, _ = built
    texts = [path.read_text(encoding="utf-8") for path in (ROOT / "tests").rglob("*.py")]
    named = set(re.findall(r'ROOT / "([\w.]+)"', "".join(texts))) - {"out"}  # commands make this
    assert {".github", "docs", "models", "CITATION.cff", "Makefile"} <= named
    for name in named | {"tests", "trials", "paper", "benchmarks", "LICENSE", "CHANGELOG.md"}:
        assert (source / name).exists(), name


def test_every_requirement_has_a_pin_that_satisfies_it():
    pins = {}
    for line in (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines():
        if line and not line.startswith("#"):
            name, _, pinned = line.partition("==")
            pins[re.sub(r"[-_.]+", "-", name).lower()] = pinned
    groups = [DEPENDENCIES, *PROJECT["optional-dependencies"].values()]
    for requirement in (Requirement(line) for group in groups for line in group):
        name = re.sub(r"[-_.]+", "-", requirement.name).lower()
        if name != "magmotor":
            assert requirement.specifier.contains(pins[name]), requirement


@pytest.mark.skipif(not which("make"), reason="no make")
def test_make_keeps_an_environment_that_it_did_not_set_up(tmp_path):
    for name in ("Makefile", "constraints.txt", "pyproject.toml"):
        copy(ROOT / name, tmp_path)
    mine = tmp_path / ".venv" / "mine"
    mine.parent.mkdir()
    mine.touch()
    done = subprocess.run(["make", "movie"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 2
    assert done.stderr.startswith("make: .venv was not set up by make: move or remove it\n")
    assert mine.exists()


def test_the_workflows_run_targets_that_exist_and_only_a_release_may_publish():
    yaml = pytest.importorskip("yaml")
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE))
    folder = ROOT / ".github" / "workflows"
    jobs, ran = {}, set()
    for file in folder.glob("*.yml"):
        workflow = yaml.safe_load(file.read_text(encoding="utf-8"))
        assert workflow["permissions"] == {"contents": "read"}, file
        for name, job in workflow["jobs"].items():
            jobs[file.stem, name] = job
            assert (ROOT / job.get("uses", "")).exists(), (file, name)
            for step in job.get("steps", ()):
                ran |= set(re.findall(r"\bmake ([a-z-]+)", step.get("run", "")))
    assert {"lint", "test", "docs", "compat"} <= ran <= targets
    publishing = {key for key, job in jobs.items() if "id-token" in job.get("permissions", {})}
    assert publishing == {("release", "publish")}
    systems = {*jobs["ci", "other-systems"]["strategy"]["matrix"]["system"]}
    assert {system.partition("-")[0] for system in systems} == {"macos", "windows"}
    minors = jobs["ci", "test"]["strategy"]["matrix"]["python"]
    assert minors[0] == PROJECT["requires-python"].removeprefix(">=")
    assert {f"Programming Language :: Python :: {minor}" for minor in minors} >= {
        line for line in PROJECT["classifiers"] if ":: Python :: 3." in line
    }
