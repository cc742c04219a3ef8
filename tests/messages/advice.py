"""Questions that `mm.advise` cannot answer."""

import math

import mujoco
from advised_models import PENDULUM, TRAP, started

import magmotor as mm


def load(xml: str) -> mujoco.MjModel:
    """Return a model."""
    return mujoco.MjModel.from_xml_string(xml)


def pendulum(angle=1.0) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Return a double pendulum that is let go."""
    return started(PENDULUM, [angle])


TABLE = r"""
# Temperature and noise
>>> trap = load(TRAP)
>>> mm.advise(trap, kT=1.0, duration=5.0)
ArgumentError: kT = 1.0: must be omitted, since the model has noise of its own
>>> mm.advise(load(TRAP.replace('"5"', '"0"')))
ArgumentError: nuserdata of the model = 0: must be at least 5, to follow one Brownian path at all
    timesteps

# Models and data
>>> mm.advise(load(PENDULUM), mujoco.MjData(load(TRAP)))
ArgumentError: data = 'MjData': must belong to the model
>>> static = load("<mujoco><worldbody><geom size='1'/></worldbody></mujoco>")
>>> mm.advise(static, quantity=lambda model, data: data.time)
ArgumentError: nv of the model = 0: must be at least 1: nothing moves without joints

# Quantities
>>> mm.advise(*pendulum(), quantity="speed")
ArgumentError: quantity = 'speed': must be 'positions', 'energy', 'body NAME', 'site NAME', 'joint
    NAME', 'tendon NAME', 'sensor NAME', or a function of a model and its data
>>> mm.advise(*pendulum(), quantity="joint")
ArgumentError: quantity = 'joint': must be 'positions', 'energy', 'body NAME', 'site NAME', 'joint
    NAME', 'tendon NAME', 'sensor NAME', or a function of a model and its data
>>> mm.advise(*pendulum(), quantity="joint tow")
ArgumentError: joint of the quantity = 'tow': must be one of one, two (did you mean 'two'?)
>>> mm.advise(*pendulum(), quantity="sensor x")
ArgumentError: quantity = 'sensor x': the model has no sensor with a name
>>> mm.advise(*pendulum(), quantity=lambda model, data: "fast")
ArgumentError: quantity <lambda> = 'fast': must be finite numbers, at least one
>>> mm.advise(*pendulum(), quantity=lambda model, data: math.nan)
ArgumentError: quantity <lambda> = nan: must be finite numbers, at least one
>>> mm.advise(*pendulum(), quantity=lambda model, data: 1 / 0)
ArgumentError: quantity = '<lambda>': fails: division by zero
>>> sometimes = lambda model, data: data.qpos[: 1 + (data.time > 0.1)]
>>> mm.advise(*pendulum(), quantity=sometimes, budget=5)
ArgumentError: quantity <lambda> = array([...]): must always be the same number
    of values
>>> at_first = lambda model, data: data.qpos[0] if data.time < 0.1 else math.nan
>>> mm.advise(*pendulum(), quantity=at_first, duration=0.24, budget=5)
ArgumentError: quantity = '<lambda>': is not finite along the path
>>> mm.advise(*pendulum(), quantity=lambda model, data: 1.0, duration=0.24, budget=5)
ArgumentError: quantity = '<lambda>': does not change along the path; give a state that moves it,
    or another one

# Numbers
>>> mm.advise(*pendulum(), error=1e-9)
ArgumentError: error = 1e-09: must be at least 1e-08 (a fraction: 0.01 is 1 %)
>>> mm.advise(*pendulum(), error=1.0)
ArgumentError: error = 1.0: must be less than 0.5 (a fraction: 0.01 is 1 %)
>>> mm.advise(*pendulum(), duration=0.2)
ArgumentError: duration = 0.2: must be at least 0.24 s, 48 timesteps of the model
>>> mm.advise(*pendulum(), budget=0.1)
ArgumentError: budget = 0.1: must be at least 1

# Rest
>>> mm.advise(load(PENDULUM))
ArgumentError: quantity = 'positions': does not change along the path: the model is at rest, and
    nothing moves it
>>> mm.advise(*pendulum(1e-17), quantity="joint two")
ArgumentError: quantity = 'joint two': does not change along the path: the model is at rest, and
    nothing moves it
>>> mm.advise(*pendulum(1e-17), quantity="energy")
ArgumentError: quantity = 'energy': does not change along the path: the model is at rest, and
    nothing moves it

# Pictures
>>> mm.Advice(quantity="positions", error=0.01, duration=1.0).draw("advice.png")
ArgumentError: points = (): must be measured before they are drawn
>>> mm.advise(*pendulum(), picture="missing/advice.png")
ArgumentError: picture = 'missing/advice.png': must be in an existing folder
"""
