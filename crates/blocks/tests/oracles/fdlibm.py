"""exp, sin and cos as fdlibm publishes them (Sun Microsystems, e_exp.c, k_sin.c, k_cos.c), in the same operations and so
with the same bits. sin and cos are needed from 0 to a quarter of pi only, where nothing is reduced."""

import math
import struct


def high_word(x):
    return struct.unpack("<Q", struct.pack("<d", x))[0] >> 32


def exp(x):
    if x != x:
        return x
    if x > 709.782712893383973096:
        return math.inf
    if x < -745.13321910194110842:
        return 0.0
    high = high_word(x) & 0x7FFFFFFF
    sign = 1 if x < 0.0 else 0
    if high > 0x3FD62E42:
        if high >= 0x3FF0A2B2:
            k = int(1.44269504088896338700e00 * x + (-0.5 if sign else 0.5))
        else:
            k = 1 - sign - sign
        hi = x - k * 6.93147180369123816490e-01
        lo = k * 1.90821492927058770002e-10
        x = hi - lo
    elif high > 0x3E300000:
        k, hi, lo = 0, x, 0.0
    else:
        return 1.0 + x
    z = x * x
    p1, p2, p3 = 1.66666666666666019037e-01, -2.77777777770155933842e-03, 6.61375632143793436117e-05
    p4, p5 = -1.65339022054652515390e-06, 4.13813679705723846039e-08
    c = x - z * (p1 + z * (p2 + z * (p3 + z * (p4 + z * p5))))
    y = 1.0 + (x * c / (2.0 - c) - lo + hi)
    return y if k == 0 else math.ldexp(y, k)


def sin(x):
    """For 0 <= x <= pi / 4."""
    if high_word(x) < 0x3E500000:
        return x
    z = x * x
    w = z * z
    s1, s2, s3 = -1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04
    s4, s5, s6 = 2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10
    r = s2 + z * (s3 + z * s4) + z * w * (s5 + z * s6)
    return x + z * x * (s1 + z * r)


def cos(x):
    """For 0 <= x <= pi / 4."""
    if high_word(x) < 0x3E46A09E:
        return 1.0
    z = x * x
    w = z * z
    c1, c2, c3 = 4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05
    c4, c5, c6 = -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11
    r = z * (c1 + z * (c2 + z * c3)) + w * w * (c4 + z * (c5 + z * c6))
    hz = 0.5 * z
    w = 1.0 - hz
    return w + (((1.0 - w) - hz) + z * r)
