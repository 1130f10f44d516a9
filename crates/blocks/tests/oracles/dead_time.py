"""DeadTime, by its definition: all samples of the grid are kept."""

import math
from fractions import Fraction

from common import Input, Oracle, Output


class DeadTime(Oracle):
    NAME = "DeadTime"
    INPUTS = [Input("u", "LREAL"), Input("deadTime", "LREAL", 0.0, 0.01, 0.1, 1.0, 3.0)]
    OUTPUTS = [Output("y", "LREAL"), Output("error", "BOOL"), Output("status", "WORD")]

    def __init__(self):
        self.calls = []
        self.last = 0.0
        self.y = 0.0

    def step(self, i, cycle):
        bad = not math.isfinite(i.u)
        u = self.last if bad else i.u
        self.calls.append((cycle.index, u))
        self.last = u
        dead = i.deadTime
        if dead < 0.0:
            status = 0x8203
        elif not math.isfinite(dead):
            status = 0x8F00
        else:
            # Rounded to nanoseconds as LREAL has them, then exactly; a dead time of 584 years and more is limited.
            dead_ns = round(dead * 1e9) if math.isfinite(dead * 1e9) else 2**64
            exact = Fraction(dead_ns, cycle.period_ns)
            nearest = math.floor(exact + Fraction(1, 2))
            status = 0x6002 if exact > 1023 else 0x6003 if exact.denominator > 1 else 0
            self.y = self.at(cycle.index - min(nearest, 1023))
            if bad:
                status = 0x8F00
        return [self.y, status >= 0x8000, status]

    def at(self, index):
        """The sample of a cycle: that of the last call until then."""
        before = [u for called, u in self.calls if called <= index]
        return before[-1] if before else self.calls[0][1]
