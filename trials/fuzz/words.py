"""Building blocks of inputs: valid and invalid values as source text, evaluated in `material`.

The placeholders `{kind}`, `{bare}` and `{scene}` are replaced by the scene class of the call.
"""

SCENES = {
    "Top": ["mm.Top()", "mm.Top(surface='plane', coulomb_friction=0.1)", "mm.Top.experiment()"],
    "Motor": ["mm.Motor()", "mm.Motor(alpha_ball=0.0, alpha_ring=0.0)", "mm.Motor.paper()"],
    "Disk": ["mm.Disk()", "mm.Disk(potential='flat')", "mm.Disk(friction_ratio=0.5)",
             "mm.Disk(noise=0.0)", "mm.Disk(potential='flat', noise=0.0)"],
    "LangevinParticle": ["mm.LangevinParticle()", "mm.LangevinParticle(potential='flat')"],
}  # fmt: skip

TREES = ("pendulum", "slides", "chain", "arm", "beads", "grounded", "dry", "noisy")
"""Models with a temperature: names in `material.MODELS`."""

JUNK = str.split("""
None True '' 'nonsense' b'1.0' b'' 1j nan inf -inf 5e-324 1e-200 1e300 -1e300 0 -1 -0.0 0.5 3 10**6
2**31 2**53 2**63 -2**63 10**400 [] () {} set() object() ... [None] ['a'] [[1.0],[1.0,2.0]] mm int
datetime(2020,1,1) np.datetime64('2020') np.timedelta64(1,'s') Fraction(1,3) Decimal('NaN') '1.0'
np.float32(0.1) np.float64(nan) np.int8(-1) np.uint8(3) np.bool_(True) np.str_('1') range(3) print
np.zeros(0) np.zeros((0,3)) np.ones(3) np.ones((2,3)) np.ones((3,4,5)) np.full(3,nan) np.full(3,inf)
np.full((4,3),1e300) np.full(3,5e-324) np.ones(3,complex) np.ones(3,object) np.array([None,1.0,2.0])
np.array(['a','b','c']) np.array(2.0) np.ma.masked np.zeros(3,'M8[s]') np.zeros(2,[('a',float)])
iter([]) iter([1.0,2.0]) memoryview(b'abc') bytearray(8) Path('x') '\\0' type
xr.Dataset() xr.DataArray(1.0) xr.DataArray([1.0,nan]) pd.DataFrame() pd.Series([1.0]) mm.Disk()
mm.Top() mm.Motor() mm.LangevinParticle() mm.Disk mm.simulate run('Top') run('Disk') run('Motor')
many('Disk') grid('Disk') model('empty') {'x':nan} {None:1} {'friction':0.1} {'nonsense':1.0}
{'x':'a'} {'x':[1.0,2.0]} {'scene':'Disk'} [run('Disk')] [mm.Disk()] np.array([mm.Disk()])
""")  # fmt: skip

NUMBERS = str.split("""
nan inf -inf 0 0.0 -0.0 -1 -1e-9 5e-324 2.3e-308 1e-300 1e-200 1e-160 1e-30 1e-9 0.3 1 7 1e9 1e30
1e100 1e150 1e160 1e200 1e300 1.7e308 2**31 2**53 2**62 2**63 2**64 10**400 -2**63 1e18
np.float32(1e30) np.float16(6e4) np.int64(2) np.int8(127) np.float64(inf) np.longdouble('1e400')
np.array(1.0) np.array([1.0]) np.array([[0.5]]) '1' b'1' True 1j None [1] Fraction(1,3)
Decimal('0.1') np.datetime64('2020') np.bool_(False)
""")  # fmt: skip

PATHS = [
    *("''", "'.'", "'..'", "'/'", "'missing/out.png'", "'out'", "'out.xyz'", "'out.'", "'.png'"),
    *("'out\\0.png'", "'a' * 300 + '.png'", "b'out.png'", "full_disk()", "Path('.')", "3", "None"),
    *("Path('/proc/none/out.png')", "'out.png/'", "'\\udcff.png'", "folder('Disk')", "print", "[]"),
]

ARRAYS = [
    *("holding({}, nan)", "holding({}, inf)", "holding({}, -inf)", "holding({}, 'a')"),
    *("holding({}, None)", "holding({}, 1e300)", "np.multiply({}, 1e300)"),
    "np.multiply({}, 1e160)",
    *(
        "np.multiply({}, 5e-324)",
        "np.multiply({}, -1)",
        "np.multiply({}, 0)",
        "np.atleast_1d({})[:0]",
    ),
    *("np.array({}, complex)", "np.array({}, object)", "np.array({}).astype(str)", "[{}]"),
    *("np.array({}, '>f8')", "np.array({}, np.float16)", "np.array({}, np.longdouble)"),
    *("np.array({}).T", "frozen({})", "spread({})", "np.array({})[..., None]"),
    "list(np.ravel({}))",
    *("np.array({}).tobytes()", "xr.DataArray({})", "np.ma.array({}, mask=True)"),
    *("np.array({}).astype('m8[s]')", "np.array({}).astype(int)", "np.atleast_1d({})[..., :-1]"),
    *("np.full(np.shape({}), nan)", "np.array({}).astype(bool)", "np.array([{}, {}])"),
]

DAMAGES = [
    *("dropped({}, {n})", "dropped({}, {n})", "renamed({}, {n})", "recast({}, {n}, 'float32')"),
    *("recast({}, {n}, 'str')", "recast({}, {n}, 'complex')", "recast({}, {n}, 'object')"),
    *("recast({}, {n}, 'int')", "recast({}, {n}, 'datetime64[s]')", "recast({}, {n}, 'bool')"),
    *("poisoned({}, {n}, nan)", "poisoned({}, {n}, inf)", "poisoned({}, {n}, 1e300)"),
    *("poisoned({}, {n}, nan, True)", "poisoned({}, {n}, 0.0, True)", "poisoned({}, {n}, None)"),
    *("poisoned({}, {n}, -1.0, True)", "poisoned({}, {n}, 1e200, True)", "turned({})", "bare({})"),
    *("picked({}, {n}, 0)", "picked({}, {n}, slice(0))", "picked({}, {n}, slice(1))"),
    *("picked({}, {n}, slice(2))", "picked({}, {n}, slice(None, None, 10))", "{}[[*{}][0]]"),
    *("picked({}, {n}, slice(None, None, -1))", "picked({}, {n}, slice(5, None))", "{}.to_dict()"),
    *("picked({}, {n}, [0, 0, 0])", "picked({}, {n}, [])", "{}.expand_dims(other=2)", "{}.attrs"),
    *(
        "{}.mean()",
        "{}.drop_vars([*{}.data_vars])",
        "{}.reset_coords(drop=True)",
        "{}.astype('f4')",
    ),
    *("with_attribute({}, {n}, dropped)",) * 2,
    *("with_attribute({}, {n}, {value})",) * 3,
    *("{}.stack(all=[...])", "{}.chunk"),
]

ATTRIBUTES = str.split("""
None 'nonsense' '' -1 0 nan inf 1e300 10**30 -0.5 b'x' [] {} '{}' '[]' 'null' '[1]' '{"a":1}' True
np.zeros(3) np.float32(0.5) '1e999' 'NaN' 2**53 '../../x' 'os:getcwd' 'Disk' 'mujoco/euler' '\\0'
dropped object() '{"seed":-1,"timestep":1}' '9'*5000 '['*2000
""")  # fmt: skip

FRICTIONS = ["1.0", "np.eye(model({kind}).nv)", "0.3 * np.ones(model({kind}).nv)"]

# Arguments that neither hints nor docstrings describe. A word in braces is the scene's class, or
# the name of a model.
BY_NAME: dict[str, list[str]] = {
    "timestep": ["SHORT[{kind}]['timestep']"],
    "duration": ["10 * SHORT[{kind}]['timestep']"],
    "method": ["SHORT[{kind}]['method']", "mm.methods(mm.{bare}())[0]"],
    "live.live_scene.method": ["'mujoco/euler'", "'mujoco/rk4'"],
    "vary": ["{{'friction_ball' if {kind} == 'Motor' else 'friction': [0.1, 0.2]}}"],
    "samples": ["None"],
    "ranges": ["{{'friction': (0.1, 0.3)}}", "{{'friction': mm.sweep.Range(0.1, 0.3, True)}}"],
    "sweep.Samples.size": ["4"],
    "measure": ["[*mm.sweep.measures(mm.{bare}())]", "['trajectory']"],
    "executor": ["Here()"],
    "workers": ["1", "2"],
    "threads": ["1", "2"],
    "draws": ["20"],
    "device.provenance.scene_from.kind": ["{kind}"],
    "fields": ["{{}}", "{{'friction_ball' if {kind} == 'Motor' else 'friction': 0.2}}"],
    "checkpoint": ["None", "'run.npz'"],
    "initial": ["None", "{{'x': 0.1}}", "{{'velocity': (0.01, 0.02)}}", "run({kind})"],
    "path": ["'out.png'", "Path('out.png')"],
    "noise.BrownianPath.path": ["None"],
    "simulate.path": ["None", "mm.noise.BrownianPath(1, SHORT[{kind}]['timestep'])"],
    "render.movie.path": ["'out.mp4'"],
    "render.contact_sheet.path": ["'out.mp4'"],
    "directory": ["folder({kind})", "folder({kind}, 'trajectory')"],
    "sweep.sweep_of.path": ["folder({kind})", "folder({kind}) / 'sweep.json'"],
    "sweep.run.directory": ["'new'", "folder({kind})"],
    "plots.sweep.data": ["grid({kind})"],
    "live.LiveSimulation.switch.name": ["'magnetism'", "'noise'"],
    "live.LiveSimulation.panel": ["None"],
    "labels": ["['a']", "['a', 'b']"],
    "columns": ["1", "2"],
    "runs": ["[run({kind})]"],
    "scenes": ["[mm.{bare}()]"],
    "speed": ["5000.0"],
    "render.movie.fps": ["10"],
    "render.movie.size": ["(320, 180)", "[640, 360]"],
    "render.still.size": ["(320, 180)"],
    "states": ["states()"],
    "step": ["linear.euler_step", "linear.runge_kutta_step"],
    "values": ["[1.0, 2.0, 3.5, 0.3]"],
    "censored": ["[False, False, True, False]"],
    "inertia": ["np.eye(2)"], "stiffness": ["np.eye(2)"], "friction": ["np.eye(2)"],
    "implicit": ["np.eye(2)"],
    "direction": ["[1.0, 1.0]"],
    "ring_script": ["()", "(mm.Waypoint(0.0, 0.2, 0.1), mm.Waypoint(9.0, 0.3, 0.2))"],
    "moment": ["[0.0, 0.0, 1.0]"], "points": ["[0.1, 0.2, 0.3]", "np.ones((4, 3))"],
    "positions": ["np.linspace(0.0, 1.0, 12).reshape(4, 3)"],
    "moments": ["np.linspace(0.0, 1.0, 12).reshape(4, 3)"],
    "magnetism.data": ["('qvel', 0.0)"],
    "apply_perturbation.model": ["model('Disk')"],
    "tabulated_field.field": ["np.zeros_like", "np.square"],
    "tabulated_field.name": ["'field'", "'field_of_coil'"],
    "draw_field.limits": ["None", "[1e-5, 1e-2]"],
    "observables.effective_potential.points": ["[0.1, 0.2]", "np.ones((4, 2))"],
    "initial_state": ["np.zeros((2, 5))"],
    "velocities": ["[0.1, 0.2]", "np.ones((4, 2))"],
    "axis": ["np.ones((4, 3))"], "slip": ["np.ones((4, 3))"],
    "angular_velocity": ["np.ones((4, 3))"], "velocity": ["np.ones((4, 3))"],
    "position": ["[0.1, 0.2, 0.3]", "np.ones((4, 3))"],
    "place": ["0", "1"], "index": ["0", "1"],
    "halvings": ["1", "2"],
    "kT": ["0.5", "1e-3"],
    "Langevin.model": ["model({kind})"], "JointNoise.model": ["model({kind})"],
    "brownian_rows.model": ["model({kind})"],
    "Langevin.kT": ["0.5", "0", "temperatures({kind})", "None"],
    "Langevin.splitting": ["'baoab'", "'obabo'", "'middle'", "'verlet'", "'o-rk4-o'",
                           "'o-step-o'"],
    "Langevin.friction": ["None", *FRICTIONS],
    "Langevin.disable": ["()", "['contact']", "('limit', 'equality')",
                         "['frictionloss', 'contact', 'actuation', 'limit', 'equality']"],
    "Langevin.path": ["None", "mm.noise.BrownianPath(1, model({kind}).opt.timestep)",
                      "mm.noise.BrownianPath(1, model({kind}).opt.timestep / 4, factor=4)",
                      "mm.noise.BrownianPath(1, 4 * model({kind}).opt.timestep, level=2)"],
    "Langevin.step.data": ["data({kind})", "tossed({kind})"],
    "Langevin.forces.data": ["data({kind})", "tossed({kind})"],
    "Langevin.largest_timestep.data": ["data({kind})", "tossed({kind})"],
    "JointNoise.force.data": ["data({kind})", "tossed({kind})"],
    "Langevin.sample.initial": ["data({kind})", "tossed({kind})"],
    "Langevin.sample.duration": ["0.02", "0.2"],
    "Langevin.rollout.data": ["[data({kind})]", "[data({kind}), tossed({kind})]"],
    "Langevin.rollout.initial_state": ["states_of({kind})"],
    "Langevin.rollout.control": ["controls({kind})"],
    "Langevin.rollout.control_spec": ["CONTROLS"],
    **{f"{name}.shape": ["'cuboid'", "'cylinder'", "'ring'", "'sphere'"]
       for name in ("magnet", "Magnet")},
    **{f"{name}.size": ["0.01", "(0.01, 0.004)", "(0.004, 0.01, 0.005)"]
       for name in ("magnet", "Magnet")},
    "magnet.remanence": ["None", "1.2"], "magnet.grade": ["None", "'N42'"],
    "magnet.direction": ["(0, 0, 1)", "[1.0, 2.0, 0.0]"], "Magnet.direction": ["(0, 3, 4)"],
    "magnet.density": ["None", "7000"],
    **{f"add_{name}.spec": ["draft()"]
       for name in ("dipole", "magnet", "coil", "field", "iron", "conductor", "hysteresis")},
    **{f"add_{name}.body": ["drafted().worldbody", "drafted().body('hand')",
                            "drafted().frame('palm')"] for name in ("dipole", "magnet")},
    "add_dipole.moment": ["0.5", "-2"], "add_magnet.gap": ["0.01", "0.02"],
    "add_dipole.name": ["''", "'tip'", "'another tip'"], "add_magnet.name": ["''", "'a magnet'"],
    **{f"add_{name}.actuator": ["drafted().actuator('current')"] for name in ("coil", "field")},
    "add_coil.dipoles": ["[drafted().site('tip')]", "[drafted().body('hand')]"],
    "add_coil.name": ["'coil'", "'coil of the hand'"],
    "add_field.field": ["[0, 0, 0.1]", "np.ones(8)",
                        "mm.tabulated_field(np.square, (0, 0, 0), (1, 1, 1), (4, 4, 4))"],
    "add_field.frame": ["None", "drafted().body('hand')", "drafted().site('tip')"],
    "add_field.name": ["''", "'field'", "'field_2'"],
    "add_iron.geoms": ["[drafted().geom('ball')]", "drafted().geoms"],
    "add_iron.name": ["'iron'", "'iron_2'"],
    "add_conductor.geoms": ["[drafted().geom('ball')]"],
    "add_conductor.name": ["'conductor'", "'conductor_2'"],
    "add_hysteresis.sites": ["[drafted().site('tip')]"],
    "add_hysteresis.name": ["'hysteresis'", "'hysteresis_2'"],
    "Magnet.dipoles.gap": ["0.01", "0.02"], "Magnet.mjcf.gap": ["0.01", "0.02"],
    "metropolis.model": ["model({kind})"],
    "metropolis.samples": ["3"], "metropolis.burn_in": ["0", "5"],
    "metropolis.replicas": ["2"],
    "metropolis.potential": ["None", "lambda data: 0.0",
                                         "lambda data: float(data.qpos[0] ** 2)"],
    "metropolis.initial": ["None", "model({kind}).qpos0"],
    "kinetic_temperature.model": ["model({kind})"],
    "kinetic_temperature.run": ["sampled({kind})"],
    "configurational_temperature.model": ["model({kind})"],
    "configurational_temperature.run": ["sampled({kind})"],
    "configurational_temperature.forces":
        ["None", "lambda data: -np.ones(model({kind}).nv)", "lambda data: 0 * data.qvel - 1"],
}  # fmt: skip

# Sources of instances that a constructor alone does not create.
BY_CLASS = {
    "MjModel": [*(f"model({name!r})" for name in ("Top", "Motor", "Disk", "pendulum", "empty",
                "free", "coincident", "slides", "other people's", "two on a chain"))],
    "MjData": ["data('Disk')"],
    "MjvPerturb": ["perturb()", "perturb(0)"],
    "MjvScene": ["mujoco.MjvScene(model('Top'), 100)"],
    "ViscousContact": ["mm.ViscousContact(0.3, 'ball', 'floor', bears_load=False)",
                       "mm.ViscousContact(0.3, 'rim', 'floor')"],
    "Langevin": ["langevin({kind})", "langevin({kind}, friction=1.0)",
                 "langevin({kind}, splitting='o-step-o', friction=1.0)",
                 "langevin({kind}, splitting='o-rk4-o')",
                 "mm.Langevin(model({kind}), temperatures({kind}))", "mm.Langevin(model({kind}))"],
    "JointNoise": ["mm.JointNoise(model({kind}), 0.5)"],
    "Advice": ["mm.Advice(quantity='positions', error=0.01, duration=1.0)"],
    "Magnet": ["mm.magnet('cuboid', (0.01, 0.02, 0.005), grade='N42')",
               "mm.magnet('ring', (0.004, 0.01, 0.005), remanence=1.2, direction=(1, 0, 0))"],
    "MjSpec": ["specification('free')", "specification('slides')"],
    "SmallMotion": ["mm.theory.small_motion({scene})"],
    "BallStates": ["states()"],
    "MotorRun": ["mm.plots.MotorRun('a', run('Motor'))"],
    "Panel": ["panel('Disk')"],
    "LiveSimulation": ["live.live_scene(mm.Disk(), timestep=0.01)",
                       "live.live_scene(mm.Top(), timestep=0.001)",
                       "live.LiveSimulation(model('free'))"],
    "Pace": ["live.Pace(1.0, 0.0)"],
    "Status": ["mm.sweep.status(folder({kind}))"],
    "Range": ["mm.sweep.Range(0.1, 0.2)", "mm.sweep.Range(0.1, 0.2, True)"],
    "Values": ["mm.sweep.Values(('friction',), (0.1, 0.2))"],
    "Samples": ["mm.sweep.Samples({{'friction': (0.1, 0.3)}}, 4)",
                "mm.sweep.Samples({{'friction': (0.1, 0.3)}}, 5, 'latin')"],
    "Sweep": ["plan({kind})"],
    "BrownianPath": ["mm.noise.BrownianPath(1, 0.1)", "mm.noise.BrownianPath(1, 0.1, factor=4)",
                     "mm.noise.BrownianPath(1, 0.1, level=4)"],
    "Executor": ["Here()"],
    "DiskTheory": ["mm.theory.DiskTheory({scene})"],
    "ReducedDisk": ["mm.theory.ReducedDisk({scene})"],
}  # fmt: skip

DAMAGED_MODELS = [
    f"changed({{}}, {name!r}, {value})"
    for name in ("opt.timestep", "body_mass", "dof_damping", "site_user", "body_user", "qpos0",
                 "opt.gravity", "body_inertia", "jnt_user", "opt.integrator")
    for value in ("nan", "inf", "0", "-1", "1e300", "5e-324", "7")
    if not (name == "opt.integrator" and value not in ("0", "7"))
]  # fmt: skip
DAMAGED_TREES = [
    *DAMAGED_MODELS,
    *(
        f"changed({{}}, {name!r}, {value})"
        for name in ("jnt_stiffness", "jnt_stiffnesspoly", "jnt_range", "jnt_solref", "jnt_solimp",
                     "jnt_margin", "jnt_axis", "jnt_pos", "qpos_spring", "dof_armature",
                     "dof_dampingpoly", "dof_frictionloss", "dof_invweight0", "body_pos",
                     "body_quat", "body_ipos", "body_iquat", "body_gravcomp", "geom_size",
                     "geom_pos", "geom_solref", "geom_solimp", "geom_margin", "geom_fluid",
                     "tendon_damping", "tendon_stiffness", "tendon_range", "tendon_lengthspring",
                     "wrap_prm", "eq_data", "eq_solref", "actuator_biasprm", "actuator_gainprm",
                     "actuator_gear", "actuator_ctrlrange", "actuator_forcerange",
                     "actuator_damping", "opt.viscosity", "opt.density", "opt.wind",
                     "opt.tolerance", "stat.extent")
        for value in ("nan", "inf", "0", "-1", "1e300", "5e-324", "7", "1e-9", "1e9")
    ),
    *(f"changed({{}}, {name!r}, {value})"
      for name in ("opt.disableflags", "opt.enableflags", "opt.disableactuator", "opt.iterations",
                   "opt.solver", "opt.jacobian", "opt.cone", "opt.sdf_iterations")
      for value in ("0", "1", "2", "127", "2**22 - 1", "-1")),
]  # fmt: skip
LATER = [
    f"changed({{}}, {name!r}, {value})"
    for name in ("model.opt.timestep", "model.body_mass", "model.dof_damping", "model.qpos0",
                 "model.opt.gravity", "model.body_inertia", "model.opt.viscosity")
    for value in ("nan", "inf", "0", "-1", "1e300", "5e-324")
]  # fmt: skip
DAMAGED_DATA = [
    f"changed({{}}, {name!r}, {value})"
    for name in (
        "qpos",
        "qvel",
        "time",
        "userdata",
        "ctrl",
        "xfrc_applied",
        "qfrc_applied",
        "act",
        "mocap_pos",
        "qacc_warmstart",
    )
    for value in ("nan", "inf", "-1", "1e300", "2.0**53", "0.5")
]
DAMAGED = [
    *(f"Damaged({how!r}, {place})" for how in ("cut", "flip", "drop", "halve")
      for place in (0.01, 0.2, 0.4, 0.6, 0.8, 0.99)),
    *(f"Damaged('replace', {place}, {value})"
      for place in (0.1, 0.2, 0.3, 0.45, 0.6, 0.7, 0.8, 0.95)
      for value in ("np.zeros((50, 8))", "nan", "np.zeros((0, 0, 6))", "np.zeros((1, 3))", "'{}'",
                    "np.int64(2**62)", "np.full((3, 4), nan)", "-1", "np.zeros(3, complex)")),
    *(f"Damaged('fill', {place}, {value})" for place in (0.1, 0.2, 0.3, 0.45, 0.6, 0.7, 0.8, 0.95)
      for value in ("nan", "inf", "1e300", "-1", "2.0**53")),
    *(f"Damaged('done', 0, {value})" for value in ("0", "1", "3", "-1", "2**62", "None", "0.5")),
    "Damaged('empty')", "Damaged('add')", "'.'", "'missing/run.npz'", "full_disk()", "b'x'", "3",
]  # fmt: skip

WRONG_FRICTIONS = [
    *(
        damage.replace("{}", good)
        for damage in ARRAYS
        for good in ("1.0", "np.eye(2)", "np.ones(2)", "np.eye(6)", "np.ones(6)")
    ),
    *("np.diag([1.0, -1.0])", "[[1.0, 2.0], [2.0, 1.0]]", "[[1.0, 0.5], [0.0, 1.0]]"),
    *("np.ones((2, 2))", "np.ones((6, 6))", "np.diag([1e-200, 1.0])", "np.diag([1e30, 1e-30])"),
    *("np.ones((2, 2, 2))", "np.eye(3)", "np.diag([1.0, 0.0])", "[1.0, 0.0]", "[0.0, 0.0]"),
    *("np.eye(2) + 1e-12 * np.triu(np.ones((2, 2)))", "-np.eye(1)", "[[0.3]]", "[-1.0]"),
    *NUMBERS,
]

OTHERS_DATA = [
    *(f"{make}({name!r})" for make in ("data", "tossed") for name in ("pendulum", "arm", "free")),
    "mujoco.MjData(mm.build(mm.Disk()))",
]

HOSTILE = {
    "kT": NUMBERS,
    "Langevin.kT": [
        *NUMBERS,
        *(f"{{{name!r}: {value}}}" for name in ("shoulder", "elbow", "ball", "servo", "rope", "")
          for value in ("1.0", "-1.0", "nan", "'a'", "None", "1e300", "[1.0]", "0")),
        *("{}", "{'nonsense': 1.0}", "{3: 1.0}", "{None: 1.0}", "{'work': 1.0}", "{'kT': 1.0}"),
        *("{'shoulder': 1.0, 'elbow': -1.0}", "{'shoulder': 1.0, 'elbow': nan}"),
        *("{'shoulder': 1.0, 'elbow': 2.0, 'rope': 3.0}", "{'shoulder': 1.0, 'elbow': 0.0}"),
        *("{'arm': 1.0}", "{('shoulder',): 1.0}", "{b'shoulder': 1.0}", "{'\\0': 1.0}"),
        *("{'shoulder\\0': 1.0}", "{'\\udcff': 1.0}", "{'a' * 10**5: 1.0}"),
        *("[('shoulder', 1.0)]", "pd.Series({'shoulder': 1.0})", "xr.Dataset({'shoulder': 1.0})"),
        "{'bead': 1.0, 'other bead': 2.0}",
    ],
    "Langevin.friction": WRONG_FRICTIONS,
    "Langevin.splitting": ["'BAOAB'", "'euler'", "''", "'baoa'", "b'baoab'", "None", "3",
                           "['baoab']", "np.str_('baoab')", "'blanes-moan4'", "'o-step-o '"],
    "Langevin.disable": [
        *(f"[{flag!r}]" for flag in (
            "constraint", "equality", "frictionloss", "limit", "contact", "spring", "damper",
            "gravity", "clampctrl", "warmstart", "filterparent", "actuation", "refsafe", "sensor",
            "midphase", "eulerdamp", "autoreset", "nativeccd", "island", "nonsense", "CONTACT",
            "mjDSBL_CONTACT", "", "passive", "contact\0", "\udcff")),
        *("'contact'", "b'contact'", "[3]", "[None]", "None", "[['contact']]", "{'contact': True}"),
        *("np.array(['contact'])", "iter(['contact'])", "['contact'] * 1000", "('a',) * 10**6"),
        *("['spring', 'damper']", "['spring', 'damper', 'gravity', 'constraint', 'actuation']"),
    ],
    "Langevin.path": [
        "mm.noise.BrownianPath(1, 1.0)", "mm.noise.BrownianPath(1, 0.002, factor=3)", "3", "'x'",
        "mm.noise.BrownianPath(2**53 - 1, 0.002)", "mm.noise.BrownianPath", "{}", "0.002",
        "mm.noise.BrownianPath(1, 0.002 / 2**24, factor=2**24)",
        "mm.noise.BrownianPath(1, 0.002 * 2**31, level=31)",
    ],
    "Langevin.rollout.initial_state": [
        *(damage.replace("{}", f"states_of({name!r})") for damage in ARRAYS for name in TREES),
    ],
    "Langevin.rollout.control_spec": [
        *NUMBERS, *(f"2**{bit}" for bit in range(16)), "ALL_OF_STATE",
    ],
    "metropolis.initial": [
        *(damage.replace("{}", f"model({name!r}).qpos0") for damage in ARRAYS for name in TREES),
        *NUMBERS,
    ],
    "metropolis.potential": [
        *(f"lambda data: {value}" for value in (
            "nan", "inf", "-inf", "1e300", "-1e300", "'a'", "None", "[1.0]", "np.ones(3)", "1j",
            "np.float32(1)", "True", "10**400", "data", "np.ma.masked", "np.array(1.0)",
            "changed(data, 'qpos', nan).qpos[0]", "np.float64(nan)", "Decimal('0.1')")),
        *("3", "'x'", "[]"),
    ],
    "configurational_temperature.forces": [
        *(f"lambda data: {value}" for value in (
            "nan", "1.0", "[]", "None", "'a'", "np.ones(1)", "np.ones(100)", "data.qvel * nan",
            "data.qvel + inf", "data.qvel + 1e300", "data.qvel + 1j", "0 * data.qvel",
            "data.qvel[:, None]", "data.qvel", "data", "np.ma.array(data.qvel + 1, mask=True)",
            "5e-324 + data.qvel", "data.qfrc_bias")),
        *("3", "'x'", "[]"),
    ],
    "executor": ["3", "'x'", "object()", "[]", "print", "Path('.')"],
    "checkpoint": DAMAGED,
    "magnetism.data": [f"({name!r}, {value})" for name in ("qpos", "qvel", "time", "userdata")
                       for value in ("nan", "inf", "-1", "1e300", "2.0**53", "0.5")],
    "ring_script": [f"({first}, mm.Waypoint({second}))"
                    for first in ("mm.Waypoint(0.0, 0.2, 0.1)", "(0.0, 0.2, 0.1)", "None")
                    for second in ("0.0, 0.3, 0.1", "-1.0, 0.3, 0.1", "nan, 0.3, 0.1",
                                   "1.0, nan, 0.1", "1.0, 1e300, 0.1", "5e-324, 0.3, 0.1",
                                   "1.0, 0.3, -1.0", "1e300, 0.3, 0.1", "1.0, 5e-324, 1.0",
                                   "'a', 0.3, 0.1", "1.0, 0.0, 0.0", "1.0, 0.3, 2.0")],
}  # fmt: skip
JSON = str.split("""
None 'nonsense' '' -1 0 nan inf 1e300 10**30 [] {} [[]] [None] ['evil:go'] 'Disk' 'Top' True 0.5
{'a':1} '../x' 2**53 '9'*5000 dropped
""")  # fmt: skip
