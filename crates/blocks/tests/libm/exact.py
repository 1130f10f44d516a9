#!/usr/bin/env python3
"""Writes exact.txt: 200 arguments of exp, sin and cos as bits, each with the LREAL nearest to the exact result, found
with 60 digits."""

import math
import struct
from decimal import Decimal, getcontext

getcontext().prec = 60


def series(first, x, factor):
    """first + terms that each are the last one times `factor(n)`."""
    total, term, n = Decimal(0), first, 0
    while abs(term) > Decimal(10) ** -70 * max(abs(total), Decimal(10) ** -330):
        total += term
        n += 1
        term *= factor(n, x)
    return total


def sin(x):
    return series(x, x, lambda n, x: -x * x / (2 * n * (2 * n + 1)))


def cos(x):
    return series(Decimal(1), x, lambda n, x: -x * x / (2 * n * (2 * n - 1)))


def main():
    state = 0
    lines = []
    for n in range(200):
        state = (state + 0x9E3779B97F4A7C15) % 2**64
        mixed = state
        mixed = (mixed ^ (mixed >> 30)) * 0xBF58476D1CE4E5B9 % 2**64
        mixed = (mixed ^ (mixed >> 27)) * 0x94D049BB133111EB % 2**64
        unit = ((mixed ^ (mixed >> 31)) >> 11) / 2.0**53
        name = ("exp", "exp", "sin", "cos")[n % 4]
        scale = -math.ldexp(1.0, n // 4 % 20 - 10) if name == "exp" else math.pi / 4
        if name != "exp" and n % 3 == 0:
            scale = math.ldexp(scale, -(n // 4 % 40))
        x = unit * scale
        exact = {"exp": Decimal.exp, "sin": sin, "cos": cos}[name](Decimal(x))
        bits = lambda value: struct.pack(">d", value).hex()
        lines.append(f"{name} {bits(x)} {bits(float(exact))}\n")
    with open(__file__.replace("exact.py", "exact.txt"), "w") as file:
        file.writelines(lines)


if __name__ == "__main__":
    main()
