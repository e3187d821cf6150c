"""Jones-Wilkins-Lee, for the products of a detonation.

    p = A (1 - w / (R1 V)) exp(-R1 V) + B (1 - w / (R2 V)) exp(-R2 V) + w E / V,    V = rho0 / rho,

with E the internal energy per unit *initial* volume, E0 before any matter has burnt. The specific energy is
e = E / rho0, so that the last term is w rho e. Codes differ in where they count E from. Here, as in handbooks, E = 0 is
gas that has expanded and cooled for ever, and E0 is the whole chemical energy. Some count from the unburnt state
instead (their energy is E - E0, 0 at rest), and some add p0 / w, so that products at V = 1 without chemical energy have
the pressure p0 of the air: for 1 bar and w = 0.3 that is 3.4e5 J/m3 of some 7e9. Bring their E0 to this one first.

Sound speed, from p = A exp(-R1 V) + B exp(-R2 V) + C / V^(1 + w) on an isentrope, with x = R V for each term:

    rho c^2 = A exp(-x1) (x1 - w (1 + w) / x1) + B exp(-x2) (x2 - w (1 + w) / x2) + w (1 + w) rho e.

Guards. Compressed beyond the maximum of a(rho), V = 0.18 for TNT, the formula would turn over and fall to minus
infinity: from there on a(rho) stays at its maximum. That is an equation of state too, and c^2 is its own and does not
jump. In expanded gas, colder than any isentrope of the explosive, the first two terms of rho c^2 may be negative: they
count as 0 then. Beyond x = 80 the exponentials are below 1e-34, and x stays there: no density gives a NaN.

Reference: E. L. Lee, H. C. Hornig, J. W. Kury, Adiabatic Expansion of High Explosive Detonation Products, UCRL-50422,
Lawrence Radiation Laboratory 1968.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import warp as wp

from warp_mpm.kernels.exponential import exponential
from warp_mpm.kernels.numbers import is_number
from warp_mpm.kernels.precision import ONE, ZERO, scalar

LARGEST_EXPONENT = wp.constant(scalar(80.0))  # exp(-80) = 1.8e-35; exp(-87.3) is the last normal number
SEARCH_RATIO = 0.99  # of volumes in the search for the maximum of a(rho)
SMALLEST_VOLUME = 1e-3  # at which that search ends
BISECTIONS = 60


@wp.struct
class JWLRecord:
    """Device record of a JWL."""

    density: scalar  # rho0 [kg/m3]
    a: scalar  # [Pa]
    b: scalar  # [Pa]
    r1: scalar
    r2: scalar
    omega: scalar
    least_volume: scalar  # V at which a(rho) has its maximum


@wp.func
def relative_volume(jwl: JWLRecord, density: scalar) -> scalar:
    """V = rho0 / rho, not below that of the maximum of a(rho)."""
    return wp.max(jwl.density / density, jwl.least_volume)


@wp.func
def pressure_offset(jwl: JWLRecord, density: scalar) -> scalar:
    """The two exponential terms [Pa]."""
    volume = relative_volume(jwl, density)
    x1 = wp.min(jwl.r1 * volume, LARGEST_EXPONENT)
    x2 = wp.min(jwl.r2 * volume, LARGEST_EXPONENT)
    return jwl.a * (ONE - jwl.omega / x1) * exponential(-x1) + jwl.b * (ONE - jwl.omega / x2) * exponential(-x2)


@wp.func
def pressure_slope(jwl: JWLRecord, density: scalar) -> scalar:
    """dp/de [kg/m3] = w rho."""
    return jwl.omega * density


@wp.func
def sound_speed_squared(jwl: JWLRecord, density: scalar, energy: scalar) -> scalar:
    """c^2 [m2/s2], see above; never negative for an energy of at least 0."""
    volume = relative_volume(jwl, density)
    x1 = wp.min(jwl.r1 * volume, LARGEST_EXPONENT)
    x2 = wp.min(jwl.r2 * volume, LARGEST_EXPONENT)
    both = jwl.omega * (ONE + jwl.omega)
    stiffness = jwl.a * exponential(-x1) * (x1 - both / x1) + jwl.b * exponential(-x2) * (x2 - both / x2)
    return wp.max(stiffness, ZERO) / density + both * energy


@dataclass(frozen=True)
class JWL:
    """The Jones-Wilkins-Lee equation of state; its energy is e = E / rho0, E per unit initial volume.

    Attributes:
        density: of the unburnt explosive, rho0 [kg/m3], to which V refers.
        a: A [Pa].
        b: B [Pa].
        r1: R1.
        r2: R2.
        omega: w.

    Raises:
        ValueError: rho0, R1, R2 or w is not a positive finite number, or A or B not a finite one of at least 0.
    """

    density: float
    a: float
    b: float
    r1: float
    r2: float
    omega: float

    Record = JWLRecord
    pressure_offset = pressure_offset
    pressure_slope = pressure_slope
    sound_speed_squared = sound_speed_squared
    passive_volume = False
    negative_energy = False

    def __post_init__(self) -> None:
        """Check the parameters."""
        for name in ("density", "r1", "r2", "omega"):
            if not (is_number(getattr(self, name)) and getattr(self, name) > 0.0):
                raise ValueError(f"JWL: {name}: expected a positive finite number, got {getattr(self, name)}")
        for name in ("a", "b"):
            if not (is_number(getattr(self, name)) and getattr(self, name) >= 0.0):
                raise ValueError(f"JWL: {name}: expected a finite number of at least 0 Pa, got {getattr(self, name)}")

    def record(self) -> JWLRecord:
        """The device record."""
        record = JWLRecord()
        record.density = self.density
        record.a, record.b = self.a, self.b
        record.r1, record.r2 = self.r1, self.r2
        record.omega = self.omega
        record.least_volume = self._least_volume
        return record

    def _offset_slope(self, volume: float) -> float:
        """rho da/drho [Pa]: sum of A exp(-x) (x - w - w / x)."""
        terms = ((self.a, self.r1 * volume), (self.b, self.r2 * volume))
        return sum(factor * math.exp(-x) * (x - self.omega - self.omega / x) for factor, x in terms)

    @cached_property
    def _least_volume(self) -> float:
        """V below 1 at which a(rho) has its maximum; 0 if it has none there."""
        high = 1.0
        while self._offset_slope(high * SEARCH_RATIO) >= 0.0 or self._offset_slope(high) < 0.0:
            high *= SEARCH_RATIO
            if high < SMALLEST_VOLUME:
                return 0.0
        low = high * SEARCH_RATIO
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self._offset_slope(middle) < 0.0 else (low, middle)
        return high
