"""All figures in the order of the gallery, and the list of the paper's figures."""

from paper.disk import ballistic_pendulum, ergodicity, flights, friction, memory, model, statistics
from paper.disk import flight_law as disk_flight_law
from paper.figure import Figure
from paper.motor import (
    ablation,
    flight_law,
    hops,
    level_ring,
    theory_of_transport,
    transport,
    two_temperatures,
    work,
)
from paper.motor import figures as motor_figures
from paper.prototype import (
    builder_motor,
    builder_top,
    dry_friction,
    finite_magnets,
    lift_off,
    shaken_plate,
)
from paper.top import (
    cases,
    effective_potential,
    experiment,
    field_lines,
    snapshots,
    spin_mechanism,
    turning_tilt,
)

SECTIONS: dict[str, list[Figure]] = {
    "Hamel's top": [
        experiment.FIGURE,
        field_lines.FIGURE,
        *effective_potential.FIGURES,
        *cases.FIGURES,
        snapshots.FIGURE,
        spin_mechanism.FIGURE,
        turning_tilt.FIGURE,
    ],
    "The sliding disk": [
        model.FIGURE,
        ballistic_pendulum.FIGURE,
        flights.FIGURE,
        *statistics.FIGURES,
        memory.FIGURE,
        ergodicity.FIGURE,
        disk_flight_law.FIGURE,
        friction.FIGURE,
    ],
    "The fluctuation-driven motor": [level_ring.FIGURE, *motor_figures.FIGURES],
    "The motor's claims, judged by what can fail": [
        transport.FIGURE,
        theory_of_transport.FIGURE,
        ablation.FIGURE,
        hops.FIGURE,
        flight_law.FIGURE,
        work.FIGURE,
        two_temperatures.FIGURE,
    ],
    "Questions to a physical prototype": [
        dry_friction.FIGURE,
        lift_off.FIGURE,
        finite_magnets.FIGURE,
    ],
    "What a builder meets first": [
        builder_top.FIGURE,
        builder_motor.FIGURE,
        shaken_plate.FIGURE,
    ],
}

FIGURES = {figure.name: figure for section in SECTIONS.values() for figure in section}

PAPER_FIGURES = {
    1: "Picture of mechanical system",
    2: "Snapshots of nonconservative tilted simulation",
    3: "Angular-position of magnetic ball (non-uniform temperature)",
    4: "Angular-position of magnetic ball (uniform temperature)",
    5: "Sliding disk",
    6: "Ballistic vs. normal diffusion",
    7: "Ballistic pendulum",
    8: "Sliding disk: mean of the x-displacement",
    9: "Sliding disk: log-log plot of the mean squared displacement",
    10: "Sliding disk: correlation of the x-displacement",
    11: "Sliding disk: mean squared position",
    12: "Sliding disk: “diffusion” of the x-displacement",
    13: "Sliding disk: histogram of the x-displacement",
    14: "Cross-section of potential energy surface",
    15: "Mechanism behind spin",
    16: "Illustration of magnetized rigid ball and ring",
    17: "Illustration of magnetized ring and its magnetic field",
    18: "Surface plot of V_e",
    19: "Conservative axisymmetric",
    20: "Conservative tilted",
    21: "Nonconservative axisymmetric",
    22: "Nonconservative tilted",
    23: "Illustration of magnetized rings and magnetic top",
    24: "Total and inner ring energy (non-uniform temperature)",
    25: "Energy injected and dissipated (non-uniform temperature)",
    26: "xy-position of magnetic ball (non-uniform temperature)",
    27: "xy-position of magnetic ball, planar view (non-uniform temperature)",
    28: "Total and inner ring energy (uniform temperature)",
    29: "Energy injected and dissipated (uniform temperature)",
    30: "xy-position of magnetic ball (uniform temperature)",
    31: "xy-position of magnetic ball, planar view (uniform temperature)",
}
"""The paper's figures in order, named by the first words of their captions."""
