"""exp as fdlibm publishes it (Sun Microsystems, e_exp.c), in the same operations and so with the same bits. msun.py has
the sine and the cosine."""

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
