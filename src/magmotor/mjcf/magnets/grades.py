"""Remanence and density of the materials of permanent magnets.

A remanence is the middle of the range that a manufacturer states at 20 °C: NdFeB by Shanghai Magnet
(en.shanghaimagnet.com), ferrite by AOMagnet (aomagnet.com), AlNiCo by TMC (tmcmagnetics.com); for
SmCo, one value by Magnet Sales (magnetsales.com). The ranges of other manufacturers differ by 1 or
2 %, and so do magnets of one grade.
"""

from typing import NamedTuple


class Grade(NamedTuple):
    """A material: remanence in T, density in kg/m^3."""

    remanence: float
    density: float


NDFEB = 7500.0
"""Density of sintered NdFeB in kg/m^3."""

GRADES = {
    "N35": Grade(1.195, NDFEB),  # 1.17 to 1.22 T
    "N38": Grade(1.235, NDFEB),  # 1.22 to 1.25 T
    "N40": Grade(1.265, NDFEB),  # 1.25 to 1.28 T
    "N42": Grade(1.30, NDFEB),  # 1.28 to 1.32 T
    "N45": Grade(1.345, NDFEB),  # 1.32 to 1.37 T
    "N48": Grade(1.395, NDFEB),  # 1.37 to 1.42 T
    "N50": Grade(1.415, NDFEB),  # 1.39 to 1.44 T
    "N52": Grade(1.44, NDFEB),  # 1.42 to 1.46 T
    "SmCo18": Grade(0.86, 8300.0),  # SmCo5
    "SmCo22": Grade(0.985, 8300.0),  # SmCo5
    "SmCo26": Grade(1.05, 8300.0),  # Sm2Co17
    "SmCo28": Grade(1.07, 8300.0),  # Sm2Co17
    "SmCo32": Grade(1.16, 8300.0),  # Sm2Co17
    "C1": Grade(0.209, 4900.0),  # ferrite, 0.200 to 0.218 T
    "C5": Grade(0.3825, 4900.0),  # ferrite, 0.380 to 0.385 T
    "C8": Grade(0.3875, 4900.0),  # ferrite, 0.385 to 0.390 T
    "AlNiCo5": Grade(1.275, 7300.0),  # 1.25 to 1.30 T
    "AlNiCo8": Grade(0.865, 7300.0),  # 0.83 to 0.90 T
}
