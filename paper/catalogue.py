"""All figures, in the order of the gallery."""

from paper.disk import ballistic_pendulum, flights, statistics
from paper.disk import device as disk_device
from paper.figure import Figure
from paper.motor import device as motor_device
from paper.motor import series
from paper.prototype import dry_friction, finite_magnets, lift_off
from paper.top import (
    cases,
    field_lines,
    potential_section,
    potential_surface,
    snapshots,
    spin_mechanism,
)
from paper.top import device as top_device

SECTIONS: dict[str, list[Figure]] = {
    "Hamel's top": [
        top_device.FIGURE,
        field_lines.FIGURE,
        potential_section.FIGURE,
        potential_surface.FIGURE,
        *cases.FIGURES,
        snapshots.FIGURE,
        spin_mechanism.FIGURE,
    ],
    "The sliding disk": [
        disk_device.FIGURE,
        ballistic_pendulum.FIGURE,
        flights.FIGURE,
        *statistics.FIGURES,
    ],
    "The fluctuation-driven motor": [motor_device.FIGURE, *series.FIGURES],
    "Questions to a physical prototype": [
        dry_friction.FIGURE,
        lift_off.FIGURE,
        finite_magnets.FIGURE,
    ],
}

FIGURES = {figure.name: figure for section in SECTIONS.values() for figure in section}
