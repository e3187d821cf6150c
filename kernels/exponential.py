"""The exponential function, as arithmetic: the mathematical library's is a call, which keeps a CPU's vector units out.

exp(x) = 2^n exp(r) with n = round(x / ln 2) and r = x - n ln 2, |r| <= ln(2) / 2. There the series up to r^7 / 7! is
cut off by 5e-9 of it, a twelfth of single precision's rounding. n ln 2 is taken off in two pieces, the first of which
has so few digits that its products with n are exact (W. J. Cody, W. Waite, Software Manual for the Elementary
Functions, Prentice-Hall 1980, chapter 6). In double precision it is the library's.
"""

import math

import warp as wp

from warp_mpm.kernels.precision import HALF, ONE, REAL, scalar

PER_LN_2 = wp.constant(scalar(1.0 / math.log(2.0)))
LN_2 = wp.constant(scalar(355.0 / 512.0))  # to 9 binary digits; it is more than ln 2
LN_2_REST = wp.constant(scalar(math.log(2.0) - 355.0 / 512.0))
LEAST, MOST = wp.constant(scalar(-126.0)), wp.constant(scalar(127.0))  # exponents of normal numbers
C2, C3, C4, C5, C6, C7 = (wp.constant(scalar(1.0 / math.factorial(n))) for n in range(2, 8))


@wp.func_native("""
    const int bits = (exponent + 127) << 23;
    float power;
    memcpy(&power, &bits, sizeof(power));
    return power;
""")
def power_of_two(exponent: int) -> scalar:
    """2^exponent, from -126 to 127."""
    return 2.0 ** float(exponent)  # this is what Python runs


@wp.func
def exponential(x: scalar) -> scalar:
    """exp(x) for |x| < 87; NaN of what is not a number."""
    if wp.static(REAL != "float"):
        return wp.exp(x)
    else:
        n = wp.clamp(wp.floor(x * PER_LN_2 + HALF), LEAST, MOST)
        r = (x - n * LN_2) - n * LN_2_REST
        series = ONE + r * (ONE + r * (C2 + r * (C3 + r * (C4 + r * (C5 + r * (C6 + r * C7))))))
        return power_of_two(int(n)) * series
