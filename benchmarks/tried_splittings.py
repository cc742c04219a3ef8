"""Splittings that were tried and dropped, as lists of their parts."""

from collections.abc import Iterator
from contextlib import contextmanager
from unittest.mock import patch

from magmotor.numerics import splittings as schemes
from magmotor.numerics.splittings import Scheme, evenly, palindrome


def composed(*weights: float) -> Scheme:
    """Verlet's scheme AKA again and again, for these fractions of the step."""
    fractions = [0.0]
    for weight in weights:
        fractions[-1] += weight / 2
        fractions += [weight, weight / 2]
    return Scheme("AK" * len(weights) + "A", tuple(fractions))


def triple_jump() -> tuple[float, ...]:
    """Forest and Ruth, 1990; Yoshida, 1990."""
    outer = 1 / (2 - 2 ** (1 / 3))
    return outer, 1 - 2 * outer, outer


def quintuple_jump() -> tuple[float, ...]:
    """Suzuki, 1990."""
    outer = 1 / (4 - 4 ** (1 / 3))
    return outer, outer, 1 - 4 * outer, outer, outer


def nystrom(scheme: Scheme) -> Scheme:
    """A palindrome with kicks and drifts exchanged: it begins with a kick."""
    return scheme._replace(parts=scheme.parts.translate(str.maketrans("AK", "KA")))


SPLITTINGS = {
    "kick-drift-kick": evenly("KAK"),
    "obabo": evenly("OBABO"),
    "forest-ruth": composed(*triple_jump()),
    "suzuki": composed(*quintuple_jump()),
    # Omelyan, Mryglod and Folk, 2002
    "pefrl": palindrome(
        0.1786178958448091, 0.7123418310626054, -0.06626458266981849, -0.2123418310626054
    ),
    # Blanes and Moan, 2002, for Nystrom's equations: S6 of fourth order, S11 of sixth
    "nystrom4": nystrom(
        palindrome(
            0.0829844064174052,
            0.245298957184271,
            0.396309801498368,
            0.604872665711080,
            -0.0390563049223486,
            -0.350171622895351,
        )
    ),
    "nystrom6": nystrom(
        palindrome(
            0.0414649985182624,
            0.123229775946271,
            0.198128671918067,
            0.290553797799558,
            -0.0400061921041533,
            -0.127049212625417,
            0.0752539843015807,
            -0.246331761062075,
            -0.0115113874206879,
            0.357208872795928,
            0.23666992478693110,
        )
    ),
}


@contextmanager
def offered() -> Iterator[None]:
    """Within the block `simulate` knows them, as variational/... of rigid bodies."""
    with patch.dict(schemes.RIGID, SPLITTINGS):
        yield
