"""Pull of disks and a pot on steel that saturates, by axisymmetric finite elements.

It shares no code with the package, and judges the last rows of `pull.py`. There are no currents, so
that H = -grad u everywhere. The potential u minimizes the integral of the coenergy int B dH: with
B = mu0 H in air, mu0 H times the recoil permeability plus J in magnets, and mu0 (H + M) in steel,
where M = chi H/sqrt(1 + (chi H/Ms)^2). The force is that of Maxwell's stress in the air, weighted
with the gradient of a function that falls from 1 on what is pulled to 0 on the steel. With half the
size of elements, the forces change by 1e-4 or, of the pot, by 6e-4; with other orders and twice the
air, by 1e-4.

`python benchmarks/accuracy/pull.py --elements` prints its forces where NGSolve 6.2 is installed.
"""
# pyright: reportMissingImports=false

import math

from netgen.occ import Axes, Glue, MoveTo, OCCGeometry, WorkPlane, X, Z
from ngsolve import (
    H1,
    VOL,
    BilinearForm,
    BitArray,
    GridFunction,
    InnerProduct,
    Integrate,
    Mesh,
    SymbolicEnergy,
    dx,
    grad,
    sqrt,
    x,
)

MU0 = 4e-7 * math.pi
SUSCEPTIBILITY, SATURATION = 1000.0, 2.1 / MU0
AIR, ORDER, FINE = 0.3, 3, 2e-4
"""Radius of the air in m, order of the elements, and their size at the magnet in m."""

PAINT, THICK, WIDE = 1e-4, 0.01, 0.03
"""Gap, thickness of thick steel, and radius of all steel, in m."""

STEPS, SMALLEST = 60, 1e-4
"""Most steps of Newton's method, and the smallest part of one that is taken."""


def rectangle(inner, outer, bottom, top, name, size):
    """Return a part with its radii and heights in m."""
    face = MoveTo(inner, bottom).Rectangle(outer - inner, top - bottom).Face()
    face.faces.name, face.faces.maxh, face.edges.maxh = name, 2 * size, size
    return face


def meshed(parts, reach):
    """Return the mesh of parts in air that is fine within a height and radius."""
    half = MoveTo(0, -AIR).Rectangle(AIR, 2 * AIR).Face()
    air = WorkPlane(Axes((0, 0, 0), n=Z, h=X)).Circle(0, 0, AIR).Face() * half
    near = MoveTo(0, -reach).Rectangle(reach, 2 * reach).Face()
    for part in parts:
        air, near = air - part, near - part
    air.faces.name = near.faces.name = "air"
    near.faces.maxh = 4 * FINE
    geometry = Glue([air - near, near, *parts])
    for edge in geometry.edges:
        if math.hypot(edge.center.x, edge.center.y) > 0.8 * AIR:
            edge.name = "far"
    return Mesh(OCCGeometry(geometry, dim=2).GenerateMesh(maxh=AIR / 8, grading=0.25))


def potential(mesh, remanence, recoil):
    """Return the scalar potential, by Newton's method."""
    space = H1(mesh, order=ORDER, dirichlet="far")
    u = space.TrialFunction()
    square, around = grad(u) * grad(u), 2 * math.pi * x
    vacuum = MU0 * square / 2
    ratio = (SUSCEPTIBILITY / SATURATION) ** 2
    steel = MU0 * SATURATION**2 / SUSCEPTIBILITY * (sqrt(1 + ratio * square) - 1)
    form = BilinearForm(space)
    form += SymbolicEnergy(around * vacuum)
    magnet = (recoil - 1) * vacuum - remanence * grad(u)[1]
    form += SymbolicEnergy(around * magnet, definedon=mesh.Materials("magnet"))
    form += SymbolicEnergy(around * steel, definedon=mesh.Materials("steel|cup"))
    found = GridFunction(space)
    slope, change, old = (found.vec.CreateVector() for _ in range(3))
    for _ in range(STEPS):
        form.Apply(found.vec, slope)
        form.AssembleLinearization(found.vec)
        change.data = form.mat.Inverse(space.FreeDofs(), "sparsecholesky") * slope
        energy, part = form.Energy(found.vec), 1.0
        old.data = found.vec
        found.vec.data = old - change
        while form.Energy(found.vec) > energy + 1e-12 * abs(energy) and part > SMALLEST:
            part /= 2
            found.vec.data = old - part * change
        if abs(InnerProduct(change, slope)) < 1e-12 * abs(energy):
            return found
    raise ArithmeticError("Newton's method did not converge")


def weight_in_air(mesh):
    """Return a harmonic function that is 1 on what is pulled and 0 on the steel and far away."""
    space = H1(mesh, order=1, dirichlet="far")
    found, free = GridFunction(space), BitArray(space.FreeDofs())
    for element in space.Elements(VOL):
        if element.mat != "air":
            for k in element.dofs:
                free[k] = False
                found.vec[k] = float(element.mat != "steel")
    u, v = space.TnT()
    form = BilinearForm(grad(u) * grad(v) * dx).Assemble()
    found.vec.data -= form.mat.Inverse(free, "sparsecholesky") * (form.mat * found.vec)
    return found


def pull(disk, remanence, gap, steel, cup=(), recoil=1.0):
    """Return the force in N on a disk (radius, height), and on a cup of rectangles around it."""
    radius, height = disk
    parts = [rectangle(0, radius, gap, gap + height, "magnet", FINE)]
    parts += [rectangle(a, b, gap + c, gap + d, "cup", 1.5 * FINE) for a, b, c, d in cup]
    parts += [rectangle(0, WIDE, -steel, 0, "steel", 3 * FINE)]
    mesh = meshed(parts, 1.6 * radius)
    field, slope = -grad(potential(mesh, remanence, recoil)), grad(weight_in_air(mesh))
    stress = MU0 * (field[1] * (field * slope) - field * field * slope[1] / 2)
    around = 2 * math.pi * x * stress
    return Integrate(around, mesh, VOL, order=2 * ORDER + 2, definedon=mesh.Materials("air"))


def show() -> None:
    """Print the forces on sheets, on thick steel with the recoil of magnets, and of a pot."""
    small, large, in_pot = (0.005, 0.003), (0.01, 0.005), (0.008, 0.0045)
    flat = 0.0127, 0.003175
    pot = [(0, 0.01, 0.0045, 0.006), (0.0085, 0.01, 0, 0.0045)]
    for disk, steel in (
        (small, 0.001), (small, 0.0005), (large, 0.002), (large, 0.001), (large, 0.0005),
        (flat, 0.0003),
    ):  # fmt: skip
        print(disk, f"on {steel} m: {pull(disk, 1.3, PAINT, steel):.2f} N", flush=True)
    for recoil in (1.0, 1.05):
        force = pull(small, 1.3, PAINT, THICK, recoil=recoil)
        print(small, f"on thick steel, of permeability {recoil}: {force:.2f} N", flush=True)
    for gap in (PAINT, 0.002):
        print(f"a pot, {gap} m away: {pull(in_pot, 1.3, gap, THICK, pot):.2f} N", flush=True)
