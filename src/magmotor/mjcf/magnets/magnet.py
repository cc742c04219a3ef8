"""`magnet`: a permanent magnet of a real shape and material, as dipoles and as MJCF."""

import math
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import ArrayLike

from magmotor.common.arguments import checked
from magmotor.common.arrays import Array
from magmotor.common.checks import check_array, check_choice, check_number
from magmotor.common.exceptions import ArgumentError
from magmotor.common.hints import Positive, number, numbers
from magmotor.dipoles import PERMEABILITY_OVER_4PI
from magmotor.mjcf.magnets.dipole_layout import smallest_layout
from magmotor.mjcf.magnets.grades import GRADES, NDFEB
from magmotor.mjcf.magnets.shapes import SIZES, Ball, Body, Geom, Tube, body_of

DRAWN = 0.04
"""Radius at which a site is drawn, in units of the magnet's smallest extent."""

LARGE = 1.0
"""Length in m from which on a size is doubted: sellers give millimeters."""

Error = Annotated[float, number(at_least=1e-6, below=1)]
Units = Annotated[tuple[float, float, float], numbers(3, at_least=1e-30, below=1e30)]

SI = 1.0, 1.0, 1.0
"""Units of length, mass and moment in m, kg and A m^2."""


@dataclass(frozen=True)
class Magnet:
    """A uniformly magnetized permanent magnet, centered at the origin; see `magnet`.

    Parameters
    ----------
    shape : str
        `cuboid`, `cylinder`, `ring` or `sphere`.
    size : tuple of float
        Lengths in m.
    remanence : float
        In T.
    density : float, default 7500
        In kg/m^3.
    direction : tuple of float, default (0.0, 0.0, 1.0)
        Direction of the magnetization, of any length; stored as a unit vector.
    """

    shape: str
    size: tuple[float, ...]
    remanence: float
    density: float = NDFEB
    direction: tuple[float, float, float] = (0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        """Check all fields."""
        check_choice("shape", self.shape, tuple(SIZES))
        names = SIZES[self.shape]
        size = tuple(np.ravel(check_array("size", self.size)).tolist())
        lengths = f"({', '.join(names)})" if len(names) > 1 else f"one {names[0]}"
        sentence = f"must be {lengths} in m, for a {self.shape}"
        if len(size) != len(names):
            raise ArgumentError("size", size, sentence)
        for i, (name, length) in enumerate(zip(names, size, strict=True)):
            check_number(f"size[{i}] ({name})", length, above=0, unit="m")
        if self.shape == "ring" and size[0] >= size[1]:
            raise ArgumentError("size", size, f"{sentence}, the first smaller than the second")
        self._set("size", size)
        for name, unit in (("remanence", "T"), ("density", "kg/m^3")):
            self._set(name, check_number(name, getattr(self, name), above=0, unit=unit))
        vector = check_array("direction", self.direction, 3)
        if not (length := math.hypot(*vector)):
            raise ArgumentError("direction", self.direction, "must not be zero")
        self._set("direction", tuple(float(part / length) for part in vector))

    def _set(self, name: str, value: Any) -> None:
        object.__setattr__(self, name, value)

    @property
    def volume(self) -> float:
        """In m^3."""
        return self._body.volume

    @property
    def mass(self) -> float:
        """In kg."""
        return self.density * self.volume

    @property
    def moment(self) -> float:
        """Magnetic moment B_r V/mu_0, in A m^2."""
        return self.remanence * self.volume / (4 * math.pi * PERMEABILITY_OVER_4PI)

    @property
    def _body(self) -> Body:
        return body_of(self.shape, self.size)

    @checked
    def dipoles(self, error: Error, gap: Positive) -> tuple[Array, Array]:
        """Return the fewest dipoles that represent the magnet as accurately as required.

        The dipoles are points of a quadrature of the magnet's volume, with Gauss points or at even
        distances. All such layouts are tried in the order of their numbers of dipoles. A much finer
        layout judges the field at thousands of points around the magnet, at the gap and beyond, and
        the force between two such magnets, magnetized alike, one above and beside the other. The
        first layout whose errors are all smaller than `error` is the result. A sphere is exactly
        one dipole.

        Parameters
        ----------
        error : float
            Largest relative error, at least 1e-6, of the field and of these forces. Where the field
            is weaker than a tenth of the strongest field at the same distance from the surface, as
            near the axis of a ring, the error is relative to this tenth.
        gap : float
            Smallest distance from the magnet's surface, in m, at which the field must be so
            accurate, and between the surfaces of the two magnets. No gap makes dipoles right at
            contact, and smaller ones make them worse: for magnets that touch, take `error=0.5`
            with 0.3 times the thickness of a flat magnet, or 0.4 times the width of a long one.

        Returns
        -------
        positions : ndarray, shape (N, 3)
            In m, in the magnet's frame.
        moments : ndarray, shape (N, 3)
            In A m^2, all along the direction of the magnetization; their sum is the moment.

        Raises
        ------
        ValueError
            An argument is outside its bounds, or more than 1000 dipoles would be required.

        Examples
        --------
        >>> import magmotor as mm
        >>> disk = mm.magnet("cylinder", (0.01, 0.005), grade="N42")
        >>> [len(disk.dipoles(error=0.01, gap=gap)[0]) for gap in (0.05, 0.01, 0.003)]
        [3, 20, 117]
        """
        body = self._body
        if isinstance(body, Ball):
            points, parts = np.zeros((1, 3)), np.ones(1)
        else:
            points, parts = smallest_layout(body, self.direction, error, gap)
        return points.copy(), self.moment * np.outer(parts, self.direction)

    @checked
    def mjcf(
        self,
        error: Error | None = None,
        gap: Positive | None = None,
        name: str = "",
        *,
        units: Units = SI,
    ) -> str:
        """Return the magnet as MJCF, to be pasted into a `<body>`.

        Parameters
        ----------
        error, gap : float, optional
            Without them, the geom is the magnet: its polarization is its `user`, and forces are
            right in contact, too. With both, dipoles represent the magnet; see `dipoles`.
        name : str
            Name of the geom. The sites, and the boxes of a ring, add a number to it. Without it,
            nothing is named.
        units : tuple of float, default (1.0, 1.0, 1.0)
            Units of length in m, of mass in kg and of moment in A m^2 in which the MJCF is written,
            such as (1e-3, 1e-3, 1e-6) for mm, g and A mm^2. The model's `magnetic_constant` must
            be that of its units; see `magnetism`.

        Returns
        -------
        str
            One line for the geom with size, mass and polarization; or without that, and one for
            each dipole, a site with its moment as `user`. MuJoCo has no hollow cylinder: a ring has
            a hidden geom that touches nothing, with the ring's mass and inertia, and massless boxes
            around the hole. As a magnet, it is a cylinder, and another one with the opposite
            polarization in its place of the hole.

        Raises
        ------
        ValueError
            As for `dipoles`, or only one of `error` and `gap` is given.

        Notes
        -----
        The model must contain `<custom><text name="magmotor" data="magnets"/></custom>`, or
        `dipoles` instead, or the plugin; see `magnetism`. With `MjSpec`, `add_magnet` adds the same
        elements, and these, too.

        Examples
        --------
        >>> import magmotor as mm
        >>> ball = mm.magnet("sphere", 0.01, remanence=1.3)
        >>> print(ball.mjcf())
        <geom type="sphere" size="0.005" mass="0.00392699081699" user="0 0 1.3"/>
        >>> print(ball.mjcf(error=0.01, gap=0.001))
        <geom type="sphere" size="0.005" mass="0.00392699081699"/>
        <site pos="0 0 0" zaxis="0 0 1" size="0.0004" user="0.541666666667"/>
        """
        elements = elements_of(self, error, gap, name, units)
        return "\n".join(_text(tag, attributes) for tag, attributes in elements)


def elements_of(
    magnet: Magnet,
    error: float | None,
    gap: float | None,
    name: str,
    units: tuple[float, float, float],
) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the tag and the attributes of each element of a magnet; see `Magnet.mjcf`.

    Numbers have twelve digits.
    """
    if (error is None) != (gap is None):
        sentence = "both or none of them must be given"
        raise ArgumentError("error and gap", (error, gap), sentence)
    length, mass, moment = units
    body = type(magnet._body)(*(edge / length for edge in magnet._body))
    geoms = [*body.geoms(magnet.mass / mass)]
    if error is None or gap is None:
        of_polarization = mass * length**2 / moment  # since a moment times it is an energy
        polarization = magnet.remanence / of_polarization * np.array(magnet.direction)
        geoms = _magnetized(body, geoms, polarization)
    for k, geom in enumerate(geoms):
        named = {"name": f"{name} {k}" if k else name} if name else {}
        yield "geom", named | {key: _rounded(value) for key, value in geom.items()}
    if error is None or gap is None:
        return
    positions, moments = magnet.dipoles(error, gap)
    drawn = DRAWN * min(body.extents)
    strengths = moments @ magnet.direction / moment
    for k, (position, strength) in enumerate(zip(positions / length, strengths, strict=True)):
        named = {"name": f"{name} {k}"} if name else {}
        site = {"pos": position, "zaxis": magnet.direction, "size": [drawn], "user": [strength]}
        yield "site", named | {key: _rounded(value) for key, value in site.items()}


def _magnetized(body: Body, geoms: list[Geom], polarization: Array) -> list[Geom]:
    """Return the geoms of a body with its polarization.

    A ring is a cylinder less that in its hole. The one that has the ring's inertia is too narrow.
    """
    if not isinstance(body, Tube) or not body.inner:
        return [geoms[0] | {"user": polarization}, *geoms[1:]]
    added = []
    for diameter, sign in ((body.outer, 1.0), (body.inner, -1.0)):
        size = [diameter / 2, body.height / 2]
        own: Geom = {"type": "cylinder", "size": size, "mass": 0.0, "user": sign * polarization}
        added.append(own | {"contype": 0, "conaffinity": 0, "group": 3})
    return geoms + added


@checked
def magnet(
    shape: str,
    size: ArrayLike,
    *,
    remanence: float | None = None,
    grade: str | None = None,
    density: float | None = None,
    direction: tuple[float, float, float] = (0.0, 0.0, 1.0),
) -> Magnet:
    """Return a permanent magnet, described as its sellers do, by shape, size and grade.

    Parameters
    ----------
    shape : str
        `cuboid`, `cylinder`, `ring` (a cylinder with a hole) or `sphere`. The axis of a cylinder or
        ring is z.
    size : float or array_like
        In m: edges (x, y, z) of a cuboid; (diameter, height) of a cylinder; (inner diameter, outer
        diameter, height) of a ring; diameter of a sphere.
    remanence : float, optional
        Remanence B_r in T. Give either this or the grade.
    grade : str, optional
        Material with a typical remanence and density: sintered NdFeB `N35`, `N38`, `N40`, `N42`,
        `N45`, `N48`, `N50`, `N52`; `SmCo18`, `SmCo22` (SmCo5), `SmCo26`, `SmCo28`, `SmCo32`
        (Sm2Co17); ferrite `C1`, `C5`, `C8`; `AlNiCo5`, `AlNiCo8`.
    density : float, optional
        In kg/m^3, instead of the grade's; 7500 kg/m^3, that of NdFeB, without a grade.
    direction : tuple of float
        Direction of the magnetization, of any length; along z by default.

    Returns
    -------
    Magnet
        With `volume`, `mass`, `moment`, `remanence`, `dipoles` and `mjcf`.

    Raises
    ------
    ValueError
        An argument is invalid, or not exactly one of remanence and grade is given.

    Warns
    -----
    UserWarning
        A length is 1 m or more, which may be meant in millimeters.

    Notes
    -----
    The magnetization is uniform and rigid. That is a good model of NdFeB, SmCo and ferrite in
    fields well below their coercivity. AlNiCo has a permeability of 2 to 5, so that a short magnet
    of it is weaker than its remanence says.

    The remanence of a grade is the middle of the range that a manufacturer states (NdFeB: Shanghai
    Magnet; SmCo: Magnet Sales; ferrite: AOMagnet; AlNiCo: TMC). Those of others differ by 1 or 2 %,
    and so do single magnets.

    Examples
    --------
    >>> import magmotor as mm
    >>> disk = mm.magnet("cylinder", (0.01, 0.005), grade="N42")
    >>> print(f"{disk.moment:.3f} A m², {1000 * disk.mass:.2f} g")
    0.406 A m², 2.95 g
    """
    if (remanence is None) == (grade is None):
        sentence = "exactly one of them must be given"
        raise ArgumentError("remanence and grade", (remanence, grade), sentence)
    usual = NDFEB
    if grade is not None:
        check_choice("grade", grade, tuple(GRADES))
        remanence, usual = GRADES[grade]
    lengths = tuple(np.ravel(size).tolist())
    density = usual if density is None else density
    made = Magnet(shape, lengths, remanence or 0.0, density, direction)
    if max(made.size) >= LARGE:
        sentence = f"size = {made.size}: lengths are in meters; are these millimeters?"
        warnings.warn(sentence, stacklevel=4)  # beyond the wrapper that checks arguments
    return made


def _rounded(value: str | int | ArrayLike) -> Any:
    """Return a word or an integer as it is, and twelve digits of each other number."""
    if isinstance(value, str | int):
        return value
    numbers = np.atleast_1d(value)
    tiny = abs(numbers) < 1e-15 * abs(numbers).max()
    digits = [float(f"{part:.12g}") for part in np.where(tiny, 0.0, numbers)]
    return digits if np.ndim(value) else digits[0]


def _text(tag: str, attributes: dict[str, Any]) -> str:
    """Return an element of MJCF."""
    words = [tag]
    for key, value in attributes.items():
        text = value
        if not isinstance(value, str):
            text = " ".join(f"{part:.12g}" for part in np.atleast_1d(value))
        words.append(f"{key}={quoteattr(text)}")
    return f"<{' '.join(words)}/>"
