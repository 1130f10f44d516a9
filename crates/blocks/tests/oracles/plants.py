"""The plants, from their differential equations and the order of operations that docs/pid.md states."""

from math import inf, isfinite, isinf, isnan, sqrt

from common import Input, Oracle, Output
from msun import expm1, sin

OK, LOW, HIGH, RANGE, TIME, NOT_FINITE = 0, 0x6001, 0x6002, 0x8200, 0x8203, 0x8F00
LONGEST_NS = 2**64 - 1
START = [Input("initialValue", "LREAL", 0.0, 1.5), Input("reset", "BOOL", False)]


def divide(a, b):
    """IEEE division."""
    if b == 0.0:
        return float("nan") if a == 0.0 or isnan(a) else inf * (1 if (a > 0) == (str(b)[0] != "-") else -1)
    return a / b


def elapsed_ns(last, cycle):
    """Time on the grid since the last call, at least a period; a period in the first call."""
    cycles = 1 if last is None else max(cycle.index - last, 1)
    return min(cycles * cycle.period_ns, LONGEST_NS)


def seconds(ns):
    return float(ns) / 1e9


def limits_status(least, most):
    if least > most:
        return RANGE
    if isnan(least) or isnan(most) or least == inf or most == -inf:
        return NOT_FINITE
    return OK


class Plant(Oracle):
    """What the plants share: time, start, and outputs."""

    OUTPUTS = [Output("y", "LREAL"), Output("error", "BOOL"), Output("status", "WORD")]

    def __init__(self):
        self.y, self.last, self.has_begun = 0.0, None, False

    def step(self, i, cycle):
        """It begins with the first call that is no error."""
        starts = not self.has_begun or i.reset
        ns = elapsed_ns(self.last if self.has_begun else None, cycle)
        self.last = cycle.index
        status = self.advance(i, starts, ns)
        self.has_begun = self.has_begun or status < 0x8000
        return [self.y, status >= 0x8000, status]


class PlantPT1(Plant):
    NAME = "PlantPT1"
    INPUTS = [
        Input("u", "LREAL", 1.0, 10.0), Input("gain", "LREAL", 1.0, 2.5),
        Input("timeConstant", "LREAL", 0.0, 0.05, 1.0, 30.0), *START,
    ]

    def advance(self, i, starts, ns):
        time = i.timeConstant
        if time < 0.0:
            return TIME
        if not isfinite(time):
            return NOT_FINITE
        if starts:
            y = i.initialValue
        else:
            share = 1.0 if time == 0.0 else -expm1(-(divide(seconds(ns), time)))
            y = self.y + share * (i.gain * i.u - self.y)
        if not isfinite(y):
            return NOT_FINITE
        self.y = y
        return OK


class PlantPT2(Plant):
    NAME = "PlantPT2"
    INPUTS = [
        Input("u", "LREAL", 1.0, 10.0), Input("gain", "LREAL", 1.0, 2.5),
        Input("timeConstant", "LREAL", 0.0, 0.05, 1.0, 30.0),
        Input("damping", "LREAL", 0.0, 0.2, 0.7, 1.0, 1.0, 1.5), *START,
    ]

    def __init__(self):
        super().__init__()
        self.rate = 0.0

    def advance(self, i, starts, ns):
        time, damping = i.timeConstant, i.damping
        if time < 0.0 or damping < 0.0:
            return TIME
        if not isfinite(time) or not isfinite(damping):
            return NOT_FINITE
        # What cannot be computed is no time for the plant: it goes on as it was.
        if not isfinite(i.initialValue if starts else i.gain * i.u - self.y):
            return NOT_FINITE
        if starts:
            y, rate = i.initialValue, 0.0
        else:
            rise, to_y, to_rate, stays = self.transition(seconds(ns), time, damping)
            way = i.gain * i.u - self.y
            y = self.y + (rise * way + to_y * self.rate)
            rate = to_rate * way + stays * self.rate
        if not isfinite(y) or not isfinite(rate):
            self.rate = 0.0
            return NOT_FINITE
        self.y, self.rate = y, rate
        return OK

    @staticmethod
    def transition(h, time, damping):
        settled = (1.0, 0.0, 0.0, 0.0)
        if time == 0.0:
            return settled
        t = divide(h, time)
        if damping < 1.0:
            if t > 1e6:
                return settled
            w = sqrt((1.0 - damping) * (1.0 + damping))
            fall = expm1(-(damping * t))
            decay = 1.0 + fall
            half = sin(0.5 * (w * t))
            s = decay * sin(w * t) / w
            one_less_cos = 2.0 * (half * half)
            rise = decay * one_less_cos - fall - damping * s
            stays = decay * (1.0 - one_less_cos) - damping * s
        else:
            w = sqrt((damping - 1.0) * (damping + 1.0))
            fast = damping + w
            slow = divide(1.0, fast)
            fall = expm1(-(slow * t))
            decay = 1.0 + fall
            if decay == 0.0:
                return settled
            s = decay * t if w == 0.0 else decay * -expm1(-(2.0 * (w * t))) / (2.0 * w)
            rise = -fall - slow * s
            stays = decay - fast * s
        return rise, time * s, divide(s, time), stays


class PlantIntegrator(Plant):
    NAME = "PlantIntegrator"
    INPUTS = [
        Input("u", "LREAL", 0.5, 2.0), Input("load", "LREAL", 0.0, 1.0), Input("gain", "LREAL", 0.1, 1.0),
        Input("yMin", "LREAL", 0.0, -inf), Input("yMax", "LREAL", 2.0, 30.0, inf), *START,
    ]

    def __init__(self):
        super().__init__()
        self.lost = 0.0

    def advance(self, i, starts, ns):
        status = limits_status(i.yMin, i.yMax)
        if status != OK:
            return status
        if starts:
            y, lost = i.initialValue, 0.0
        else:
            rise = i.gain * (i.u - i.load) * seconds(ns)
            rise = rise + self.lost
            y = self.y + rise
            lost = rise - (y - self.y)
        if not isfinite(y) or not isfinite(lost):
            return NOT_FINITE
        if y > i.yMax:
            y, lost, status = i.yMax, 0.0, HIGH
        elif y < i.yMin:
            y, lost, status = i.yMin, 0.0, LOW
        self.y, self.lost = y, lost
        return status
