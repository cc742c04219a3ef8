"""The force between near pieces of iron, against series of multipoles: the docs' table."""

import math
from pathlib import Path

import numpy as np
import pytest
from iron_models import free, iron
from scipy.special import comb

MU0, ORDERS = 4e-7 * math.pi, 150
PAGE = Path(__file__).parents[2] / "docs" / "fields_coils_iron.md"


def response(n, chi):
    """The multipole that a sphere adds to a potential r^n P_n, in units of -a^(2n+1)."""
    return n * chi / (n * chi + 2 * n + 1)


def moment_of_two(distance, chi, across):
    """The moment of each of two spheres in a field along their axis, in units of 4 pi a^3 B/mu0.

    The distance is in radii. The potential of each sphere is a series c_n P_n/r^(n+1), n > 0, that
    responds to the other sphere's, which is its mirror image. In a field across the axis, the
    series is c_n P_n^1 cos(phi)/r^(n+1).
    """
    n, k = np.indices((ORDERS, ORDERS)) + 1
    own = response(n, chi)
    coupling = comb(n + k, n) * (k / (n + 1) if across else -1.0)
    matrix = np.eye(ORDERS) + own * coupling * distance ** -(n + k + 1.0)
    return np.linalg.solve(matrix, own[0, 0] * np.eye(ORDERS)[0])[0]


def force_of_two(distance, radius, flux, chi, across):
    """The energy is -m B/2 of each moment m; its derivative is a complex step's."""
    slope = moment_of_two(distance + 1e-30j, chi, across).imag / 1e-30
    return 4 * math.pi * radius**2 / MU0 * flux**2 * slope


def force_on_dipole(distance, radius, moment, chi):
    """The pull of a sphere on a dipole that points at it.

    About the sphere, the dipole's potential is a series -m (n + 1) r^n P_n/(4 pi d^(n+2)). With the
    sphere's response, the energy is -mu0 m H/2 in the field
    H = sum m (n + 1)^2 response_n a^(2n+1)/(4 pi d^(2n+4)), n > 0.
    """
    n = np.arange(1, 400)
    terms = response(n, chi) * (n + 1.0) ** 2 * (2 * n + 4) * distance ** -(2.0 * n + 5)
    return -MU0 * moment**2 / (8 * math.pi * radius**4) * terms.sum()


def rows():
    """The rows of the docs' table: its name, and its cells."""
    lines = PAGE.read_text().split("| d/a |")[1].splitlines()
    cells = [[cell.strip() for cell in line.strip("| ").split("|")] for line in lines[:5]]
    return cells[0], {name: rest for name, *rest in cells[2:]}


def ratio(name, distance, chi):
    """The model's force over the true one."""
    ball, place = free('size="0.01"'), f"0 0 {0.01 * distance}"
    if name.startswith("two"):
        bodies = ball + free('size="0.01"', place, "other")
        across = name.endswith("across the field")
        field = "0.02 0 0" if across else "0 0 0.02"
        _, data = iron(bodies, field, f"{chi}", "piece other")
        return data.xfrc_applied[2, 2] / force_of_two(distance, 0.01, 0.02, chi, across)
    magnet = f'<body pos="{place}"><freejoint/><geom size="0.001"/><site user="2"/></body>'
    _, data = iron(ball + magnet, "0 0 0", f"{chi}")
    return data.xfrc_applied[2, 2] / force_on_dipole(distance, 0.01, 2, chi)


@pytest.mark.parametrize("name", rows()[1])
def test_the_table_of_forces(name):
    distances, table = rows()
    for distance, cell in zip(map(float, distances), table[name], strict=True):
        if name.startswith("two") and distance <= 2:
            assert cell == ""
        else:
            found = ratio(name, distance, 1e14)
            assert cell == f"{found:.2f}"
            assert abs(ratio(name, distance, 1e3) / found - 1) < 0.04  # 0.025


@pytest.mark.parametrize(("spacing", "bound"), [(0.0, 0.1), (0.002, 0.1), (0.0015, 0.06)])
@pytest.mark.parametrize("distance", [2.02, 2.05, 2.1, 2.25])
def test_the_flux_through_a_narrow_gap(distance, spacing, bound):
    """Two spheres, with automatic and finer nodes: errors to 0.049, 0.039 and 0.025."""
    ball = free('size="0.01"')
    bodies = ball + free('size="0.01"', f"0 0 {0.01 * distance}", "other")
    _, data = iron(bodies, "0 0 0.02", f"1e14 0 {spacing}", "piece other")
    truth = force_of_two(distance, 0.01, 0.02, 1e14, False)
    assert data.xfrc_applied[2, 2] == pytest.approx(truth, rel=bound)


def test_more_gaps_than_are_solved_together():
    """Pairs of spheres 1 m apart have a gap each, and attract each other as one pair does."""
    ball, bodies, names = 'size="0.01"', "", []
    for k in range(17):
        bodies += free(ball, f"{k} 0 0", f"low{k}") + free(ball, f"{k} 0 0.0202", f"high{k}")
        names += [f"low{k}", f"high{k}"]
    pulls = iron(bodies, "0 0 0.02", "1e14", " ".join(names))[1].xfrc_applied[1::2, 2]
    truth = force_of_two(2.02, 0.01, 0.02, 1e14, False)
    assert pulls == pytest.approx(-truth, rel=0.1)  # 0.03
    assert pulls == pytest.approx(pulls[0], rel=1e-4)  # 8e-6
