"""What was measured of balls of TNT in free air: the highest overpressure before anything reflects the shock.

Distances scale with the cube root of the charge (Hopkinson), Z = R / W^(1/3), and the incident overpressure is

    log10 p = sum over k of c_k U^k,  U = -0.214362789151 + 1.35034249993 log10 Z,

with Z in m/kg^(1/3) and p in kPa, for 0.0531 <= Z <= 40: a fit to measurements and, near the charge, to calculations.

Reference: C. N. Kingery, G. Bulmash, Airblast Parameters from TNT Spherical Air Burst and Hemispherical Surface Burst,
ARBRL-TR-02555, U.S. Army Ballistic Research Laboratory, 1984; metric form as in CONWEP (TM 5-855-1).
"""

import numpy as np

SHORTEST, LONGEST = 0.0531, 40.0  # scaled distances of the fit [m/kg^(1/3)]
ARGUMENT = (-0.214362789151, 1.35034249993)
COEFFICIENTS = (
    2.611368669,
    -1.69012801396,
    0.00804973591951,
    0.336743114941,
    -0.00516226351334,
    -0.0809228619888,
    -0.00478507266747,
    0.00793030472242,
    0.0007684469735,
)
KILOPASCAL = 1e3  # [Pa]


def incident_overpressure(distance: np.ndarray, mass: float) -> np.ndarray:
    """Highest overpressure (n,) [Pa] at distances (n,) [m] from the center of a ball of TNT of a mass [kg].

    Raises:
        ValueError: a scaled distance is outside the fit.
    """
    scaled = np.asarray(distance, dtype=float) / mass ** (1 / 3)
    if np.any((scaled < SHORTEST) | (scaled > LONGEST)):
        raise ValueError(f"scaled distance: expected from {SHORTEST} to {LONGEST} m/kg^(1/3), got {scaled}")
    argument = ARGUMENT[0] + ARGUMENT[1] * np.log10(scaled)
    return KILOPASCAL * 10.0 ** np.polynomial.polynomial.polyval(argument, COEFFICIENTS)
