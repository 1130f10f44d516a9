#!/usr/bin/env python3
"""Exact values of EXP, LN, SIN, ... between which a result lies that is within one unit in the last place.

    python3 crates/blocks/tests/oracles/expressions/functions.py       writes functions.txt beside this file; --check compares

A line is a function, the bits of its inputs, and the bits of the greatest double that is not above the exact value; or
= and the bits of the exact value, if that is a double. Computed from series with 60 digits.
"""

import os
import random
import struct
import sys
from decimal import Decimal, getcontext

getcontext().prec = 70
# Arguments have exponents up to 22, and as many digits go when a period is taken off.
DIGITS = Decimal(10) ** -62


def series(first, ratio):
    """The sum of a series whose term n is the one before times ratio(n)."""
    total, term, n = first, first, 1
    while abs(term) > DIGITS * abs(total) * Decimal("1e-6"):
        term *= ratio(n)
        total += term
        n += 1
    return total


def inverse_tangent(x):
    """Taylor's series, after the argument was halved until it is small."""
    halved = 0
    while abs(x) > Decimal("0.05"):
        x = x / (1 + (1 + x * x).sqrt())
        halved += 1
    total, power, n = x, x, 1
    while x and abs(power) > DIGITS * abs(x) * Decimal("1e-6"):
        power *= -x * x
        n += 2
        total += power / n
    return total * 2**halved


PI = 4 * inverse_tangent(Decimal(1))


def sine(x):
    x = x.remainder_near(2 * PI)
    return series(x, lambda n: -x * x / ((2 * n) * (2 * n + 1))) if x else x


def cosine(x):
    return sine(PI / 2 - x) if abs(x) < 1 else sine_of_sum(x)


def sine_of_sum(x):
    return sine(x + PI / 2)


def inverse_sine(x):
    if abs(x) == 1:
        return PI / 2 * x
    return inverse_tangent(x / ((1 - x) * (1 + x)).sqrt())


def inverse_cosine(x):
    # Near 1 the difference to half of pi would lose digits.
    return 2 * inverse_tangent(((1 - x) / (1 + x)).sqrt()) if x > -1 else PI


def inverse_tangent_2(y, x):
    if x == 0:
        return PI / 2 if y > 0 else -PI / 2
    angle = inverse_tangent(y / x)
    if x > 0:
        return angle
    return angle + PI if y >= 0 else angle - PI


FUNCTIONS = {
    "EXP": lambda x: x.exp(),
    "LN": lambda x: x.ln(),
    "LOG": lambda x: x.log10(),
    "SIN": sine,
    "COS": cosine,
    "TAN": lambda x: sine(x) / cosine(x),
    "ASIN": inverse_sine,
    "ACOS": inverse_cosine,
    "ATAN": inverse_tangent,
    "ATAN2": inverse_tangent_2,
    "EXPT": lambda x, y: (y * x.ln()).exp() if y else Decimal(1),
    "SQRT": lambda x: x.sqrt(),
}


def inputs(name, draw):
    """Some that are special, and some from everywhere."""
    spread = lambda low, high: draw.choice([-1, 1]) * 10 ** draw.uniform(low, high)
    if name == "EXP":
        special = [1.0, -1.0, 0.5, 709.0, -708.0, 1e-9, 0.1, 10.0]
        return [[x] for x in special] + [[draw.uniform(-700, 700)] for _ in range(12)] + [[spread(-8, 0)] for _ in range(12)]
    if name in ("LN", "LOG", "SQRT"):
        special = [2.0, 10.0, 100.0, 1000.0, 0.1, 1e22, 1.0000001, 0.9999999, 1e300, 1e-300, 4.0]
        return [[x] for x in special] + [[abs(spread(-10, 10))] for _ in range(12)] + [[draw.uniform(0.5, 2)] for _ in range(12)]
    if name in ("SIN", "COS", "TAN"):
        special = [1.0, 0.5, 3.141592653589793, 1.5707963267948966, 0.7853981633974483, 100.0, 1e5, 1e10, 1e22, 1e-8]
        return [[x] for x in special] + [[draw.uniform(-10, 10)] for _ in range(16)] + [[spread(-6, 12)] for _ in range(10)]
    if name in ("ASIN", "ACOS"):
        return [[x] for x in (1.0, -1.0, 0.5, -0.5, 0.9999999999, 1e-5)] + [[draw.uniform(-1, 1)] for _ in range(26)]
    if name == "ATAN":
        return [[x] for x in (1.0, -1.0, 0.5, 1e300, 1e-9)] + [[spread(-5, 5)] for _ in range(26)]
    if name == "ATAN2":
        corners = [[0.0, 1.0], [0.0, -1.0], [1.0, 0.0], [-1.0, 0.0], [1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]]
        return corners + [[spread(-3, 3), spread(-3, 3)] for _ in range(26)]
    exact = [[2.0, 10.0], [2.0, -3.0], [10.0, 3.0], [1.5, 4.0], [9.0, 0.5], [7.0, 0.0], [2.0, 0.5], [10.0, 22.0]]
    return exact + [[abs(spread(-3, 3)), draw.uniform(-30, 30)] for _ in range(20)] + [[draw.uniform(0.5, 2), draw.uniform(-300, 300)] for _ in range(10)]


def bits(number):
    return struct.unpack("<Q", struct.pack("<d", number))[0]


def from_bits(word):
    return struct.unpack("<d", struct.pack("<Q", word))[0]


def below(exact):
    """The greatest double that is not above it, and whether it is it."""
    near = float(exact)
    word = bits(near)
    if Decimal(near) > exact:
        word += -1 if near > 0 else 1
    number = Decimal(from_bits(word))
    assert number <= exact
    return word, abs(number - exact) <= abs(exact) * DIGITS


def lines():
    draw = random.Random(754)
    for name, function in FUNCTIONS.items():
        for arguments in inputs(name, draw):
            word, is_exact = below(function(*map(Decimal, arguments)))
            shown = " ".join("%016x" % bits(argument) for argument in arguments)
            yield "%s %s %s%016x" % (name, shown, "=" if is_exact else "", word)


path = os.path.join(os.path.dirname(os.path.abspath(__file__)), "functions.txt")
made = "".join(line + "\n" for line in lines())
if "--check" in sys.argv:
    with open(path, encoding="utf-8") as file:
        sys.exit(0 if file.read() == made else path + " is not what this oracle makes")
with open(path, "w", encoding="utf-8", newline="\n") as file:
    file.write(made)
