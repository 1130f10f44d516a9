"""expm1, sin and cos as FreeBSD's msun computes them (s_expm1.c, s_sin.c, k_sin.c, k_cos.c, e_rem_pio2.c), to the last bit.

Blocks take these functions from Rust's port of msun; Python's own may differ in the last bit.
"""

import struct
from math import inf, isinf, isnan

LN2_HI, LN2_LO, INVLN2 = 6.93147180369123816490e-01, 1.90821492927058770002e-10, 1.44269504088896338700
Q = (
    -3.33333333333331316428e-02, 1.58730158725481460165e-03, -7.93650757867487942473e-05,
    4.00821782732936239552e-06, -2.01099218183624371326e-07,
)
S = (
    -1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04,
    2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10,
)
C = (
    4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05,
    -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11,
)
PIO2_1, PIO2_1T = 1.57079632673412561417, 6.07710050650619224932e-11
PIO2_2, PIO2_2T = 6.07710050630396597660e-11, 2.02226624879595063154e-21
PIO2_3, PIO2_3T = 2.02226624871116645580e-21, 8.47842766036889956997e-32
INV_PIO2, TO_INT = 6.36619772367581382433e-01, 1.5 / 2.0**-52


def high(x):
    """The high word, without the sign."""
    return struct.unpack("<Q", struct.pack("<d", x))[0] >> 32 & 0x7FFFFFFF


def expm1(x):
    if isnan(x):
        return x
    hx, negative = high(x), x < 0
    if hx >= 0x4043687A:
        if negative:
            return -1.0
        if x > 7.09782712893383973096e02:
            return inf
    c, k = 0.0, 0
    if hx > 0x3FD62E42:
        if hx < 0x3FF0A2B2:
            hi, lo, k = (x + LN2_HI, -LN2_LO, -1) if negative else (x - LN2_HI, LN2_LO, 1)
        else:
            k = int(INVLN2 * x + (-0.5 if negative else 0.5))
            hi, lo = x - float(k) * LN2_HI, float(k) * LN2_LO
        x = hi - lo
        c = (hi - x) - lo
    elif hx < 0x3C900000:
        return x
    half = 0.5 * x
    hxs = x * half
    r1 = 1.0 + hxs * (Q[0] + hxs * (Q[1] + hxs * (Q[2] + hxs * (Q[3] + hxs * Q[4]))))
    t = 3.0 - r1 * half
    e = hxs * ((r1 - t) / (6.0 - x * t))
    if k == 0:
        return x - (x * e - hxs)
    e = x * (e - c) - c
    e -= hxs
    if k == -1:
        return 0.5 * (x - e) - 0.5
    if k == 1:
        return -2.0 * (e - (x + 0.5)) if x < -0.25 else 1.0 + 2.0 * (x - e)
    if k < 0 or k > 56:
        y = x - e + 1.0
        y = y * 2.0 * 2.0**1023 if k == 1024 else y * 2.0**k
        return y - 1.0
    less = 2.0**-k
    return (x - e + (1.0 - less)) * 2.0**k if k < 20 else (x - (e + less) + 1.0) * 2.0**k


def k_sin(x, y, has_tail):
    z = x * x
    w = z * z
    r = S[1] + z * (S[2] + z * S[3]) + z * w * (S[4] + z * S[5])
    v = z * x
    return x - ((z * (0.5 * y - v * r) - y) - v * S[0]) if has_tail else x + v * (S[0] + z * r)


def k_cos(x, y):
    z = x * x
    w = z * z
    r = z * (C[0] + z * (C[1] + z * C[2])) + w * w * (C[3] + z * (C[4] + z * C[5]))
    half = 0.5 * z
    w = 1.0 - half
    return w + (((1.0 - w) - half) + (z * r - x * y))


def medium(x):
    """x less the nearest multiple of pi/2, in two parts, with the number of that multiple."""
    fn = x * INV_PIO2 + TO_INT - TO_INT
    r, w = x - fn * PIO2_1, fn * PIO2_1T
    y0 = r - w
    exponent = high(x) >> 20
    if exponent - (high(y0) >> 20) > 16:
        t, w = r, fn * PIO2_2
        r = t - w
        w = fn * PIO2_2T - ((t - r) - w)
        y0 = r - w
        if exponent - (high(y0) >> 20) > 49:
            t, w = r, fn * PIO2_3
            r = t - w
            w = fn * PIO2_3T - ((t - r) - w)
            y0 = r - w
    return int(fn), y0, (r - y0) - w


def rem_pio2(x):
    """For 0 < x < 2**20 * pi/2."""
    ix = high(x)
    if ix <= 0x401C463B:
        # Near a multiple, digits cancel: the general way.
        near = ix & 0xFFFFF == 0x921FB if ix <= 0x400F6A7A else ix in (0x4012D97C, 0x401921FB)
        if not near:
            n = 1 + (ix > 0x4002D97C) + (ix > 0x400F6A7A) + (ix > 0x4015FDBC)
            z = x - n * PIO2_1
            y0 = z - n * PIO2_1T
            return n, y0, (z - y0) - n * PIO2_1T
    return medium(x)


def sin(x):
    """For 0 <= x < 2**20 * pi/2."""
    assert 0.0 <= x < 1.6e6 or isnan(x) or isinf(x)
    ix = high(x)
    if ix >= 0x7FF00000:
        return x - x
    if ix <= 0x3FE921FB:
        return x if ix < 0x3E500000 else k_sin(x, 0.0, False)
    n, y0, y1 = rem_pio2(x)
    value = k_cos(y0, y1) if n & 1 else k_sin(y0, y1, True)
    return -value if n & 2 else value


def cos(x):
    """For 0 <= x <= pi/4, where nothing is reduced."""
    return 1.0 if high(x) < 0x3E46A09E else k_cos(x, 0.0)
