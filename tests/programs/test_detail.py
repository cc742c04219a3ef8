"""What parts of a model change: rings of few dipoles, and contacts that are not the paper's."""

import math

import numpy as np
import pytest

import magmotor as mm
from benchmarks.detail import contact, flight, ring

NUMBERS = np.array([12, 16, 20, 24, 28, 32, 36, 40])


def test_a_ring_of_dipoles_ripples_exponentially_little():
    """As the N-th harmonic between two rings does: like sqrt(N) exp(-N eta)."""
    ripples = np.array([np.ptp(ring.along_valley(n)) for n in NUMBERS])
    rate, _ = np.polyfit(NUMBERS, np.log(ripples / np.sqrt(NUMBERS)), 1)
    assert -rate == pytest.approx(ring.decay_rate(), rel=0.01)  # 0.5 %: other powers of N
    assert ripples[2] == pytest.approx(4.855e-7, rel=5e-4, abs=0)  # 2e-5; J, of the paper's twenty


def test_the_field_of_a_ring_converges_as_fast():
    limit = ring.along_valley(ring.CONTINUUM)[0]
    errors = [np.abs(ring.along_valley(n) / limit - 1).max() for n in NUMBERS]
    rate, _ = np.polyfit(NUMBERS, np.log(errors / np.sqrt(NUMBERS)), 1)
    assert -rate == pytest.approx(ring.decay_rate(), rel=0.01)  # 0.5 %
    assert errors[2] == pytest.approx(3.39e-5, rel=0.01)  # 5e-4


@pytest.mark.parametrize(("number", "least", "most"), [(20, 2e-6, 4e-6), (40, 0.0, 4e-10)])
def test_the_spin_without_a_tilt_is_the_ripple(number, least, most):
    run = mm.simulate(
        ring.ring(number), method="variational/baoab", timestep=0.0125, duration=500.0
    )
    largest = float(np.abs(run.momentum_map).max())
    assert least < largest < most  # 3.3e-6, 1.9e-10 kg m^2/s


def slip_time(name, slip):
    found = contact.slip_time(contact.PARTS[name](), slip)
    assert found, "the slip lasts longer than was waited"
    return found


@pytest.mark.parametrize("slip", [0.3, 0.003])
def test_in_the_calibrated_contact_a_slip_decays_by_the_papers_law(slip):
    law = 1 / mm.theory.slip_relaxation_rate(contact.SCENE)
    assert slip_time("ours", slip) == pytest.approx(law, rel=2e-5)  # 1e-5, of the interpolation


@pytest.mark.parametrize("slip", [0.1, 0.001])
def test_in_mujocos_default_contact_a_small_slip_decays_at_the_contacts_own_rate(slip):
    """That is 2 d/(dmax tau), with d = 0.9, dmax = 0.95, tau = 0.02 s; the paper's is 5.25 /s."""
    rate = 1 / slip_time("MuJoCo's defaults", slip)
    assert rate == pytest.approx(2 * 0.9 / (0.95 * 0.02), rel=0.1)  # 89.7, theory 94.7
    assert rate > 16 * mm.theory.slip_relaxation_rate(contact.SCENE)  # 17.1


def test_in_mujocos_default_contact_a_large_slip_decays_by_coulombs_law():
    """So that it lasts the longer, the larger it is."""
    force = 0.01 * contact.SCENE.ball_mass * contact.SCENE.gravity
    for slip in (0.1, 1.0):
        law = (1 - math.exp(-1)) * slip / (contact.MOBILITY * force)
        # 0.6 % and 0.02 %: the last of the slip is regularized.
        assert slip_time("defaults, slide friction 0.01", slip) == pytest.approx(law, rel=0.01)


def test_the_error_of_the_viscous_contact_is_proportional_to_impratio():
    """A slip alone decays rightly at any: what is wrong is friction against accelerations."""
    errors = []
    for impratio in (1e-7, 1e-8):
        model = contact.ours(impratio=impratio)
        with mm.magnetism():
            run = flight.fly(model, contact.SCENE, duration=20.0)
        errors.append(flight.momentum_error(run.momentum, contact.SCENE))
    assert errors[0] == pytest.approx(7.7e-4, rel=0.02)  # of the largest J
    assert errors[0] / errors[1] == pytest.approx(10, rel=0.03)  # 10.1
