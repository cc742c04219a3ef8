"""Fields of the scenes."""

import math

import magmotor as mm

DESK = mm.Motor.desk()

TABLE = r"""
# The ball of a top
>>> mm.Top(ball_mass=-1)
ArgumentError: ball_mass = -1: must be greater than 0 kg
>>> mm.Top(ball_mass=math.nan)
ArgumentError: ball_mass = nan: must be a finite number
>>> mm.Top(ball_mass="heavy")
ArgumentError: ball_mass = 'heavy': must be a number
>>> mm.Top(ball_radius=0)
ArgumentError: ball_radius = 0: must be greater than 0 m
>>> mm.Top(ball_inertia=-1e-5)
ArgumentError: ball_inertia = -1e-05: must be greater than 0 kg m^2
>>> mm.Top(ball_axial_inertia=1e-3)
ArgumentError: ball_axial_inertia = 0.001: must be at most twice the moment across the axis,
    5.184e-05 kg m^2
>>> mm.Top(center_of_mass=(0, 0))
ArgumentError: center_of_mass = (0, 0): must be 3 numbers
>>> mm.Top(center_of_mass=(0.02, 0, 0))
ArgumentError: center_of_mass = (0.02, 0.0, 0.0): must be within the ball: its distance, 0.02 m,
    must be less than 0.018 m
>>> mm.Top(products_of_inertia=(3e-5, 0, 0))
ArgumentError: products_of_inertia = (3e-05, 0.0, 0.0): must be smaller: the smallest principal
    moment, -4.08e-06 kg m^2, must be greater than 0 kg m^2
>>> mm.Top(products_of_inertia=(2e-5, 0, 0))
ArgumentError: products_of_inertia = (2e-05, 0.0, 0.0): must be smaller: the largest principal
    moment, 4.592e-05 kg m^2, must be at most the sum of the others, 3.184e-05 kg m^2
>>> mm.Top(products_of_inertia=(0, math.nan, 0))
ArgumentError: products_of_inertia[1] = nan: must be a finite number
>>> mm.Top(position=(0.0,))
ArgumentError: position = (0.0,): must be 2 numbers
>>> mm.Top(position=(0.0, math.nan))
ArgumentError: position[1] = nan: must be a finite number
>>> mm.Top(velocity=3)
ArgumentError: velocity = 3: must be 2 numbers
>>> mm.Top(axis=(0, 0, 0))
ArgumentError: axis = (0.0, 0.0, 0.0): must have a nonzero component
>>> mm.Top(spin=math.nan)
ArgumentError: spin = nan: must be a finite number

# The friction of a top
>>> mm.Top(friction=-0.1)
ArgumentError: friction = -0.1: must be at least 0 kg/s
>>> mm.Top(friction=math.inf)
ArgumentError: friction = inf: must be a finite number
>>> mm.Top(torsional_damping=-1)
ArgumentError: torsional_damping = -1: must be at least 0 N m s
>>> mm.Top(torsional_friction=-1)
ArgumentError: torsional_friction = -1: must be at least 0 m
>>> mm.Top(drag=-1)
ArgumentError: drag = -1: must be at least 0 kg/s
>>> mm.Top(rotational_drag=-1)
ArgumentError: rotational_drag = -1: must be at least 0 N m s
>>> mm.Top(drag=1, surface="plane")
ArgumentError: drag = 1.0: must be zero when surface = 'plane'
>>> mm.Top(coulomb_friction=0.1)
ArgumentError: coulomb_friction = 0.1: must be zero unless surface = 'plane'
>>> mm.Top(surface="plane", coulomb_friction=-1.0)
ArgumentError: coulomb_friction = -1.0: must be at least 0
>>> mm.Top(surface="plane", coulomb_friction=1e-7)
ArgumentError: coulomb_friction = 1e-07: must be at least 1e-05, MuJoCo's minimum, if
    coulomb_friction or torsional_friction or rolling_friction is positive
>>> mm.Top(surface="plane", rolling_friction=1e-4)
ArgumentError: coulomb_friction = 0.0: must be at least 1e-05, MuJoCo's minimum, if
    coulomb_friction or torsional_friction or rolling_friction is positive
>>> mm.Top().in_air(speed=1.0)
ArgumentError: Reynolds number 2 r density speed/viscosity = 2399...: must be less than 1000

# The ring of a top
>>> mm.Top(ring_dipoles=0)
ArgumentError: ring_dipoles = 0: must be at least 1
>>> mm.Top(ring_dipoles=2.5)
ArgumentError: ring_dipoles = 2.5: must be an integer
>>> mm.Top(ring_dipoles=True)
ArgumentError: ring_dipoles = True: must be an integer
>>> mm.Top(ring_radius=0)
ArgumentError: ring_radius = 0: must be greater than 0 m
>>> mm.Top(ring_height=0.03)
ArgumentError: ring_height = 0.03: must be greater than 0.036 m (the ball's top)
>>> mm.Top(coupling=0)
ArgumentError: coupling = 0: must be greater than 0 J m^3
>>> mm.Top(tilt=-0.1)
ArgumentError: tilt = -0.1: must be at least 0 rad
>>> mm.Top(tilt=1.0)
ArgumentError: tilt = 1.0: must be less than 0.6289 rad, where the ring touches the floor
>>> mm.Top(tilt=3.0)
ArgumentError: tilt = 3.0: must be less than 1.5708 rad (3 degrees are 0.05236 rad)
>>> mm.Top(tilt=10)
ArgumentError: tilt = 10: must be less than 1.5708 rad (10 degrees are 0.1745 rad)
>>> mm.Top(tilt=100)
ArgumentError: tilt = 100: must be less than 1.5708 rad
>>> mm.Top(tilt_azimuth=math.inf)
ArgumentError: tilt_azimuth = inf: must be a finite number
>>> mm.Top(ring_script=((0, 0.2),))
ArgumentError: ring_script[0] = (0, 0.2): must be time, height, tilt and optionally an azimuth
>>> mm.Top(ring_script=((0, 0.2, 0, math.inf),))
ArgumentError: ring_script[0].azimuth = inf: must be a finite number
>>> mm.Top(ring_script=((0, 0.01, 0),))
ArgumentError: ring_script[0].height = 0.01: must be greater than 0.036 m
>>> mm.Top(ring_script=((0, 0.2, 0), (0, 0.3, 0)))
ArgumentError: ring_script[1].time = 0: must be greater than 0 s, the time of the waypoint before
>>> mm.Top(ring_script=((0, 0.2, 0), (1, 0.3, 0.7), (2, 0.2, 0.7)))
ArgumentError: tilt = 0.7: must be less than 0.6289 rad, where the ring touches the floor

# Gravity, floor and background field
>>> mm.Top(gravity=-9.81)
ArgumentError: gravity = -9.81: must be at least 0 m/s^2
>>> mm.Top(surface="plan")
ArgumentError: surface = 'plan': must be one of planar, plane (did you mean 'plane'?)
>>> mm.Top(surface="plane", gravity=0.0)
ArgumentError: gravity = 0.0: must be positive when surface = 'plane'
>>> mm.Top(floor_tilt=(0.1,))
ArgumentError: floor_tilt = (0.1,): must be 2 numbers
>>> mm.Top(floor_tilt=(0.6, 0))
ArgumentError: floor_tilt[0] = 0.6: must be less than 0.5 rad (0.6 degrees are 0.01047 rad)
>>> mm.Top(floor_tilt=(0, -0.6))
ArgumentError: floor_tilt[1] = -0.6: must be at least -0.5 rad (-0.6 degrees are -0.01047 rad)
>>> mm.Top(floor_tilt=(0.1, 0), gravity=0)
ArgumentError: gravity = 0.0: must be positive when floor_tilt is not zero
>>> mm.Top(background_field=(0, math.nan, 0))
ArgumentError: background_field[1] = nan: must be a finite number
>>> mm.Motor(gravity=-9.81)
ArgumentError: gravity = -9.81: must be at least 0 m/s^2
>>> mm.Motor(surface="plane", gravity=0.0)
ArgumentError: gravity = 0.0: must be positive when surface = 'plane'
>>> mm.Motor(floor_tilt=(0.1,))
ArgumentError: floor_tilt = (0.1,): must be 2 numbers
>>> mm.Motor(background_field=(1e-5, 0, 0), inner_dipoles=1)
ArgumentError: background_field = (1e-05, 0.0, 0.0): must be zero with one inner dipole, whose
    torque in it is not modeled

# Runs of the paper
>>> mm.Top.paper(5)
ArgumentError: case = 5: must be at most 4
>>> mm.Top.turning(0)
ArgumentError: seconds = 0: must be greater than 0 s
>>> mm.Top.turning(60.0, position=(0.1, 0.0))
ArgumentError: position = (0.1, 0.0): must not be given: it follows from the tilt
>>> mm.Top.turning(60.0, axis=(0, 0, 1))
ArgumentError: axis = (0, 0, 1): must not be given: it follows from the tilt
>>> mm.Top.turning(60.0, ring_script=())
ArgumentError: ring_script = (): must not be given: it follows from the tilt
>>> mm.Motor.paper("nonuniform-a").kT
ArgumentError: temperature = 'nonuniform': must be uniform, or kT is undefined

# The noise and the friction of a motor
>>> mm.Motor(temperature="unifrom")
ArgumentError: temperature = 'unifrom': must be one of uniform, nonuniform (did you mean
    'uniform'?)
>>> mm.Motor(alpha_ball=-1.0)
ArgumentError: alpha_ball = -1.0: must be at least 0 N sqrt(s)
>>> mm.Motor(alpha_ring=math.nan)
ArgumentError: alpha_ring = nan: must be a finite number
>>> mm.Motor(friction_ball=-0.1)
ArgumentError: friction_ball = -0.1: must be at least 0 kg/s
>>> mm.Motor(friction_ball=0.0)
ArgumentError: friction_ball = 0.0: must be positive with alpha_ball at a uniform temperature
>>> mm.Motor(friction_ring=0.0)
ArgumentError: friction_ring = 0.0: must be positive with alpha_ring at a uniform temperature
>>> mm.Motor(friction_ring=0.2)
ArgumentError: friction_ring/alpha_ring^2 = 200000.00...: must be friction_ball/alpha_ball^2 =
    150000 when temperature = 'uniform'
>>> mm.Motor(alpha_ball=2e-3)
ArgumentError: friction_ring/alpha_ring^2 = 150000.0: must be friction_ball/alpha_ball^2 = 37500
    when temperature = 'uniform'
>>> mm.Motor(alpha_ball=0.0)
ArgumentError: friction_ring/alpha_ring^2 = 150000.0: must have alpha_ball > 0 beside it when
    temperature = 'uniform'
>>> mm.Motor(drag=-1)
ArgumentError: drag = -1: must be at least 0 kg/s
>>> mm.Motor(drag_temperature=-1)
ArgumentError: drag_temperature = -1: must be at least 0 J
>>> mm.Motor(rotational_drag=1, surface="plane")
ArgumentError: rotational_drag = 1.0: must be zero when surface = 'plane'

# The ball of a motor
>>> mm.Motor(ball_mass=-1)
ArgumentError: ball_mass = -1: must be greater than 0 kg
>>> mm.Motor(ball_radius=0)
ArgumentError: ball_radius = 0: must be greater than 0 m
>>> mm.Motor(position=0.6)
ArgumentError: position = 0.6: must be 2 numbers
>>> mm.Motor(position=(0.6,))
ArgumentError: position = (0.6,): must be 2 numbers
>>> mm.Motor(velocity=(0.0, math.nan))
ArgumentError: velocity[1] = nan: must be a finite number
>>> mm.Motor(axis=(0, 0, 0))
ArgumentError: axis = (0.0, 0.0, 0.0): must have a nonzero component
>>> mm.Motor(spin=math.inf)
ArgumentError: spin = inf: must be a finite number

# The rings of a motor
>>> mm.Motor(coupling=0)
ArgumentError: coupling = 0: must be greater than 0 J m^3
>>> mm.Motor(ball_ring_factor=0)
ArgumentError: ball_ring_factor = 0: must be greater than 0
>>> mm.Motor(inner_dipoles=2.5)
ArgumentError: inner_dipoles = 2.5: must be an integer
>>> mm.Motor(inner_radius=0)
ArgumentError: inner_radius = 0: must be greater than 0 m
>>> mm.Motor(inner_radius=1.0)
ArgumentError: inner_radius = 1.0: must be less than 0.98 m: otherwise the rings overlap
>>> mm.Motor(outer_radius=0.7)
ArgumentError: inner_radius = 0.75: must be less than 0.7 m: otherwise the rings overlap
>>> mm.Motor(inner_height=0.3)
ArgumentError: inner_height = 0.3: must be greater than 0.336515 m (the ball's top, for a ring
    tilted by 20 degrees)
>>> mm.Motor(inner_mass=0)
ArgumentError: inner_mass = 0: must be greater than 0 kg
>>> mm.Motor(inner_inertia=-1.0)
ArgumentError: inner_inertia = -1.0: must be greater than 0 kg m^2
>>> mm.Motor(inner_axial_inertia=9.0, inner_inertia=2.0)
ArgumentError: inner_axial_inertia = 9.0: must be at most twice the moment across the axis, 4 kg
    m^2
>>> mm.Motor(inner_dipole_angle=math.nan)
ArgumentError: inner_dipole_angle = nan: must be a finite number
>>> mm.Motor(outer_dipoles=0)
ArgumentError: outer_dipoles = 0: must be at least 1
>>> mm.Motor(outer_height=0.08)
ArgumentError: outer_height = 0.08: must be greater than 0.08 m (the ball's top)
>>> mm.Motor(load_torque=math.inf)
ArgumentError: load_torque = inf: must be a finite number
>>> mm.Motor(load_torque=1.0, surface="plane")
ArgumentError: load_torque = 1.0: must be zero when surface = 'plane', which needs MuJoCo, without
    such a force

# A motor for the desk
>>> mm.Motor.desk(inner_radius=0)
ArgumentError: inner_radius = 0: must be greater than 0 m
>>> mm.Motor.desk(magnet_fraction=0)
ArgumentError: magnet_fraction = 0: must be greater than 0
>>> mm.Motor.desk(magnet_fraction=1.1)
ArgumentError: magnet_fraction = 1.1: must be at most 1
>>> mm.Motor.desk(grade="N99")
ArgumentError: grade = 'N99': must be one of N35, N38, N40, N42, N45, N48, N50, N52, SmCo18,
    SmCo22, SmCo26, SmCo28, SmCo32, C1, C5, C8, AlNiCo5, AlNiCo8
>>> mm.Motor.desk(run="uniform")
ArgumentError: run = 'uniform': must be one of nonuniform-a, nonuniform-b, nonuniform-c,
    uniform-a, uniform-b, uniform-c, uniform-d (did you mean 'uniform-d'?)
>>> mm.Motor.desk(ball_mass=-1)
ArgumentError: ball_mass = -1: must be greater than 0 kg
>>> mm.Motor.desk(magnet_fraction=1.0).bill_of_materials("N42")
ArgumentError: moment of each inner magnet = 5.259...: must be at most 3.16 A m^2 with this grade:
    20 magnets weigh 0.763 kg, but the inner ring has 0.458 kg
>>> DESK.bill_of_materials("C5")
ArgumentError: grade = 'C5': must be stronger: its magnet of 24 mm and 35.6 g does not fit into a
    ball of 21.3 mm and 38.1 g
>>> DESK.bill_of_materials("N99")
ArgumentError: grade = 'N99': must be one of N35, N38, N40, N42, N45, N48, N50, N52, SmCo18,
    SmCo22, SmCo26, SmCo28, SmCo32, C1, C5, C8, AlNiCo5, AlNiCo8
>>> shaking = mm.theory.plate_shaking(DESK)
>>> shaking.speed(0)
ArgumentError: hold = 0: must be greater than 0 s
>>> shaking.speed(-1)
ArgumentError: hold = -1: must be greater than 0 s
>>> shaking.speed("a")
ArgumentError: hold = 'a': must be a number
>>> shaking.stroke(0)
ArgumentError: window = 0: must be greater than 0 s
>>> shaking.stroke(-1)
ArgumentError: window = -1: must be greater than 0 s
>>> shaking.stroke("a")
ArgumentError: window = 'a': must be a number
>>> mm.theory.damper_shaking(mm.Motor.desk("nonuniform-a"))
ArgumentError: friction_ring = 0.0: must be positive, or shaking has no effect

# Disks and particles
>>> mm.Disk(sigma=0)
ArgumentError: sigma = 0: must be greater than 0
>>> mm.Disk(friction=-0.1)
ArgumentError: friction = -0.1: must be at least 0
>>> mm.Disk(friction=0.0)
ArgumentError: friction = 0.0: must be positive with noise, or the temperature would be infinite
>>> mm.Disk(noise=math.inf)
ArgumentError: noise = inf: must be a finite number
>>> mm.Disk(friction_ratio=-1)
ArgumentError: friction_ratio = -1: must be at least 0
>>> mm.Disk(potential="symetric")
ArgumentError: potential = 'symetric': must be one of symmetric, asymmetric, flat, cosine (did you
    mean 'symmetric'?)
>>> mm.Disk(potential=1.0)
ArgumentError: potential = 1.0: must be one of symmetric, asymmetric, flat, cosine, or pairs (a_k,
    b_k) of Fourier coefficients
>>> mm.Disk(potential=((1.0,),))
ArgumentError: potential[0] = (1.0,): must be a pair (a_1, b_1) of numbers
>>> mm.Disk(potential=((1.0, math.nan),))
ArgumentError: potential[0].b = nan: must be a finite number
>>> mm.Disk(surface="ice")
ArgumentError: surface = 'ice': must be one of planar, plane
>>> mm.Disk(drag=-1)
ArgumentError: drag = -1: must be at least 0
>>> mm.Disk(drag=0.1, surface="plane")
ArgumentError: drag = 0.1: must be zero when surface = 'plane'
>>> mm.Disk(rotational_drag=math.inf)
ArgumentError: rotational_drag = inf: must be a finite number
>>> mm.Disk(noise=0, drag_temperature=1.0)
ArgumentError: drag_temperature = 1.0: must be zero or None when noise = 0, since all noise is
    then off
>>> mm.Disk(drag_temperature=-1)
ArgumentError: drag_temperature = -1: must be at least 0
>>> mm.Disk(x=math.nan, v=0.5)
ArgumentError: x = nan: must be a finite number
>>> mm.Disk(x=0.5, v=math.nan)
ArgumentError: v = nan: must be a finite number
>>> mm.Disk(theta=math.nan)
ArgumentError: theta = nan: must be a finite number
>>> mm.Disk(omega=math.nan)
ArgumentError: omega = nan: must be a finite number
>>> mm.LangevinParticle(friction=-1)
ArgumentError: friction = -1: must be at least 0
"""
