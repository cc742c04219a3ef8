"""The motor at the size of a living cell: against closed forms, and the numbers of the errata."""

import math
from pathlib import Path

import pytest
from scipy import constants

import magmotor as mm
from paper.motor.molecular import molecular_motor, rarefied_drag, rolling_rate

ERRATA = Path(__file__).parents[2] / "docs" / "errata.md"


def test_its_size_follows_from_the_energy_of_its_magnets():
    """The energy mu_0 m^2/(4 pi L^3), with the factor 2 of the paper's pairs of ball and ring."""
    found = molecular_motor(300.0, "N42")
    paper = mm.Motor()
    per_unit = paper.kT / (paper.coupling / paper.inner_radius**3)
    magnetization = 1.30 / (4e-7 * math.pi)
    moment = magnetization * 4 / 3 * math.pi * (paper.ball_radius / paper.inner_radius) ** 3
    length = math.cbrt(constants.k * 300.0 / (per_unit * 1e-7 * moment**2 / 2))
    assert found.inner_radius == pytest.approx(length, rel=1e-14, abs=0)  # 7e-16
    assert found.ball_radius / length == pytest.approx(0.04 / 0.75, rel=1e-14, abs=0)  # 4e-16
    density = found.ball_mass / (4 / 3 * math.pi * found.ball_radius**3)
    assert density == pytest.approx(7500.0, rel=1e-14, abs=0)  # 5e-16
    energy = constants.k * 300.0 / per_unit
    time = math.sqrt(found.ball_mass * length**2 / energy)
    assert found.time == pytest.approx(time, rel=6e-15, abs=0)  # 2e-16


def test_rolling_is_damped_as_its_energy_says():
    """The energy of a rolling ball decays at twice the rate of its velocity."""
    drag, turning, mass, radius, v = 0.3, 0.02, 1.7, 0.4, 2.5
    omega = v / radius
    energy = 0.5 * mass * v**2 + 0.5 * 0.4 * mass * radius**2 * omega**2
    power = drag * v**2 + turning * omega**2
    rate = rolling_rate(drag, turning, mass, radius)
    assert 2 * rate * energy == pytest.approx(power, rel=6e-15, abs=0)  # 2e-16


def test_a_rarefied_gas_drags_as_its_molecules_do():
    """The torque by the flux of momentum, rho c/4 per area; the drag as in Millikan's experiments.

    C. N. Davies (Proc. Phys. Soc. 57, 259, 1945) fits 6 pi eta r/(1 + 1.657 l/r) to them where the
    mean free path l is large; eta is 0.499 rho c l.
    """
    radius, temperature = 1e-7, 300.0
    kT, mass = constants.k * temperature, 28.0 * constants.atomic_mass
    flux = mass / kT * math.sqrt(8 * kT / (math.pi * mass))
    sliding, turning = rarefied_drag(radius, temperature)
    sphere = 8 * math.pi / 3 * radius**2  # integral of the squared sine
    assert turning == pytest.approx(flux / 4 * radius**2 * sphere, rel=6e-15, abs=0)  # 2e-16
    davies = 6 * math.pi * 0.499 * flux * radius**2 / 1.657
    assert sliding == pytest.approx(davies, rel=0.05, abs=0)  # 0.028


def test_it_does_not_work_in_a_cell_nor_at_any_size():
    """Weaker magnets make it larger, and the drag of water worse; the errata have its numbers."""
    found, weaker = molecular_motor(), molecular_motor(grade="C1")
    assert weaker.ball_radius > 3 * found.ball_radius  # 3.4
    assert found.water > 1e5  # 5.5e5
    assert weaker.water > 2 * found.water  # 2.3
    errata = " ".join(ERRATA.read_text(encoding="utf-8").split())
    mantissa, exponent = f"{found.water:.1e}".split("e+")
    for text in (
        f"rings of {1e6 * found.inner_radius:.2f} µm",
        f"a ball of {1e9 * found.ball_radius:.0f} nm",
        f"${mantissa}\\cdot10^{int(exponent)}$ times",
        f"below {found.pressure:.0f} Pa",
        f"{found.adhesion:.0f} $kT$",
    ):
        assert text in errata
