"""PID, from the equations of the book and the rules in docs/pid.md."""

from math import inf, isfinite, isnan, sqrt

from common import Input, Oracle, Output
from plants import NOT_FINITE, OK, HIGH, LOW, RANGE, TIME, divide, elapsed_ns, limits_status, seconds

RATE, NEGATIVE_RATE, SENSOR = 0x6004, 0x8202, 0x8F01



def tuning(i):
    """(status, parameters): gain, ki, kd, Tf, Tt, b, c of the parallel form with the sign of the action."""
    sign = -1.0 if i.direct else 1.0
    gain = -i.gain if i.direct else i.gain
    n, tracking = i.N, i.trackingTime
    ti, td = (0.0, 0.0) if i.parallel else (i.integralTime, i.derivativeTime)
    if ti < 0.0 or td < 0.0 or tracking < 0.0 or n <= 0.0:
        return TIME, None
    if i.parallel:
        ki, kd = sign * i.integralGain, sign * i.derivativeGain
        if gain == 0.0 or kd == 0.0:
            kd, tf, tt = 0.0 * kd, 0.0, abs(divide(gain, ki))
        else:
            tf, tt = divide(abs(divide(kd, gain)), n), root(abs(divide(kd, ki)))
    else:
        ki = 0.0 if ti == 0.0 else divide(gain, ti)
        kd, tf = gain * td, divide(td, n)
        tt = ti if td == 0.0 else root(ti * td)
    if ki == 0.0:
        tt = inf
    elif tracking != 0.0:
        tt = tracking
    parameters = (gain, ki, kd, tf, tt, i.b, i.c)
    if isnan(n) or isnan(tracking) or isnan(tt):
        return NOT_FINITE, None
    if not all(isfinite(value) for value in parameters[:4] + parameters[5:]):
        return NOT_FINITE, None
    return OK, parameters


def root(x):
    return x if isnan(x) or x == inf else sqrt(x)


class PID(Oracle):
    NAME = "PID"
    INPUTS = [
        Input("setPoint", "LREAL", 0.0, 10.0, 20.0), Input("processValue", "LREAL", 5.0, 8.0, 12.0),
        Input("manual", "BOOL", False), Input("manualValue", "LREAL", 30.0, 40.0), Input("track", "BOOL", False),
        Input("trackValue", "LREAL", 10.0, 60.0), Input("reset", "BOOL", False), Input("direct", "BOOL", False),
        Input("parallel", "BOOL", False, True), Input("gain", "LREAL", 0.5, 4.0, 4.0),
        Input("integralTime", "LREAL", 0.0, 0.1, 2.0, 20.0), Input("derivativeTime", "LREAL", 0.0, 0.02, 0.5),
        Input("integralGain", "LREAL", 0.0, 0.3, 2.0), Input("derivativeGain", "LREAL", 0.0, 0.1, 1.0),
        Input("N", "LREAL", 5.0, 10.0, inf), Input("b", "LREAL", 1.0, 0.5), Input("c", "LREAL", 0.0, 0.0, 1.0),
        Input("trackingTime", "LREAL", 0.0, 0.0, 0.5, inf), Input("outputMin", "LREAL", 0.0, -100.0, -inf),
        Input("outputMax", "LREAL", 100.0, 60.0, inf), Input("upRate", "LREAL", inf, 20.0),
        Input("downRate", "LREAL", inf, 50.0),
    ]
    OUTPUTS = [
        Output("output", "LREAL"), Output("proportionalPart", "LREAL"), Output("integralPart", "LREAL"),
        Output("derivativePart", "LREAL"), Output("error", "BOOL"), Output("status", "WORD"),
    ]

    def __init__(self):
        self.u = 0.0
        self.p = self.i = self.d = 0.0
        self.tuning = None
        self.slope = self.excess = self.r = self.y = 0.0
        self.mode = self.last = None
        self.can_go_on = False
        self.manual_before, self.holds_manual = 0.0, False

    def derivative(self, tuning, i, h):
        _, _, kd, tf, _, _, c = tuning
        change = c * (i.setPoint - self.r) - (i.processValue - self.y)
        return divide(tf * self.d + kd * change, tf + h)

    @staticmethod
    def proportional(tuning, i):
        return tuning[0] * (tuning[5] * i.setPoint - i.processValue)

    def aligned(self, v, tuning, i, h):
        """Parts that make v: the integral takes what is missing."""
        p = self.proportional(tuning, i)
        d = self.derivative(tuning, i, h) if self.can_go_on else 0.0
        return p, v - (p + d), d

    def law(self, tuning, i, h):
        """v and the parts in automatic mode."""
        if self.last is None or i.reset:
            p = self.proportional(tuning, i)
            return p, (p, 0.0, 0.0)
        old = tuning if self.tuning is None else self.tuning
        if not self.can_go_on and old[1] != 0.0:
            return self.u, self.aligned(self.u, tuning, i, h)
        p = self.proportional(old, i)
        if self.can_go_on:
            back = self.excess * min(divide(h, old[4]), 1.0)
            d, integral = self.derivative(old, i, h), self.i + (self.slope * h + back)
        else:
            d, integral = 0.0, self.i
        v = p + integral + d
        return (v, (p, integral, d)) if tuning == old else (v, self.aligned(v, tuning, i, h))

    def limited(self, i, target, h):
        """Rates, then limits."""
        low, high = self.u - i.downRate * h, self.u + i.upRate * h
        u, status = (high, RATE) if target > high else (low, RATE) if target < low else (target, OK)
        if u > i.outputMax:
            return i.outputMax, HIGH
        if u < i.outputMin:
            return i.outputMin, LOW
        return u, status

    def step(self, i, cycle):
        h = seconds(elapsed_ns(self.last, cycle))
        asked = "manual" if i.manual else "track" if i.track else "automatic"
        mode = asked if self.last is None else self.mode
        if isfinite(i.manualValue) and i.manualValue != self.manual_before:
            self.holds_manual = False

        range_status = limits_status(i.outputMin, i.outputMax)
        if range_status != RANGE and (i.upRate < 0.0 or i.downRate < 0.0):
            range_status = NEGATIVE_RATE
        elif range_status == OK and (isnan(i.upRate) or isnan(i.downRate)):
            range_status = NOT_FINITE
        tuning_status, now = tuning(i)
        is_known = isfinite(i.setPoint) and isfinite(i.processValue)
        can_compute = is_known and tuning_status == OK and range_status == OK

        # What the mode wants, and with which parts; None holds.
        v, parts, is_mode_valid = None, (self.p, self.i, self.d), True
        if mode == "automatic":
            if can_compute:
                v, parts = self.law(now, i, h)
        elif mode == "manual":
            v = self.u if self.holds_manual else i.manualValue
            is_mode_valid = isfinite(i.manualValue)
        else:
            v = i.trackValue
            is_mode_valid = isfinite(v)
        if v is not None and not all(map(isfinite, (v,) + parts)):
            v = None
        target = self.u if v is None else v
        if range_status == OK:
            u, limitation = self.limited(i, target, h)
        elif limits_status(i.outputMin, i.outputMax) == OK:
            # Only a rate is invalid.
            u, limitation = min(max(self.u, i.outputMin), i.outputMax), OK
        else:
            u, limitation = self.u, OK

        goes_on = can_compute and v is not None
        if goes_on:
            if mode != "automatic":
                v, parts = u, self.aligned(u, now, i, h)
            slope, excess = now[1] * (i.setPoint - i.processValue), u - v
            goes_on = all(map(isfinite, (slope, excess) + parts))
        if range_status in (RANGE, NEGATIVE_RATE):
            status = range_status
        elif tuning_status == TIME:
            status = TIME
        elif not isfinite(i.processValue):
            status = SENSOR
        elif not goes_on or not is_mode_valid:
            status = NOT_FINITE
        else:
            status = limitation

        self.u, self.can_go_on = u, goes_on
        if goes_on:
            (self.p, self.i, self.d), self.tuning, self.slope, self.excess = parts, now, slope, excess
            self.r, self.y = i.setPoint, i.processValue
        self.mode, self.last = asked, cycle.index
        if asked != "manual":
            self.manual_before, self.holds_manual = i.manualValue, True
        return [u, self.p, self.i, self.d, status >= 0x8000, status]
