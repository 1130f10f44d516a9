"""Signals and filters of LGF: what their pages and the catalogue's decisions say, as plainly as Python can."""

import math
from fractions import Fraction

import msun
from common import OBS, Input, Oracle, Output

MS = 1_000_000
HALF_PI = 1.5707963267948966


def finite(*values):
    return all(math.isfinite(value) for value in values)


def subfunction(status):
    return 0x8090 if status == 0x8600 else 0



def sample_period_ns(ob, cycle):
    """The period of the task at `callOB`, and the status word."""
    if ob is None:
        return cycle.period_ns, 0
    if isinstance(ob, tuple):
        return ob[1], 0
    if ob in dict(OBS):
        return dict(OBS)[ob], 0
    return 0, 0x8601 if 30 <= ob <= 38 or 123 <= ob <= 32767 else 0x8600


class Generator(Oracle):
    """SinusCI, RectangleCI, TriangleCI: `wave` gives -1 to 1 for a place in the period."""

    INPUTS = [
        Input("amplitude", "LREAL", 1.0, 0.25),
        Input("offset", "LREAL", 0.0, 1.5),
        Input("periode", "TIME", 1000, 700, 60_000, 1),
        Input("phaseShift", "LREAL", 0.0, 90.0, -45.0, 1000.0),
        Input("callOB", "OB"),
        Input("reset", "BOOL", 0.0, 0.0, 0.0),
    ]
    OUTPUTS = [
        Output("value", "LREAL"),
        Output("error", "BOOL"),
        Output("status", "WORD"),
        Output("subfunctionStatus", "WORD"),
    ]

    def __init__(self):
        self.value = 0.0
        self.last = None
        self.elapsed = 0

    def duty(self, i):
        return 50.0

    def step(self, i, cycle):
        period, status = sample_period_ns(i.callOB, cycle)
        cycles = 0 if self.last is None else cycle.index - self.last
        self.last = cycle.index
        if i.reset:
            self.elapsed = 0
        elif status == 0 and i.periode > 0:
            self.elapsed = (self.elapsed + cycles * period) % (i.periode * MS)
        duty = self.duty(i)
        is_finite = finite(i.amplitude, i.offset, i.phaseShift, duty) or bool(i.reset)
        if status == 0:
            if i.periode <= 0 or (not i.reset and is_finite and not 0.0 <= duty <= 100.0):
                status = 0x8203
            elif not is_finite:
                status = 0x8F00
        if i.reset:
            self.value = 0.0
        elif status == 0:
            whole = i.periode * MS
            shift = round(math.fmod(i.phaseShift, 360.0) / 360.0 * whole)
            value = i.offset + i.amplitude * self.wave((self.elapsed + shift) % whole, whole, i)
            if finite(value):
                self.value = value
            else:
                status = 0x8F00
        return [self.value, status >= 0x8000, status, subfunction(status)]


def quarter(phase, whole):
    """Sign, and the way to the crest or the trough as a fraction: its numerator, of `whole`."""
    sign = -1.0 if 2 * phase >= whole else 1.0
    quarters, rest = divmod(4 * phase, whole)
    return sign, (rest if quarters % 2 == 0 else whole - rest)


class SinusCI(Generator):
    NAME = "SinusCI"

    def wave(self, phase, whole, i):
        sign, climb = quarter(phase, whole)
        if 2 * climb <= whole:
            return sign * msun.sin(HALF_PI * (climb / whole))
        return sign * msun.cos(HALF_PI * ((whole - climb) / whole))


class TriangleCI(Generator):
    NAME = "TriangleCI"

    def wave(self, phase, whole, i):
        sign, climb = quarter(phase, whole)
        return sign * (climb / whole)


class RectangleCI(Generator):
    NAME = "RectangleCI"
    INPUTS = Generator.INPUTS[:4] + [Input("dutyCycle", "LREAL", 50.0, 30.0, 0.0, 100.0)] + Generator.INPUTS[4:]

    def duty(self, i):
        return i.dutyCycle

    def wave(self, phase, whole, i):
        return 1.0 if phase / whole < i.dutyCycle / 100.0 else -1.0


def two_sum(a, b):
    """Knuth, The Art of Computer Programming 2, 4.2.2: the rounded sum and its error."""
    s = a + b
    of_b = s - a
    return s, (a - (s - of_b)) + (b - of_b)


def added(pair, term):
    high, lost = two_sum(pair[0], term)
    return two_sum(high, pair[1] + lost)


def mean(pair, count):
    """The quotient, corrected by its remainder, which is exact: Python's integers find it without a trick."""
    quotient = pair[0] / count
    remainder = Fraction(pair[0]) - Fraction(quotient) * count
    return quotient + (float(remainder) + pair[1]) / count


class FloatingAverage(Oracle):
    NAME = "FloatingAverage"
    INPUTS = [
        Input("cyclicExecution", "BOOL", 1.0, 1.0, 0.0),
        Input("trigger", "BOOL"),
        Input("value", "LREAL"),
        Input("windowSize", "INT", 1, 3, 7, 100),
        Input("reset", "BOOL", 0.0, 0.0, 0.0),
    ]
    OUTPUTS = [
        Output("average", "LREAL"),
        Output("windowSizeReached", "BOOL"),
        Output("error", "BOOL"),
        Output("status", "WORD"),
    ]

    def __init__(self):
        self.window = 0
        self.average = 0.0
        self.trigger = False
        self.forget()

    def forget(self):
        self.values, self.sum, self.fresh, self.since = [], (0.0, 0.0), (0.0, 0.0), 0

    def step(self, i, cycle):
        edge = i.trigger and not self.trigger
        self.trigger = i.trigger
        size = i.windowSize
        status = 0
        if not 1 <= size <= 100:
            status = 0x8200
        elif not i.reset:
            if size != self.window:
                self.window = size
                self.forget()
            if i.cyclicExecution or edge:
                if abs(i.value) <= 1.7976931348623157e308 / 128.0:
                    self.read(i.value)
                else:
                    status = 0x8F00
        if i.reset:
            self.forget()
            self.average = 0.0
        reached = status < 0x8000 and len(self.values) == size
        return [self.average, reached, status >= 0x8000, status]

    def read(self, value):
        self.values.append(value)
        self.fresh = added(self.fresh, value)
        if len(self.values) > self.window:
            more, entering = two_sum(self.sum[0], value)
            high, leaving = two_sum(more, -self.values.pop(0))
            self.sum = two_sum(high, self.sum[1] + entering + leaving)
        else:
            self.sum = added(self.sum, value)
        self.since += 1
        if self.since == self.window:
            self.sum, self.fresh, self.since = self.fresh, (0.0, 0.0), 0
        self.average = mean(self.sum, len(self.values))


class LowPassCI(Oracle):
    NAME = "LowPassCI"
    INPUTS = [
        Input("value", "LREAL"),
        Input("timeConstant", "LREAL", 0.5, 2.0, 0.01, 100.0),
        Input("defaultOutValue", "LREAL"),
        Input("enDefaultOutValue", "BOOL", 0.0, 0.0),
        Input("callOB", "OB"),
    ]
    OUTPUTS = [
        Output("filteredValue", "LREAL"),
        Output("error", "BOOL"),
        Output("status", "WORD"),
        Output("subfunctionStatus", "WORD"),
    ]

    def __init__(self):
        self.y = None

    def step(self, i, cycle):
        period, status = sample_period_ns(i.callOB, cycle)
        tau, preset = i.timeConstant, i.enDefaultOutValue
        used = i.defaultOutValue if preset else i.value
        held = 0.0 if self.y is None else self.y
        y = held
        if preset:
            y = used
        elif status == 0 and finite(tau) and tau >= 0.0:
            if self.y is None:
                y = used
            else:
                exponent = -math.inf if tau == 0.0 else -(period / 1e9) / tau
                factor = -msun.expm1(exponent)
                y = self.y + factor * (used - self.y) if factor < 1.0 else used
        if status == 0:
            if tau < 0.0:
                status = 0x8203
            elif not finite(tau, used, y):
                status = 0x8F00
        if (status == 0 or preset) and finite(y):
            self.y = held = y
        return [held, status >= 0x8000, status, subfunction(status)]


class Hysteresis(Oracle):
    NAME = "Hysteresis"
    INPUTS = [
        Input("value", "LREAL"),
        Input("setHighLim", "LREAL", 5.0, 8.0),
        Input("setLowLim", "LREAL", -5.0, 2.0),
    ]
    OUTPUTS = [
        Output("output", "BOOL"),
        Output("error", "BOOL"),
        Output("status", "WORD"),
    ]

    def __init__(self):
        self.output = False

    def step(self, i, cycle):
        value, high, low = i.value, i.setHighLim, i.setLowLim
        status = 0
        if low > high:
            status = 0x8200
        elif not finite(value) or math.isnan(high) or math.isnan(low) or high == -math.inf or low == math.inf:
            status = 0x8F00
        elif value >= high:
            self.output = True
        elif value <= low:
            self.output = False
        return [self.output, status >= 0x8000, status]


class DifferenceQuotientFB(Oracle):
    NAME = "DifferenceQuotientFB"
    INPUTS = [
        Input("enable", "BOOL", 1.0, 1.0),
        Input("insert", "BOOL"),
        Input("value", "LREAL"),
        Input("deltaT", "LREAL", 0.1, 1.0),
        Input("cyclicExecution", "BOOL", 1.0, 0.0),
    ]
    OUTPUTS = [
        Output("derivatedValue", "LREAL"),
        Output("error", "BOOL"),
        Output("status", "WORD"),
    ]

    def __init__(self):
        self.insert = False
        self.restart()

    def restart(self):
        self.values, self.derivative, self.calls = [], 0.0, 0

    def step(self, i, cycle):
        edge = i.insert and not self.insert
        self.insert = i.insert
        if not i.enable:
            self.restart()
            return [0.0, False, 0x7000]
        self.calls += 1
        cyclic = i.cyclicExecution
        distance = cycle.period_ns / 1e9 if cyclic else i.deltaT
        takes = cyclic or edge
        bad = takes and not finite(i.value)
        if takes and not bad:
            self.values = ([i.value] + self.values)[:5]
        if distance <= 0.0:
            status = 0x8200
        elif bad or not finite(distance):
            status = 0x8F00
        else:
            status = 0x7001 if self.calls == 1 else 0x7002 if len(self.values) == 5 else 0x7010
            if len(self.values) == 5:
                v0, v1, _, v3, v4 = self.values
                derivative = (2.0 * (v0 - v4) + (v1 - v3)) / (10.0 * distance) if 10.0 * distance else math.nan
                if finite(derivative):
                    self.derivative = derivative
                else:
                    status = 0x8F00
        return [self.derivative, status >= 0x8000, status]


class Integration(Oracle):
    NAME = "Integration"
    INPUTS = [
        Input("enable", "BOOL", 1.0, 1.0),
        Input("value", "LREAL"),
        Input("reset", "BOOL", 0.0, 0.0, 0.0),
    ]
    OUTPUTS = [
        Output("integral", "LREAL"),
        Output("error", "BOOL"),
        Output("status", "WORD"),
        Output("subfunctionStatus", "WORD"),
    ]

    def __init__(self):
        self.sum = (0.0, 0.0)
        self.last = None

    def step(self, i, cycle):
        if i.reset:
            self.sum, self.last = (0.0, 0.0), None
        status = 0
        if not i.enable:
            self.last = None
        elif not finite(i.value):
            self.last, status = None, 0x8F00
        else:
            if self.last is not None:
                value, index = self.last
                seconds = float((cycle.index - index) * cycle.period_ns) / 1e9
                total = added(self.sum, (0.5 * value + 0.5 * i.value) * seconds)
                if finite(*total):
                    self.sum = total
                else:
                    status = 0x8F00
            self.last = (i.value, cycle.index) if status == 0 else None
        return [self.sum[0], status >= 0x8000, status, 0]


class NonLinearInterpolation(Oracle):
    NAME = "NonLinearInterpolation"
    INPUTS = [
        Input("value", "LREAL"),
        Input("defaultOutValue", "LREAL"),
        Input("enDefaultOutValue", "BOOL", 0.0, 0.0),
        Input("track", "BOOL", 0.0, 0.0),
        Input("reset", "BOOL", 0.0, 0.0),
        Input("numberOfPoints", "INT", 2, 3, 5, 12),
    ] + [
        pin
        for n in range(12)
        for pin in (Input(f"x{n + 1}", "LREAL", 2.0 * n - 11.0, 2.0 * n - 10.5), Input(f"y{n + 1}", "LREAL"))
    ]
    OUTPUTS = [Output("outputValue", "LREAL"), Output("error", "BOOL"), Output("status", "WORD")]

    def __init__(self):
        self.y = 0.0

    def step(self, i, cycle):
        count = i.numberOfPoints
        points = [(getattr(i, f"x{n}"), getattr(i, f"y{n}")) for n in range(1, 13)][: max(count, 0)]
        wrong = 0
        if not 2 <= count <= 12 or any(a[0] >= b[0] for a, b in zip(points, points[1:])):
            wrong = 0x8200
        elif not all(finite(x, y) for x, y in points):
            wrong = 0x8F00
        status, y = wrong, None
        if i.reset:
            y = 0.0
        elif i.enDefaultOutValue:
            y = i.defaultOutValue
        elif i.track:
            y = i.value
        elif wrong == 0:
            y, status = self.curve(points, i.value)
        if y is not None:
            if finite(y):
                self.y = y
            elif status < 0x8000:
                status = 0x8F00
        return [self.y, status >= 0x8000, status]

    def curve(self, points, value):
        if not finite(value):
            return math.nan, 0x8F00
        if value < points[0][0]:
            return points[0][1], 0x6001
        if value > points[-1][0]:
            return points[-1][1], 0x6002
        for x, y in points:
            if value == x:
                return y, 0
        for (xa, ya), (xb, yb) in zip(points, points[1:]):
            if xa < value < xb:
                return (yb - ya) / (xb - xa) * (value - xa) + ya, 0
