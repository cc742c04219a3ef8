"""Particles in a periodic potential with OpenMM's LangevinMiddleIntegrator.

Units are nm, ps, amu and kJ/mol, in which a mass of 1 has kT = 1 at 1/R kelvin. Each coordinate of
a particle is one replica, since the coordinates are independent.
"""

import numpy as np
import openmm  # pyright: ignore[reportMissingImports]
from langevin_estimates import of_particles
from openmm import unit  # pyright: ignore[reportMissingImports]

GAS_CONSTANT = unit.MOLAR_GAS_CONSTANT_R.value_in_unit(unit.kilojoule_per_mole / unit.kelvin)


def answer(what, depth, friction, kT, timestep, every, records, replicas, lag, settle, seed):
    system, force = openmm.System(), openmm.CustomExternalForce("-a*(cos(x)+cos(y)+cos(z))")
    force.addGlobalParameter("a", depth)
    for particle in range(replicas // 3):
        system.addParticle(1.0)
        force.addParticle(particle)
    system.addForce(force)
    integrator = openmm.LangevinMiddleIntegrator(kT / GAS_CONSTANT, friction, timestep)
    integrator.setRandomNumberSeed(seed)
    platform = openmm.Platform.getPlatformByName("Reference")
    context = openmm.Context(system, integrator, platform)
    context.setPositions(np.zeros((replicas // 3, 3)))
    context.setVelocitiesToTemperature(kT / GAS_CONSTANT, seed)
    integrator.step(settle)
    x = np.empty((records, 3 * (replicas // 3)))
    for record in x:
        integrator.step(every)
        record[:] = context.getState(positions=True).getPositions(asNumpy=True)._value.ravel()
    return of_particles(x.T, every * timestep, lag)
