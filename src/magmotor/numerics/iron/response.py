"""Linear response of a rigid piece of iron to the magnets around it.

The magnetization M = chi H of a uniform piece has no divergence, so that its charges are all on the
surface. With charges of mu0 M.n in T m^2 on the panels, the energy times mu0 is

    q'(P + G/chi) q/2 + q'phi,

where P is the mutual energy of panels, G the map from flux to potential inside the piece, and phi
the mean on each panel of the potential of the magnets, in T m: mu0 H = -grad phi. The piece takes
the charges at which the energy is stationary, and their sum is zero. phi is interpolated from its
values at a few nodes, as phi = L p. What remains is a matrix for the nodes,

    S = L'(P + G/chi)^-1 L,

with the charges -S p at the nodes and the energy -p'S p/(2 mu0). The force, the sum of charges
times the field at the nodes, is its exact derivative, and so is the opposite one on the magnets.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import cho_factor, cho_solve, cholesky, eigh, solve_triangular
from threadpoolctl import threadpool_limits

from magmotor.common.arrays import Array
from magmotor.numerics.demagnetization import VACUUM_PERMEABILITY, demagnetizing_factors
from magmotor.numerics.iron import meshes
from magmotor.numerics.iron.coulomb import RULE_OF_SEVEN, mutual_energies
from magmotor.numerics.iron.gap_points import gap_points
from magmotor.numerics.iron.interior import neumann_to_dirichlet, neumann_to_dirichlet_of_box
from magmotor.numerics.iron.nodes import (
    RADIUS,
    CapsuleNodes,
    CylinderNodes,
    EllipsoidNodes,
    FlatNodes,
    Nodes,
    RingNodes,
)
from magmotor.numerics.iron.unions import Union

CHUNK = 128
"""Number of panels at a time."""

NODES = 96
"""Number of nodes of a piece, roughly, unless their distance is given."""

CLOSED = 1e-6
"""Gaps narrower than this, over half of the size, are none."""

SPHERE, CAPSULE, ELLIPSOID, CYLINDER, BOX = 2, 3, 4, 5, 6
"""mjGEOM_SPHERE and so on."""


@dataclass(frozen=True)
class Response:
    """A piece of iron: its nodes and the matrix of its response.

    Attributes
    ----------
    points : ndarray, shape (K, 3)
        Nodes on the surface, in m, in the frame of the piece.
    matrix : ndarray, shape (K, K)
        Minus the charges at the nodes, in T m^2, for a potential of 1 T m at one of them.
    modes : ndarray, shape (K, K)
        In m^(1/2): matrix = modes' modes, if the susceptibility is positive. The response of a
        material with the reluctivity nu instead of 1/chi is modes' diag(1/(1 + (nu - 1/chi)
        slopes)) modes, up to what the charges at the nodes do not resolve.
    slopes : ndarray, shape (K,)
        Susceptibilities of the modes: how they fall with the reluctivity.
    volume : float
        In m^3.
    susceptibility : float
    radius : float
        Radius in m of the balls of charge at the nodes, for what is as near as their distance.
    faces : ndarray, shape (F, 13)
        The flat faces; see `nodes.face` and `nodes.with_depths`.
    center : ndarray, shape (3,)
        Where the origin of the piece's frame is, in m, in the frame in which it was described.
    equilibrium : ndarray, shape (K,)
        How a net charge of 1 is distributed, over the nodes, if the potential is uniform.
    capacity : float
        That charge over the potential, in m.
    reluctances : ndarray, shape (K, K)
        Mean potentials around the nodes, in 1/m, of flux that goes into the piece around one of
        them and leaves it as the equilibrium, inside of a material with the reluctivity 1.
    gap_points : ndarray, shape (7, G)
        Points on the surface, area vectors, and nodes; see `gap_points.py`.
    """

    points: Array
    matrix: Array
    modes: Array
    slopes: Array
    volume: float
    susceptibility: float
    radius: float
    faces: Array
    center: Array
    equilibrium: Array
    capacity: float
    reluctances: Array
    gap_points: Array

    @property
    def extent(self) -> float:
        """Radius of a sphere around the nodes, in m."""
        return float(np.linalg.norm(self.points, axis=1).max())

    @property
    def factors(self) -> Array:
        """Demagnetizing factors (3,) along the axes: the mean magnetization is H/(1/chi + N).

        They are those for the moment in a uniform field H.
        """
        moments = np.einsum("ki,kl,li->i", self.points, self.matrix, self.points)
        return self.volume / moments - 1 / self.susceptibility

    def charges(self, potential: Array) -> Array:
        """Return the charges (K,) in T m^2 in a potential (K,) in T m at the nodes."""
        return -self.matrix @ potential

    def energy(self, potential: Array) -> float:
        """Return the energy in J in a potential (K,) in T m at the nodes."""
        return float(potential @ self.charges(potential)) / (2 * VACUUM_PERMEABILITY)

    def wrench(self, charges: Array, field: Array) -> tuple[Array, Array]:
        """Return the force in N and the torque about the piece's center in N m.

        Parameters
        ----------
        charges : ndarray, shape (K,)
            In T m^2.
        field : ndarray, shape (K, 3)
            mu0 H of the magnets at the nodes, in T, in the frame of the piece.
        """
        forces = charges[:, None] * field / VACUUM_PERMEABILITY
        return forces.sum(axis=0), np.cross(self.points, forces).sum(axis=0)


def of_geom(kind: int, size: ArrayLike, susceptibility: float, spacing: float = 0.0) -> Response:
    """Compute the response of a geom of MuJoCo.

    Parameters
    ----------
    kind : int
        mjGEOM_SPHERE, mjGEOM_CAPSULE, mjGEOM_ELLIPSOID, mjGEOM_CYLINDER or mjGEOM_BOX.
    size : array_like, shape (3,)
        As in `geom_size`, in m.
    susceptibility : float
        chi of the material, -1 or more and not 0; infinity for an ideal one.
    spacing : float
        Distance between nodes in m, and largest panel; 0 for one by which there are some
        `NODES` nodes. At a gap of this width to a magnet, the error of the force is some 2 %.
    """
    a, b, c = np.asarray(size, dtype=float)
    if kind == BOX:
        return box([a, b, c], spacing, susceptibility)
    if kind == CYLINDER:
        return cylinder(a, b, spacing, susceptibility)
    if kind == SPHERE:
        b = c = a
    if kind == CAPSULE:
        return capsule(a, b, spacing or _spacing(4 * np.pi * a * (a + b)), susceptibility)
    # Knud Thomsen's formula for the surface is right to 1 %.
    mean = ((a * b) ** 1.6 + (b * c) ** 1.6 + (c * a) ** 1.6) / 3
    area = 4 * np.pi * mean ** (1 / 1.6)
    return ellipsoid([a, b, c], spacing or _spacing(area), susceptibility)


def of_geoms(
    kinds: Array, sizes: Array, centers: Array, susceptibility: float, spacing: float = 0.0
) -> Response:
    """Compute the response of a geom, or of boxes or cylinders along z that are one piece.

    Parameters
    ----------
    kinds : ndarray, shape (N,)
        Types of the geoms.
    sizes, centers : ndarray, shape (N, 3)
        Their sizes as in `geom_size`, along common axes, and their positions, in m.
    susceptibility, spacing : float
        As in `of_geom`.
    """
    if len(kinds) == 1:
        return of_geom(int(kinds[0]), sizes[0], susceptibility, spacing)
    if kinds[0] == BOX:
        return boxes(sizes, centers, susceptibility, spacing)
    return cylinders(sizes[:, 0], sizes[:, 1], centers[:, 2], susceptibility, spacing)


def _spacing(area: float) -> float:
    return math.sqrt(area / NODES)


def box(half_edges: ArrayLike, spacing: float, susceptibility: float) -> Response:
    """Compute the response of a box, whose half edges (3,) are in m; see `of_geom`."""
    return boxes(np.atleast_2d(half_edges), np.zeros((1, 3)), susceptibility, spacing)


def boxes(
    half_edges: Array, centers: Array, susceptibility: float, spacing: float = 0.0
) -> Response:
    """Compute the response of a union of boxes whose edges are parallel.

    Parameters
    ----------
    half_edges, centers : ndarray, shape (N, 3)
        Half of the lengths of the boxes along x, y and z, and their centers, in m.
    susceptibility, spacing : float
        As in `of_geom`. Without a spacing, the number of nodes grows with that of rectangles of
        which the surface consists.
    """
    lower, upper = centers - half_edges, centers + half_edges
    center = (lower.min(axis=0) + upper.max(axis=0)) / 2
    union = Union(lower - center, upper - center, CLOSED * np.max(upper - center))
    rectangles = union.rectangles()
    if not spacing:
        area = sum(math.prod(np.delete(r.upper - r.lower, r.axis)) for r in rectangles)
        spacing = _spacing(6 * area / len(rectangles))
    lines = [meshes.spaced(edges, spacing) for edges in union.edges]
    cells = meshes.cells_between(lines)[union.inside(lines)]
    interior = neumann_to_dirichlet_of_box(lines) if union.is_box else neumann_to_dirichlet(cells)
    nodes = FlatNodes(rectangles, spacing)
    return _response(cells, interior, nodes, susceptibility, spacing, center)


def cylinder(radius: float, half_length: float, spacing: float, susceptibility: float) -> Response:
    """Compute the response of a cylinder along z; see `of_geom`."""
    one, other = np.array([radius]), np.array([half_length])
    return cylinders(one, other, np.zeros(1), susceptibility, spacing)


def cylinders(
    radii: Array, half_lengths: Array, heights: Array, susceptibility: float, spacing: float = 0.0
) -> Response:
    """Compute the response of a union of cylinders along z.

    Parameters
    ----------
    radii, half_lengths, heights : ndarray, shape (N,)
        Radii, half of the lengths, and the heights of the centers, in m.
    susceptibility, spacing : float
        As in `boxes`.
    """
    middle = (np.min(heights - half_lengths) + np.max(heights + half_lengths)) / 2
    none, around = np.zeros(len(radii)), np.full(len(radii), 2 * np.pi)
    lower = np.stack([none, none, heights - middle - half_lengths], axis=1)
    upper = np.stack([radii, around, heights - middle + half_lengths], axis=1)
    union = Union(lower, upper, CLOSED * max(radii.max(), upper[:, 2].max()))
    rectangles = [each for each in union.rectangles() if each.axis != 1 and each.upper[0] > 0]
    if not spacing:
        area = sum(
            np.pi * (r.upper[0] ** 2 - r.lower[0] ** 2)
            + 2 * np.pi * r.upper[0] * (r.upper[2] - r.lower[2])
            for r in rectangles
        )
        spacing = _spacing(3 * area / len(rectangles))
    lines = meshes.cylinder_lines(union.edges[0], union.edges[2], spacing)
    cells = meshes.cells_around(lines)[union.inside(lines)]
    nodes = CylinderNodes(rectangles, spacing)
    interior = neumann_to_dirichlet(cells)
    return _response(cells, interior, nodes, susceptibility, spacing, [0.0, 0.0, middle])


def ellipsoid(semi_axes: ArrayLike, spacing: float, susceptibility: float) -> Response:
    """Compute the response of an ellipsoid, whose semi-axes (3,) are in m; see `of_geom`."""
    cells, nodes = meshes.ellipsoid(semi_axes, spacing), EllipsoidNodes(semi_axes, spacing)
    found = _response(cells, neumann_to_dirichlet(cells), nodes, susceptibility, spacing)
    a, b, c = np.asarray(semi_axes, dtype=float).tolist()
    factors = np.array(demagnetizing_factors(a, b, c))
    return _with_moments(found, found.volume / (1 / susceptibility + factors))


def capsule(radius: float, half_length: float, spacing: float, susceptibility: float) -> Response:
    """Compute the response of a capsule along z; see `of_geom`."""
    cells, nodes = (
        meshes.capsule(radius, half_length, spacing),
        CapsuleNodes(radius, half_length, spacing),
    )
    return _response(cells, neumann_to_dirichlet(cells), nodes, susceptibility, spacing)


def _with_moments(found: Response, moments: Array) -> Response:
    """Return a response that has the given moments in uniform fields along the axes."""
    now = found.points.T @ found.matrix @ found.points
    sign = np.sign(now[0, 0])
    inverse = np.linalg.inv(_root(sign * now))
    wanted = inverse @ np.diag(sign * moments) @ inverse
    change = sign * inverse @ (_root(wanted) - np.eye(3)) @ inverse
    turned = np.eye(len(found.points)) + found.points @ change @ found.points.T @ found.matrix
    matrix = turned.T @ found.matrix @ turned
    return replace(found, matrix=(matrix + matrix.T) / 2, modes=found.modes @ turned)


def _root(matrix: Array) -> Array:
    """Return the square root of a symmetric positive matrix."""
    values, vectors = np.linalg.eigh(matrix)
    return vectors * np.sqrt(values) @ vectors.T


# The threads of BLAS change the bits, and wait for one another where other programs run.
@threadpool_limits.wrap(limits=1, user_api="blas")
def _response(
    cells: Array,
    interior: Array,
    nodes: Nodes,
    susceptibility: float,
    spacing: float,
    center: ArrayLike = (0.0, 0.0, 0.0),
) -> Response:
    """Return the response of a meshed piece.

    Charges of zero sum are those of all panels but the last, which takes the rest. The matrix is
    positive for a positive susceptibility and negative for a negative one: G is above P.
    """
    panels, vectors = meshes.panels(cells)
    inside, mutual = _of_zero_sum(interior), mutual_energies(panels)
    form = _of_zero_sum(mutual) + inside / susceptibility
    means = panel_means(panels, nodes)
    net = cho_solve(cho_factor(mutual, lower=True), np.ones(len(panels)))
    around = np.linalg.norm(vectors, axis=1)[:, None] * means
    around = (around / around.sum(axis=0) - net[:, None] / net.sum())[:-1]
    sign = math.copysign(1.0, susceptibility)
    lower = cholesky(sign * form, lower=True)
    half = solve_triangular(lower, means[:-1] - means[-1], lower=True)
    modes, slopes = np.zeros((half.shape[1],) * 2), np.zeros(half.shape[1])
    if sign > 0:
        modes, slopes = _modes(lower, inside, half)
    found = Response(
        nodes.points, sign * half.T @ half, modes, slopes,
        float(meshes.outward(cells)[2].sum()), susceptibility, RADIUS * spacing,
        nodes.faces, np.asarray(center), net @ means / net.sum(), float(net.sum()),
        around.T @ inside @ around, gap_points(panels, vectors, nodes),
    )  # fmt: skip
    if isinstance(nodes, FlatNodes) and len(nodes.faces) > 6:
        return found  # a union of boxes may be magnetized obliquely
    # The piece is as symmetric about its axes as nodes, in odd numbers on rings, are not.
    moments = np.einsum("ki,kl,li->i", found.points, found.matrix, found.points)
    if isinstance(nodes, RingNodes):
        moments[:2] = moments[:2].mean()
    return _with_moments(found, moments)


def _of_zero_sum(form: Array) -> Array:
    """Return a quadratic form of charges as one of all but the last, which takes the rest."""
    return form[:-1, :-1] - form[:-1, -1:] - form[-1:, :-1] + form[-1, -1]


def _modes(lower: Array, inside: Array, half: Array) -> tuple[Array, Array]:
    """Return modes of the charges that nodes produce, for which both forms are diagonal."""
    left, sizes, right = np.linalg.svd(half, full_matrices=False)
    charges = solve_triangular(lower, left, lower=True, trans=1)
    slopes, turned = eigh(charges.T @ inside @ charges)
    return turned.T @ (sizes[:, None] * right), slopes


def panel_means(panels: Array, nodes: Nodes) -> Array:
    """Return the matrix L (panels, nodes) from values at nodes to means on panels."""
    parts, areas = meshes.triangles(panels)
    rule, weights = RULE_OF_SEVEN
    points = np.einsum("qc,ntci->ntqi", rule, parts).reshape(-1, 3)
    share = areas / areas.sum(axis=1, keepdims=True)
    share = (share[:, :, None] * weights).reshape(len(panels), -1)
    means, each = np.empty((len(panels), len(nodes.points))), share.shape[1]
    for start in range(0, len(panels), CHUNK):
        some = share[start : start + CHUNK]
        values = nodes.interpolation(points[each * start : each * (start + len(some))])
        means[start : start + CHUNK] = np.einsum(
            "nq,nqk->nk", some, values.reshape(*some.shape, -1)
        )
    return means
