"""Errors that compiled code finds; `error_sentences.py` has their sentences.

An error is five words: its number; those of up to two elements, or -1; and the rule that a mesh or
an element of a tuple breaks, and another tuple, or -1. Where something is computed, the first three
do.
"""

from magmotor.numerics.deferred import subroutine

(
    COINCIDENCE, OUTSIDE, BEHIND, UNANSWERED, UNSOLVED, MARK, MOMENT, COUPLING, WRENCH, POTENTIAL,
    PATH, TIME, COIL, FIELD, FIELD_TUPLE, IRON, MATERIAL, COUPLED_IRON, NO_SITE, UNMEASURED,
    TOLERANCE, SIZE, OVERLAP, INDEX, CONSTANT, POLARIZATION, SHAPELESS, COUPLED_MAGNET,
    MAGNETIC_IRON, UNLOADED, POLYHEDRON, CONDUCTOR, CONDUCTIVITY, BELOW, COLD, CIRCUIT,
    HYSTERESIS, LOOP, UNSTORED, IRON_NEARBY, UNSETTLED,
) = range(41)  # fmt: skip
"""Errors; each has up to two elements, see `error_reports.ELEMENTS`, and numbers."""

KINDS = tuple(name.lower() for name in (*globals(),)[-41:])
"""Their names, those defined last, for `DeclarationError`."""

DETAILS, KIND, FORM = 16, 2, 15
"""Number of numbers for the sentence of an error, and the places of the type of an element, and of
the form of the sentence."""

AT_NODE, IN_GRADIENT = 2, 4
"""Forms of an error `OUTSIDE`, which otherwise is outside a grid; 1 is added for iron."""

OF_CONFIG, OF_BOTH = 1, 2
"""Forms of an error `MARK`, which otherwise is of the text."""

AT_SATURATION = 1
"""Form of an error `MOMENT`, of a site with hysteresis."""

INFINITE = 1
"""Form of an error `POLARIZATION`, which otherwise is too large."""

TAKES_ENERGY = 1
"""Form of an error `COLD`, of hysteresis, which otherwise is of a conductor."""

NO_PLUGIN, OLD_BINARY = range(2)
"""Forms of an error `UNSTORED`, which its rule is."""

NOT_CONVEX, NOT_CLOSED, CROWDED = range(3)
"""Forms of an error `POLYHEDRON`, which its rule is."""

IN_STEP, AT_START, THOROUGH = range(3)
"""What a search for errors reads: in the first step of a run, at time 0, also the meshes of
magnets; and if it is thorough, also all nodes of tables of fields."""

WORDS = 5
"""Number of words of an error."""

NO_ERROR = (-1, -1, -1)
"""Stands for the first three of them."""


@subroutine
def set_error(error, number, one, other=-1, rule=-1, further=-1):
    """Write the words of an error."""
    error[0], error[1], error[2], error[3], error[4] = number, one, other, rule, further
