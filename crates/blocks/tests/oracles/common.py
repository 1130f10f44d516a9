"""Random cases for blocks, the same here and in ../blocks/oracles.rs: what is changed in one is changed in the other."""

import struct
from types import SimpleNamespace

CASES = 200
MASK = (1 << 64) - 1
MS = 1_000_000
OBS = [(30, 1_000_000), (35, 10_000_000), (123, 333_333)]
RANGES = {
    "BOOL": (0, 1),
    "INT": (-(1 << 15), (1 << 15) - 1),
    "TIME": (-(1 << 31), (1 << 31) - 1),
    "WORD": (0, (1 << 16) - 1),
}
HOUR_NS = 3_600_000_000_000
PERIODS_NS = [10_000, 333_333, 1_000_000, 10_000_000, 100_000_000, 1_000_000_000]
TROUBLE = [
    float("nan"), float("inf"), float("-inf"), 0.0, -0.0, 5e-324, -5e-324, 2.2250738585072014e-308,
    1e-310, 1.7976931348623157e308, -1.7976931348623157e308, 1e308, -1e308, 0.1,
]


class Input:
    """An input pin: LREAL, INT, TIME, BOOL, WORD, or OB for a `callOB`. Cases prefer the values in `usual`, with which
    the block works; one that stands there twice is drawn twice as often. Without them, any value is drawn."""

    def __init__(self, name, pin_type, *usual):
        self.name, self.pin_type, self.usual = name, pin_type, usual


class Output:
    """An output pin: LREAL, INT, TIME, BOOL or WORD."""

    def __init__(self, name, pin_type):
        self.name, self.pin_type = name, pin_type


class Oracle:
    """A block as its document has it; an instance of the class is an instance of the block.

    A subclass says `NAME`, `INPUTS` and `OUTPUTS`, in the order of the block's pins. `step` gets an object that has
    the inputs as attributes (bool, int or float; an OB is `None` for the calling task, a number, or `("period", ns)`)
    and a cycle with `index` and `period_ns`; it returns the outputs in their order."""

    NAME = ""
    INPUTS = []
    OUTPUTS = []

    def step(self, inputs, cycle):
        raise NotImplementedError


def sample_time_s(ob, cycle):
    """The sample time and no status, or nothing and the status words of the query."""
    if ob is None:
        return cycle.period_ns / 1e9, 0, 0
    if isinstance(ob, tuple):
        return ob[1] / 1e9, 0, 0
    for number, period_ns in OBS:
        if ob == number:
            return period_ns / 1e9, 0, 0
    if 30 <= ob <= 38 or 123 <= ob <= 32767:
        return None, 0x8601, 0
    return None, 0x8600, 0x8090


class Draws:
    """Numbers that look random (SplitMix64)."""

    def __init__(self, seed):
        self.state = seed & MASK

    def next(self):
        self.state = (self.state + 0x9E3779B97F4A7C15) & MASK
        mixed = self.state
        mixed = ((mixed ^ (mixed >> 30)) * 0xBF58476D1CE4E5B9) & MASK
        mixed = ((mixed ^ (mixed >> 27)) * 0x94D049BB133111EB) & MASK
        return mixed ^ (mixed >> 31)

    def between(self, first, last):
        """From the first to the last, both included."""
        return first + self.next() % (last - first + 1)

    def is_one_in(self, many):
        return self.between(1, many) == 1

    def one_of(self, values):
        return values[self.between(0, len(values) - 1)]

    def real(self, usual, is_wild):
        kind = self.between(0, 15)
        if kind == 0 and is_wild:
            return struct.unpack("<d", struct.pack("<Q", self.next()))[0]
        if kind <= 2 and is_wild:
            return self.one_of(TROUBLE)
        if kind <= 8 and usual:
            return self.one_of(usual)
        if kind <= 10 and usual:
            return self.one_of(usual) * float(self.between(0, 300)) * 0.01
        if kind <= 12:
            return float(self.between(-40, 40)) * 0.5
        if kind <= 14 and not usual:
            return float(self.between(-20_000_000, 20_000_000)) * 1e-6
        return self.one_of(usual) if usual else 0.0

    def whole(self, usual, is_wild, bounds):
        least, most = bounds
        kind = self.between(0, 7)
        if kind == 0 and is_wild:
            return self.between(least, most)
        if kind == 1 and is_wild:
            return self.one_of([least, most])
        if kind == 2 and is_wild:
            return self.between(most - 3, most)
        if usual and kind <= 6:
            return self.one_of(usual)
        return min(max(self.between(-50, 50), least), most)

    def ob(self, is_wild):
        kind = self.between(0, 7)
        if kind == 0 and is_wild:
            return self.between(-32768, 32767)
        if kind <= 2 and is_wild:
            return self.one_of([30, 35, 123, 36, 1, 0])
        if kind == 3:
            return ("period", self.one_of(PERIODS_NS))
        return None

    def value(self, pin, is_wild):
        if pin.pin_type == "OB":
            return self.ob(is_wild)
        if pin.pin_type == "LREAL":
            return self.real(pin.usual, is_wild)
        if pin.pin_type == "BOOL":
            if pin.usual and not self.is_one_in(8):
                return bool(self.one_of(pin.usual))
            return self.between(0, 1) == 1
        return self.whole(pin.usual, is_wild, RANGES[pin.pin_type])


class Case:
    """A period, and cycles with their inputs. One case in two is wild: extremes at the pins, any period, long gaps."""

    def __init__(self, block, number):
        self.pins = block.INPUTS
        self.draws = Draws(fnv(block.NAME.encode()) + number)
        draws = self.draws
        self.is_wild = draws.is_one_in(2)
        self.period_ns = draws.one_of(PERIODS_NS)
        if self.is_wild and draws.is_one_in(4):
            self.period_ns = draws.between(10_000, HOUR_NS)
        self.index = draws.between(0, 1 << 40) if draws.is_one_in(3) else 0
        self.cycles = draws.between(20, 200)
        # A pin keeps its value for so many cycles.
        self.calm = draws.one_of([2, 4, 10, 30])

    def __iter__(self):
        draws = self.draws
        values = [draws.value(pin, self.is_wild) for pin in self.pins]
        for _ in range(self.cycles):
            cycle = SimpleNamespace(index=self.index, period_ns=self.period_ns)
            yield cycle, dict(zip([pin.name for pin in self.pins], values))
            self.index += 1
            if draws.is_one_in(16):
                # An overrun skipped cycles.
                self.index += 1 << draws.between(0, 30) if self.is_wild else draws.between(1, 20)
            for place, pin in enumerate(self.pins):
                if draws.is_one_in(self.calm):
                    values[place] = draws.value(pin, self.is_wild)


def fnv(octets, digest=0xCBF29CE484222325):
    """FNV-1a with 64 bits."""
    for octet in octets:
        digest = ((digest ^ octet) * 0x100000001B3) & MASK
    return digest


def run(block, number):
    """Steps a new instance through a case: cycle, inputs and outputs of each step."""
    instance = block()
    for cycle, inputs in Case(block, number):
        outputs = instance.step(SimpleNamespace(**inputs), cycle)
        if len(outputs) != len(block.OUTPUTS):
            raise ValueError(f"{block.NAME} has {len(block.OUTPUTS)} outputs, its step returns {len(outputs)}")
        for pin, value in zip(block.OUTPUTS, outputs):
            is_of_type = isinstance(value, {"LREAL": float, "BOOL": bool}.get(pin.pin_type, int))
            bounds = RANGES.get(pin.pin_type)
            if not is_of_type or (bounds and not bounds[0] <= value <= bounds[1]):
                raise ValueError(f"case {number}: {block.NAME}.{pin.name} = {value!r} is no {pin.pin_type}")
        yield cycle, inputs, outputs


def digest(block, number):
    """A digest of all outputs of a case: of the bits of each as a 64-bit floating-point number."""
    value = 0xCBF29CE484222325
    for _, _, outputs in run(block, number):
        for output in outputs:
            value = fnv(struct.pack("<d", float(output)), value)
    return value


def text(value):
    """A value as Rust prints it, so that two traces can be compared."""
    if value is None:
        return "caller"
    if isinstance(value, tuple):
        return f"{value[1]}ns"
    if not isinstance(value, float):
        return str(int(value))
    if value != value:
        return "NaN"
    if value in (float("inf"), float("-inf")):
        return str(value)
    digits, _, exponent = repr(abs(value)).partition("e")
    whole, _, fraction = digits.partition(".")
    all_digits = whole + fraction
    stripped = all_digits.lstrip("0")
    power = int(exponent or 0) + len(whole) - 1 - (len(all_digits) - len(stripped))
    stripped = stripped.rstrip("0")
    sign = "-" if struct.pack("<d", value)[7] & 0x80 else ""
    if not stripped:
        return f"{sign}0e0"
    rest = f".{stripped[1:]}" if stripped[1:] else ""
    return f"{sign}{stripped[0]}{rest}e{power}"
