"""Mistakes in arguments: one line that names argument, value and what is allowed, and code 2."""

import contextlib
import os
import re
import struct
import subprocess
import sys
from pathlib import Path
from typing import Any

import mujoco
import pytest

import magmotor as mm
from magmotor.commands import main
from magmotor.commands.output import NO_OPENGL, UNWRITTEN, fail, film_written, wrapped
from magmotor.numerics.compilation_notice import TEXT
from magmotor.render import NoOpenGL

EXAMPLES = Path(__file__).parents[2] / "examples"

MISSPELLED = """<mujoco><extension><plugin plugin="magmotor.force"/></extension></mujoco>"""

NEEDLE = """
<mujoco>
  <extension><plugin plugin="magmotor.forces"><instance name="magnets">
    <config key="act" value="dipoles"/></instance></plugin></extension>
  <worldbody><site name="magnet" pos="0 .1 0" zaxis="0 1 0"{}/>
    <body><joint axis="0 0 1" damping="1e-4"/><geom size=".01"/>
      <site name="needle" zaxis="1 0 0" user=".2"/></body></worldbody>
</mujoco>"""


@pytest.fixture
def run(monkeypatch, capsys, tmp_path):
    """Run the command in a folder of its own; returns its code, stdout and stderr."""
    monkeypatch.chdir(tmp_path)

    def run_in_folder(line):
        monkeypatch.setattr("sys.argv", ["magmotor", *line.split()])
        code = 0
        try:
            main()
        except SystemExit as end:
            code = end.code
        said, error = capsys.readouterr()
        return code, said, re.sub(f"{TEXT}.*\n", "", error)

    return run_in_folder


@pytest.mark.parametrize(("line", "sentence"), [
    ("movie top --size 320x240",
     ("movie: --size = 320x240: must be INT INT (width and height in pixels; by default 1280"
      " 720, in a GIF 640 360)")),
    ("movie top --ring-dipoles 1e3",
     "movie: --ring-dipoles = 1e3: must be an integer (number of dipoles N on the ring)"),
    ("movie top --tilt=steep",
     ("movie: --tilt = steep: must be a number (angle of the ring's normal from the vertical"
      " (rad))")),
    ("movie top --titl 3",
     ("movie: unrecognized options: --titl, 3 (did you mean --tilt?); see magmotor movie top"
      " --help")),
    ("movie top --duration", "movie: --duration needs a value; see magmotor movie top --help"),
    ("movie top --duration nan", "movie: duration = nan: must be a finite number"),
    ("movie tpo", "movie: 'tpo' (did you mean 'top'?): the first argument must be top or motor"),
    ("movie", "movie: the first argument must be top or motor; see magmotor movie --help"),
    ("movie --tilt 3", "movie: the first argument must be top or motor; see magmotor movie --help"),
    ("movie my.toml",
     ("movie: 'my.toml': the first argument must be top or motor; a scene's file needs its"
      " kind: top --scene my.toml")),
    ("view tops",
     ("view: 'tops' (did you mean 'top'?): the first argument must be top, motor, disk, or an"
      " MJCF file (.xml, .mjcf, .mjb, .mjz)")),
    ("check", "check: PATH is missing: MJCF file; see magmotor check --help"),
    ("check a b", "check: unrecognized options: b; see magmotor check --help"),
    ("describe force.xml",
     ("describe: cannot load force.xml: plugin magmotor.force not found (did you mean"
      " 'magmotor.forces'?) Element 'plugin', line 1")),
    ("describe pipe.xml",
     "describe: path = 'pipe.xml': must be a file, not a folder, pipe or device"),
    ("movie top --scene pipe.xml", "movie: cannot read pipe.xml: pipe.xml is a pipe"),
    ("export run pipe.xml a.csv", "export: cannot read pipe.xml: it is not a file"),
    ("sweep status force.xml",
     "sweep: directory = 'force.xml': must be the folder of a sweep: it has no sweep.json"),
    ("examples list all", "examples: list takes no argument 'all'"),
])  # fmt: skip
def test_a_mistake_in_the_arguments_is_one_sentence(line, sentence, run, tmp_path):
    (tmp_path / "force.xml").write_text(MISSPELLED)
    os.mkfifo(tmp_path / "pipe.xml")
    assert run(line) == (2, "", f"magmotor {sentence}\n")


def test_a_path_of_any_length_is_one_sentence(run):
    code, _, error = run(f"describe {'x' * 3000}.xml")
    assert code == 2
    assert error.startswith("magmotor describe: cannot read ...xxx")
    assert error.endswith("xxx.xml: File name too long\n")
    assert len(error) < 300  # 269


def test_closed_output_is_no_mistake(tmp_path):
    command = f"{sys.executable} -m magmotor export disk disk.toml >&- 2>&-"
    done = subprocess.run(command, shell=True, cwd=tmp_path, timeout=300, check=False)
    assert done.returncode == 0
    assert isinstance(mm.read_scene(tmp_path / "disk.toml"), mm.Disk)


def test_a_log_of_mujoco_is_not_left_behind(run, tmp_path):
    """Of a warning while a file is loaded."""
    (tmp_path / "nan.xml").write_text(NEEDLE.format(' user="nan"'))
    run("view nan.xml --speed 0")
    assert not (tmp_path / "MUJOCO_LOG.TXT").exists()


def test_control_characters_of_a_message_do_not_reach_the_terminal(capsys):
    with pytest.raises(SystemExit, match="2"):
        fail("a\x1b[2Jb\rc", 2)
    assert capsys.readouterr().err.endswith(": a\\x1b[2Jb\\rc\n")


def test_check_says_that_nothing_acts_and_names_sites_that_are_no_dipoles(run, tmp_path):
    (tmp_path / "needle.xml").write_text(NEEDLE.format(""))
    reasons = (
        "the dipoles, since all are on one rigid body",
        'site magnet: a site is a dipole if it has user="MOMENT", in A m^2',
    )
    line = f"nothing acts on this model. Not acting: {'; '.join(reasons)}\n"
    assert run("check needle.xml") == (1, line, "")
    (tmp_path / "needle.xml").write_text(NEEDLE.format(' user="5"'))
    assert run("check needle.xml") == (0, "nothing to fix\n", "")
    (tmp_path / "empty.xml").write_text("<mujoco/>")
    line = "nothing acts on this model: it has no dipoles, fields, coils or iron\n"
    assert run("check empty.xml") == (0, line, "")
    code, said, error = run("view needle.xml --web --method rk4")
    sentence = "unrecognized or misplaced options: --method rk4; see magmotor view model --help\n"
    assert (code, said, error) == (2, "", f"magmotor view: {sentence}")


PARTED = """
<mujoco>
  <compiler meshdir="assets"/>
  <include file="common.xml"/>
  <extension>
    <plugin plugin="magmotor.forces">
      <instance name="magnets"><config key="act" value="dipoles"/></instance>
    </plugin>
  </extension>
  <asset><mesh name="tip" file="tip.obj"/></asset>
  <worldbody>
    <body name="one"><freejoint/><geom class="ball"/><site user="0.54"/>
      <geom type="mesh" mesh="tip" contype="0" conaffinity="0"/></body>
    <body name="other" pos="0 0 0.05"><freejoint/><geom class="ball"/><site user="0.54"/></body>
  </worldbody>
  <keyframe><key name="spin" qvel="0 0 0 0 0 0 0 0 0 0 0 90"/></keyframe>
</mujoco>"""
COMMON = """
<mujocoinclude>
  <default>
    <default class="ball"><geom size="0.005" density="7500" solref="0.01 1"/></default>
  </default>
</mujocoinclude>"""
TIP = "v 0 0 0\nv 1e-3 0 0\nv 0 1e-3 0\nv 0 0 1e-3\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"


@pytest.mark.parametrize("target", ["parts/fixed.xml", "elsewhere/fixed.xml", "a/b/fixed.xml"])
def test_check_writes_a_file_with_what_it_proposes(run, tmp_path, target):
    """With an included file, a default class and a mesh in a folder of its own."""
    (tmp_path / "parts" / "assets").mkdir(parents=True)
    for name, text in {"model.xml": PARTED, "common.xml": COMMON, "assets/tip.obj": TIP}.items():
        (tmp_path / "parts" / name).write_text(text)
    code, said, error = run(f"check parts/model.xml --fix {target}")
    assert (code, error) == (0, "")
    assert said.endswith(f"set: timestep 0.00016 s\nwrote {target}\nin {target}:\nnothing to fix\n")
    before, after = (
        mujoco.MjModel.from_xml_path(str(tmp_path / path)) for path in ("parts/model.xml", target)
    )
    assert before.opt.timestep == 0.002
    assert after.opt.timestep == 0.00016
    assert after.geom_solref.tolist() == [[0.00032, 1], [0.02, 1], [0.00032, 1]]
    assert (after.geom_size == before.geom_size).all()
    assert (after.site_user == before.site_user).all()
    assert run(f"check {target}")[0] == 0
    sentence = "magmotor check: fix = 'fixed.json': must end in .xml\n"
    assert run("check parts/model.xml --fix fixed.json") == (2, "", sentence)


@pytest.mark.filterwarnings("default:.*MuJoCo drops")
def test_check_and_describe_name_a_plugin_that_mujoco_drops(run, tmp_path):
    text = NEEDLE.format(' user="5"')
    start, end = text.index("<instance"), text.index("</plugin>")
    (tmp_path / "needle.xml").write_text(text[:start] + text[end:])
    warning = "needle.xml: MuJoCo drops a <plugin> without an <instance>, so that nothing acts by"
    checked, acting = "note: not acting", "acting: dipoles, inside"
    for command, begins, found in (("check", checked, 1), ("describe", acting, 0)):
        code, said, error = run(f"{command} needle.xml")
        assert code == found
        assert "nothing to fix" not in said
        assert error.startswith(f"magmotor {command}: {warning}")
        assert said.startswith(begins)
        assert "not acting: dipoles outside of magmotor.magnetism()" in said.splitlines()[-1]
    (tmp_path / "needle.xml").write_text(text)


def test_a_comment_that_names_the_plugin_is_not_taken_for_it(run, tmp_path):
    text = NEEDLE.format(' user="5"')
    start, end = text.index("<extension>"), text.index("<worldbody>")
    comment = "<!-- <plugin plugin='magmotor.forces'/>, in stra\xdfe.xml -->"
    (tmp_path / "needle.xml").write_bytes((text[:start] + comment + text[end:]).encode("latin-1"))
    code, said, error = run("check needle.xml")
    assert (code, error) == (0, "")
    assert said.startswith("nothing to fix\nnote: not acting: dipoles outside of")


@pytest.mark.parametrize("target", ["fixed.xml", "else\udcfc/fixed.xml"])
def test_check_fixes_a_file_in_a_folder_whose_name_is_not_utf_8(target, tmp_path):
    """Nor is the name of a body."""
    folder = tmp_path / "fol\udcfc"
    (folder / "assets").mkdir(parents=True)
    (folder / "assets" / "tip.obj").write_text(TIP)
    (folder / "common.xml").write_text(COMMON)
    text = PARTED.replace('"one"', '"M\xfcller"').encode("latin-1")
    (folder / "model.xml").write_bytes(text)
    command = [sys.executable, "-m", "magmotor", "check", "model.xml", "--fix", target]
    command = [folder / word if word.endswith(".xml") else word for word in command]
    done = subprocess.run(command, capture_output=True, env=os.environ | {"PYTHONUTF8": "1"})
    assert (done.returncode, done.stderr) == (0, b"")
    assert done.stdout.endswith(b"nothing to fix\n")
    name: Any = os.fsencode(folder / target)
    model = mujoco.MjModel.from_xml_path(name)
    assert model.opt.timestep == 0.00016


def test_check_names_a_flag_that_disables_the_forces(run, tmp_path):
    text = '<mujoco><option><flag actuation="disable"/></option><size nuser_site="1"/><worldbody>'
    needle = '<body><joint axis="0 0 1"/><geom size=".01"/><site zaxis="1 0 0" user="0.1"/></body>'
    earth = '<site pos="0 1 0" user="0.1"/>'
    (tmp_path / "off.xml").write_text(f"{text}{earth}{needle}</worldbody></mujoco>")
    skipped = "magnetism() does nothing, since MuJoCo skips it while the flag actuation is disabled"
    remedy = ": enable the flag, or let the plugin magmotor.forces act\n"
    code, said, error = run("check off.xml")
    assert (code, error) == (1, "")
    assert said.startswith(f"{skipped}{remedy}note: not acting: dipoles outside of")


def test_check_weighs_a_moment_that_no_magnet_has(run, tmp_path):
    (tmp_path / "needle.xml").write_text(NEEDLE.format(' user="5000"'))
    code, found, error = run("check needle.xml")
    assert (code, error) == (1, "")
    assert "site magnet has 5000 A m^2, the moment of 36 kg of neodymium magnets" in found


WORDS = " word" * 22
LONG = {
    f"a{WORDS}": [f"a{' word' * 19}", "word word word"],
    f"  a{WORDS}": [f"  a{' word' * 19}", "  word word word"],
    f"name   a{WORDS}": [f"name   a{' word' * 18}", "       word word word word"],
    f"a  b  c{WORDS}": [f"a  b  c{WORDS}"],
    f"│ a{WORDS}": [f"│ a{WORDS}"],
    "word" * 30: ["word" * 30],
}


@pytest.mark.parametrize(("line", "shown"), LONG.items())
def test_long_lines_are_wrapped_between_words_but_not_tables(line, shown):
    assert wrapped(f"{line}\n  short", 100).split("\n") == [*shown, "  short"]


@pytest.mark.skipif(sys.platform == "win32", reason="there are no pseudo-terminals")
@pytest.mark.parametrize(("columns", "widest"), [(0, 100), (150, 100), (60, 60)])
def test_lines_fit_into_a_terminal(tmp_path, columns, widest):
    """A width of 0 is unknown; what is piped does not count."""
    mistake, listing = ("examples", "show", "zzz"), ("examples", "list")
    piped = ((mistake, "stdout"), (listing, "stderr")) if columns == 60 else ()
    for arguments, pipe in ((mistake, ""), (listing, ""), *piped):
        shown, _ = in_terminal(arguments, columns, tmp_path, pipe)
        assert widest - 15 < max(map(len, shown.splitlines())) <= widest


@pytest.mark.skipif(sys.platform == "win32", reason="there are no pseudo-terminals")
def test_programs_and_piped_lines_stay_whole(tmp_path):
    source = (EXAMPLES / "levitation.py").read_text(encoding="utf-8")
    shown, _ = in_terminal(("examples", "show", "levitation"), 60, tmp_path)
    assert source in shown.replace("\r\n", "\n")
    _, piped = in_terminal(("examples", "list"), 60, tmp_path, "stdout")
    assert max(map(len, piped.splitlines())) > 100


def in_terminal(arguments, columns, folder, pipe=""):
    """Return what a terminal shows of a command, and what is piped elsewhere."""
    import fcntl
    import pty
    import termios

    terminal, end = pty.openpty()
    fcntl.ioctl(end, termios.TIOCSWINSZ, struct.pack("4H", 24, columns, 0, 0))
    out, error = (subprocess.PIPE if pipe == name else end for name in ("stdout", "stderr"))
    command = [sys.executable, "-m", "magmotor", *arguments]
    with subprocess.Popen(
        command, cwd=folder, text=True, stdin=end, stdout=out, stderr=error
    ) as process:
        os.close(end)
        shown = b""
        with contextlib.suppress(OSError):  # at its end
            while part := os.read(terminal, 4096):
                shown += part
        os.close(terminal)
        piped = "".join(filter(None, process.communicate(timeout=60)))
    return shown.decode(), piped


@pytest.mark.parametrize("command", ["movie", "view", "sweep", "export"])
def test_help_describes_a_command_once(run, command):
    code, said, _ = run(f"{command} --help")
    first = next(line for line in said.splitlines()[1:] if line)
    said = " ".join(said.replace("│", " ").split())
    assert (code, said.count(" ".join(first.split()[:6]))) == (0, 1)
    assert "Hamel's top; the defaults are the paper's fourth case" in said


def test_a_file_of_an_older_run_is_said_to_be_replaced(tmp_path, capsys):
    movie = tmp_path / "top.mp4"
    for verb in ("wrote", "replaced"):
        with film_written(movie) as part:
            part.write_text("frames")
        assert capsys.readouterr().out == f"{verb} {movie}\n"


@pytest.mark.parametrize(("setting", "lines"), [("glfw", 1), ("disable", 3)])
def test_packages_are_named_only_where_they_help(tmp_path, capsys, monkeypatch, setting, lines):
    monkeypatch.setenv("MUJOCO_GL", setting)
    with pytest.raises(SystemExit) as end, film_written(tmp_path / "top.mp4"):
        raise NoOpenGL("no library")
    assert end.value.code == NO_OPENGL
    assert len(capsys.readouterr().err.splitlines()) == lines


def test_advise_says_before_it_measures_that_it_cannot_write(run, tmp_path):
    (tmp_path / "needle.xml").write_text(NEEDLE.format(' user="5"'))
    code, said, error = run("advise needle.xml --picture needle.xml/advise.png")
    assert (code, said) == (UNWRITTEN, "")
    assert error == "magmotor advise: cannot write to needle.xml: it is a file, not a folder\n"
