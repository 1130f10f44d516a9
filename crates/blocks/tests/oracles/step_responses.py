#!/usr/bin/env python3
"""Step responses, computed with 50 digits from the differential equations: no formula of the blocks is used.

A process and a controller are linear systems. Between two samples, and for the continuous loop all the time, their
solution is a matrix exponential, found here by its power series. Prints the lines of step_responses.csv:

    CASE,CYCLE,SAMPLED,CONTINUOUS

SAMPLED is `y` at the cycle when the process has a zero-order hold at its input and the controller computes once a
cycle, by the rules of docs/pid.md; CONTINUOUS is `y` at the same time of the continuous loop. Without a controller,
both are the same.

    python3 crates/blocks/tests/oracles/step_responses.py > crates/blocks/tests/oracles/step_responses.csv
"""

from decimal import Decimal, getcontext

getcontext().prec = 50
ONE, ZERO = Decimal(1), Decimal(0)


def multiply(a, b):
    return [[sum((x * y for x, y in zip(row, column)), ZERO) for column in zip(*b)] for row in a]


def exponential(matrix):
    """e to the power of a matrix: the series for a 2**20th of it, squared 20 times."""
    size = len(matrix)
    small = [[cell / 2**20 for cell in row] for row in matrix]
    result = [[ONE if i == j else ZERO for j in range(size)] for i in range(size)]
    term = result
    for n in range(1, 30):
        term = [[cell / n for cell in row] for row in multiply(term, small)]
        result = [[x + y for x, y in zip(*rows)] for rows in zip(result, term)]
    for _ in range(20):
        result = multiply(result, result)
    return result


class Process:
    """dx/dt = a*x + b*u, y = x[0]."""

    def __init__(self, a, b):
        self.a = [[Decimal(cell) for cell in row] for row in a]
        self.b = [Decimal(cell) for cell in b]


def pt1(gain, time):
    gain, time = Decimal(gain), Decimal(time)
    return Process([[-1 / time]], [gain / time])


def pt2(gain, time, damping):
    gain, time, damping = Decimal(gain), Decimal(time), Decimal(damping)
    return Process([[0, 1], [-1 / time**2, -2 * damping / time]], [0, gain / time**2])


class Controller:
    """In ISA form, with c = 0; `td` 0 is a PI controller."""

    def __init__(self, gain, ti, td=0, n=10, b=1):
        self.gain, self.ti, self.td, self.b = map(Decimal, (gain, ti, td, b))
        self.tf = self.td / n


def sampled(process, controller, h, cycles):
    """`y` in each cycle, after a step of the set-point, or of `u` without a controller, from 0 to 1 in cycle 0."""
    size = len(process.a)
    with_input = [[cell * h for cell in row] + [b * h] for row, b in zip(process.a, process.b)]
    transition = exponential(with_input + [[ZERO] * (size + 1)])
    x, integral, derivative, before = [ZERO] * size, ZERO, ZERO, ZERO
    answer = []
    for _ in range(cycles):
        y = x[0]
        answer.append(y)
        if controller:
            k = controller
            change = -k.gain * k.td * (y - before)
            derivative = (k.tf * derivative + change) / (k.tf + h) if k.td else ZERO
            u = k.gain * (k.b - y) + integral + derivative
            integral += h * k.gain / k.ti * (1 - y)
            before = y
        else:
            u = ONE
        x = [sum((p * s for p, s in zip(row, x + [u])), ZERO) for row in transition[:size]]
    return answer


def continuous(process, controller, h, cycles):
    """The same of the continuous loop: states of the process, integral, filtered y, and a constant 1."""
    size = len(process.a)
    k = controller
    # u as a row of (x, integral, filtered, 1); the derivative is -K*Td/Tf * (y - filtered).
    steep = k.gain * k.td / k.tf if k.td else ZERO
    u = [ZERO] * size + [ONE, steep, k.gain * k.b]
    u[0] = -k.gain - steep
    rows = [
        [cell + b * weight for cell, weight in zip(row + [ZERO] * 3, u)]
        for row, b in zip(process.a, process.b)
    ]
    integral = [ZERO] * (size + 3)
    integral[0], integral[-1] = -k.gain / k.ti, k.gain / k.ti
    filtered = [ZERO] * (size + 3)
    if k.td:
        filtered[0], filtered[size + 1] = 1 / k.tf, -1 / k.tf
    matrix = rows + [integral, filtered, [ZERO] * (size + 3)]
    transition = exponential([[cell * h for cell in row] for row in matrix])
    state = [ZERO] * (size + 2) + [ONE]
    answer = []
    for _ in range(cycles):
        answer.append(state[0])
        state = [sum((p * s for p, s in zip(row, state)), ZERO) for row in transition]
    return answer


# Name, process, controller, period in seconds, cycles, and every how many of them a line.
CASES = [
    ("pt1", pt1("2.5", 1), None, "0.1", 60, 1),
    ("pt2_oscillating", pt2("2.5", 1, "0.2"), None, "0.1", 200, 4),
    ("pt2_critical", pt2("2.5", 1, 1), None, "0.1", 100, 2),
    ("pt2_slow", pt2("2.5", 1, 3), None, "0.1", 300, 6),
    ("pi_pt1", pt1(1, 1), Controller(2, 1), "0.001", 4000, 100),
    ("pi_weighted_pt2", pt2(1, 1, "0.7"), Controller("0.8", "1.2", b="0.5"), "0.001", 12000, 300),
    ("pid_pt2", pt2(1, 1, 1), Controller(4, "1.6", "0.4"), "0.001", 8000, 200),
    ("pid_pt2_oscillating", pt2("0.5", 2, "0.4"), Controller(4, 3, "0.8", b="0.6"), "0.001", 16000, 400),
]

if __name__ == "__main__":
    for name, process, controller, h, cycles, every in CASES:
        h = Decimal(h)
        exact = sampled(process, controller, h, cycles)
        smooth = continuous(process, controller, h, cycles) if controller else exact
        for cycle in range(0, cycles, every):
            print(f"{name},{cycle},{exact[cycle]:.17f},{smooth[cycle]:.17f}")
