"""Arguments of functions: kinds, ranges, shapes, and files of pictures."""

import math
from tempfile import TemporaryDirectory

import mujoco
import numpy as np
import xarray as xr

import magmotor as mm
from magmotor import live
from magmotor.common.arguments import checked
from magmotor.common.checks import check_array, check_integer, check_number
from magmotor.device import provenance

DISK, TOP = mm.Disk(), mm.Top()
VECTOR, POINTS = [0.0, 0.0, 0.1], [[0.0, 0.0, 0.0]]

MAGNETS = """
<mujoco>
  <worldbody>
    <site pos="-0.5 0.4 0" zaxis="1 0 0" user="8"/>
    <site pos="0.5 -0.6 0.1" zaxis="1 2 2" user="-1"/>
  </worldbody>
</mujoco>
"""


def sweep() -> mm.sweep.Sweep:
    """Return a sweep over two disks."""
    return mm.sweep.Sweep(
        scene=DISK,
        vary={"noise": [1.0, 2.0]},
        measure=["temperature"],
        duration=1.0,
        timestep=0.02,
    )


def run_of(scene: mm.Top | mm.Disk) -> xr.Dataset:
    """Return a short run."""
    return mm.simulate(scene, method="variational/baoab", timestep=0.01, duration=0.3)


def magnets() -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Return a model of two magnets, and its data."""
    model = mujoco.MjModel.from_xml_string(MAGNETS)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


@checked
def harmonic(x):
    """Return x by way of its inverse."""
    return float(1 / (1 / np.float64(x)))


TABLE = r"""
# Kinds of arguments
>>> mm.check(mm.Top())
ArgumentError: model = Top(...): must be an instance of mujoco.MjSpec or mujoco.MjModel, such as
    magmotor.build(scene)
>>> mm.simulate(magnets()[0], method="mujoco/euler", timestep=1e-3, duration=1.0)
ArgumentError: scene = <mujoco...MjModel object at 0x...>: must be an instance of
    magmotor.Disk, magmotor.LangevinParticle, magmotor.Motor or magmotor.Top; step models of your
    own by mujoco.mj_step or magmotor.Langevin
>>> mm.scene_of(None)
ArgumentError: run = None: must be an instance of xarray.Dataset
>>> mm.scene_of("model.xml")
ArgumentError: run = 'model.xml': must be an instance of xarray.Dataset
>>> mm.rerun(3)
ArgumentError: run = 3: must be an instance of xarray.Dataset
>>> mm.methods(3)
ArgumentError: scene = 3: must be an instance of magmotor.Disk, magmotor.LangevinParticle,
    magmotor.Motor or magmotor.Top
>>> mm.theory.libration_frequency(TOP)
TypeError: libration_frequency() needs field
>>> mm.rerun(run_of(DISK), measures=np.array(2.0))
ArgumentError: measures = array(2.): must be a list of names
>>> provenance.scene_from("Pendulum", {})
InputError: scene = 'Pendulum': must be one of Disk, LangevinParticle, Motor, Top; import the
    module that defines the scene class first
>>> provenance.scene_from("Disk", [])
ArgumentError: fields = []: must be an instance of dict

# Numbers
>>> check_number("field", "3")
ArgumentError: field = '3': must be a number
>>> check_number("field", b"3")
ArgumentError: field = b'3': must be a number
>>> check_number("field", bytearray(b"3"))
ArgumentError: field = bytearray(b'3'): must be a number
>>> check_number("field", np.bool_(True))
ArgumentError: field = True: must be a number, not True or False
>>> check_number("field", True)
ArgumentError: field = True: must be a number, not True or False
>>> check_number("field", 10**400)
ArgumentError: field = 1000000...:
    must be a finite number
>>> check_number("field", np.float32("inf"))
ArgumentError: field = inf: must be a finite number
>>> check_number("field", None)
ArgumentError: field = None: must be a number
>>> check_number("field", np.float64(-1.5), at_least=0, unit="m")
ArgumentError: field = -1.5: must be at least 0 m

# Integers
>>> check_integer("field", "3", at_least=0)
ArgumentError: field = '3': must be an integer
>>> check_integer("field", np.bool_(True), at_least=0)
ArgumentError: field = True: must be an integer
>>> check_integer("field", True, at_least=0)
ArgumentError: field = True: must be an integer
>>> check_integer("field", 3.0, at_least=0)
ArgumentError: field = 3.0: must be an integer
>>> check_integer("field", np.float64(3), at_least=0)
ArgumentError: field = 3.0: must be an integer
>>> check_integer("field", None, at_least=0)
ArgumentError: field = None: must be an integer
>>> check_integer("field", 2**53 + 1)
ArgumentError: field = 9007199254740993: must be at most 9007199254740992

# Arrays
>>> check_array("field", [[1, 2], [3]])
ArgumentError: field = [[1, 2], [3]]: must be an array of numbers
>>> check_array("field", [True])
ArgumentError: field = [True]: must be an array of numbers
>>> check_array("field", [1, 2, 3, 4], ..., 3)
InputError: field has shape (4,): must have shape (..., 3)
>>> check_array("field", 1.0, "N")
InputError: field has shape (): must have shape (N,)
>>> check_array("field", [[1, 2]], 2)
InputError: field has shape (1, 2): must have shape (2,)
>>> check_array("field", np.ones((2, 3)), "n", "n")
InputError: field has shape (2, 3): must have shape (n, n)
>>> check_array("field", [1, math.inf])
InputError: field contains inf: every value must be finite and at most 1e+30 in magnitude
>>> check_array("field", [1e31])
InputError: field contains 1e+31: every value must be finite and at most 1e+30 in magnitude
>>> check_array("field", np.ma.array([1.0, 2.0], mask=[False, True]))
ArgumentError: field = masked_array(...): must be an array without masked values

# Results that are not finite
>>> harmonic(0.0)
InputError: harmonic(x): divide by zero encountered in scalar divide; the arguments must be less
    extreme
>>> harmonic(1e-320)
InputError: harmonic(x): overflow encountered in scalar divide; the arguments must be less extreme

# Numbers of scenes
>>> mm.Disk(v=1e200)
ArgumentError: v = 1e+200: must be zero or from 1e-30 to 1e+30 in magnitude
>>> mm.Disk(noise=1e200)
ArgumentError: noise = 1e+200: must be zero or from 1e-30 to 1e+30 in magnitude
>>> mm.Disk(noise=1e-200)
ArgumentError: noise = 1e-200: must be zero or from 1e-30 to 1e+30 in magnitude
>>> mm.Disk(noise=np.ma.masked)
ArgumentError: noise = masked: must be a number
>>> mm.Disk(sigma=5e-324)
ArgumentError: sigma = 5e-324: must be from 1e-30 to 1e+30 in magnitude
>>> mm.Motor(temperature="nonuniform", alpha_ring=1e200)
ArgumentError: alpha_ring = 1e+200: must be zero or from 1e-30 to 1e+30 in magnitude
>>> mm.Motor(temperature="nonuniform", alpha_ring=1e-200)
ArgumentError: alpha_ring = 1e-200: must be zero or from 1e-30 to 1e+30 in magnitude
>>> mm.Top(ball_axial_inertia=5e-324)
ArgumentError: ball_axial_inertia = 5e-324: must be from 1e-30 to 1e+30 in magnitude
>>> mm.Top(ring_dipoles=10**6)
ArgumentError: ring_dipoles = 1000000: must be at most 100000

# Theory, observables and dipoles
>>> mm.observables.minimum(mm.Top(ring_height=100.0))
ArgumentError: height of the ring = 100.0: must be smaller: V_e has no minimum within 1.5 ring
    radii of the center
>>> mm.observables.momentum_map(mm.Top(), np.ones((5, 3)), np.ones((4, 3)))
ArgumentError: shape of angular_velocity = (4, 3): the leading axes must broadcast with (5,), the
    leading axes of axis
>>> mm.dipoles.field([1e300, 0, 0], POINTS, POINTS)
InputError: points contains 1e+300: every value must be finite and at most 1e+30 in magnitude
>>> mm.dipoles.wrench(VECTOR, [1e300, 0, 0], POINTS, POINTS)
InputError: moment contains 1e+300: every value must be finite and at most 1e+30 in magnitude
>>> mm.theory.y_diffusion(mm.Disk(friction=0.0, noise=0.0))
InputError: y_diffusion(scene): float division by zero; the arguments must be less extreme
>>> mm.theory.ReducedDisk(mm.Disk(sigma=1e-20))
ArgumentError: cells for D(d) = 5.07...e+40: must be at most 1e+06; sigma, noise or friction is
    too extreme
>>> mm.theory.d_diffusion(DISK, 1e20)
ArgumentError: terms of D(d) = 5.33...e+39: must be at most 1e+09; d, noise or friction is too
    extreme
>>> mm.theory.position_density(mm.Disk(noise=1e-9), 1.0)
ArgumentError: noise = 1e-09: must be so large that beta max|U''| is at most 1e+06
>>> mm.theory.DiskTheory(mm.Disk(noise=0.0)).first_impulse
ArgumentError: noise = 0.0: must be larger, so that x forgets the phase of U
>>> mm.theory.SmallMotion.of(np.eye(2), np.eye(2), np.eye(3), np.eye(2))
ArgumentError: length n of friction = 3: must be 2, as in inertia
>>> mm.theory.SmallMotion.of(-np.eye(2), np.eye(2), np.eye(2), np.eye(2))
ArgumentError: smallest eigenvalue of inertia = -1.0: must be greater than 0

# Runs and sweeps
>>> mm.simulate(DISK, duration=0)
ArgumentError: duration = 0: must be greater than 0 s
>>> mm.simulate(DISK, duration=1.0, initial={"x": b"1"})
ArgumentError: initial['x'] = b'1': must be an array of numbers
>>> live.live_scene(DISK, timestep=0)
ArgumentError: timestep = 0: must be greater than 0 s
>>> sweep().case(2)
ArgumentError: index = 2: must be at most 1
>>> sweep().changes(-1)
ArgumentError: index = -1: must be at least 0
>>> sweep().axes[0].at(0.5)
ArgumentError: index = 0.5: must be an integer
>>> mm.sweep.Range(0.1, 0.2).stretch(np.ones(1))
ArgumentError: unit[0] = 1.0: must be less than 1

# Pictures
>>> run = run_of(TOP)
>>> mm.plots.overview(run, TOP.replace(friction=0.5), "top.png")
ArgumentError: scene.friction = 0.5: must be 0.3, as in the run
>>> mm.plots.overview(run, None, "missing/top.png")
ArgumentError: path = 'missing/top.png': must be in an existing folder
>>> mm.plots.overview(run, None, "top.xyz")
ArgumentError: path = 'top.xyz': must be a file name that ends in one of .eps, .jpeg, .jpg, .pdf,
    .png, .svg, .tif, .tiff, .webp
>>> folder = TemporaryDirectory(suffix=".png")
>>> mm.plots.overview(run, None, folder.name)
ArgumentError: path = '....png': must be a file, not a folder
>>> folder.cleanup()
>>> mm.plots.overview(run, None, "top.png", dpi=5)
ArgumentError: dpi = 5: must be at least 10
>>> mm.render.movie(run, TOP, "missing/top.mp4")
ArgumentError: path = 'missing/top.mp4': must be in an existing folder
>>> mm.render.movie(run, TOP, "top.xyz")
ArgumentError: path = 'top.xyz': must be a file name that ends in one of .mp4, .webm, .gif

# Arrows
>>> model, data = magnets()
>>> view = mujoco.MjvScene(model, 21)
>>> mm.draw_moments(view, model, data)
>>> mm.draw_field(view, model, data, np.ones((4, 5, 3)))
ArgumentError: view.maxgeom = 21: must be at least 22: 2 geoms and 20 arrows
>>> mm.draw_field(view, model, data, POINTS, limits=(1e-3, 1e-3))
ArgumentError: limits = array([0.001, 0.001]): must be in ascending order
>>> mm.draw_field(view, model, data, POINTS, limits=(0, 1))
ArgumentError: limits[0] = 0.0: must be greater than 0
>>> mm.draw_moments(model, model, data)
ArgumentError: view = <mujoco...MjModel object at 0x...>: must be an instance of
    mujoco.MjvScene
"""
