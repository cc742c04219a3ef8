"""Numbers of the errors that compiled code reports; `sentences.py` has their sentences."""

from magmotor.mjcf.forces.custom import BODY, GEOM, JOINT, NUMERIC, SENSOR, SITE, TUPLE

(
    COINCIDENCE, OUTSIDE, BEHIND, MERGED, UNSOLVED, MARK, MOMENT, COUPLING, WRENCH, POTENTIAL, PATH,
    TIME, COIL, FIELD, FIELD_TUPLE, IRON, MATERIAL, COUPLED_IRON, NO_SITE, UNMEASURED,
    TOLERANCE, SIZE, OVERLAP, INDEX, CONSTANT,
) = range(25)  # fmt: skip
"""Errors; each has up to two elements, and numbers for its sentence."""

DIPOLE, NOTHING = -1, -2
"""Types of elements: sites, or geoms whose number is that of all sites plus their own; and none."""

ELEMENTS = (
    (DIPOLE, DIPOLE),
    (DIPOLE, NUMERIC),
    (DIPOLE, BODY),
    (DIPOLE, NOTHING),
    (DIPOLE, NOTHING),
    (NOTHING, NOTHING),
    (SITE, NOTHING),
    (TUPLE, NOTHING),
    (BODY, NOTHING),
    (JOINT, NOTHING),
    (NOTHING, NOTHING),
    (NOTHING, NOTHING),
    (TUPLE, NOTHING),
    (NUMERIC, NOTHING),
    (TUPLE, NOTHING),
    (TUPLE, NOTHING),
    (NUMERIC, NOTHING),
    (GEOM, TUPLE),
    (SENSOR, NOTHING),
    (SENSOR, SITE),
    (NUMERIC, NOTHING),
    (GEOM, NOTHING),
    (BODY, BODY),
    (NOTHING, NOTHING),
    (NUMERIC, NOTHING),
)
"""The types of the two elements of each error."""

DETAILS = 16
"""Largest number of numbers for the sentence of an error."""

NO_ERROR = (-1, -1, -1)
"""Stands for an error, which is its number and those of two elements, or -1."""
