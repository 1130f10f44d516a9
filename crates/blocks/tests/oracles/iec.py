"""Blocks of IEC 61131-3, written from its tables of standard function blocks."""

from common import MS, Input, Oracle, Output


class RTrig(Oracle):
    """R_TRIG: Q := CLK AND NOT M; M := CLK, with M initially FALSE."""

    NAME = "R_TRIG"
    INPUTS = [Input("CLK", "BOOL")]
    OUTPUTS = [Output("Q", "BOOL")]

    def __init__(self):
        self.m = False

    def step(self, i, cycle):
        q = i.CLK and not self.m
        self.m = i.CLK
        return [q]


class FTrig(Oracle):
    """F_TRIG: Q := NOT CLK AND NOT M; M := NOT CLK, with M initially FALSE."""

    NAME = "F_TRIG"
    INPUTS = [Input("CLK", "BOOL")]
    OUTPUTS = [Output("Q", "BOOL")]

    def __init__(self):
        self.m = False

    def step(self, i, cycle):
        q = not i.CLK and not self.m
        self.m = not i.CLK
        return [q]


class Sr(Oracle):
    NAME = "SR"
    INPUTS = [Input("S1", "BOOL"), Input("R", "BOOL")]
    OUTPUTS = [Output("Q1", "BOOL")]
    q1 = False

    def step(self, i, cycle):
        self.q1 = i.S1 or (not i.R and self.q1)
        return [self.q1]


class Rs(Oracle):
    NAME = "RS"
    INPUTS = [Input("S", "BOOL"), Input("R1", "BOOL")]
    OUTPUTS = [Output("Q1", "BOOL")]
    q1 = False

    def step(self, i, cycle):
        self.q1 = not i.R1 and (i.S or self.q1)
        return [self.q1]


class Timer(Oracle):
    """What the timing diagrams of the timers have in common: a time that stands, runs, or is over."""

    INPUTS = [Input("IN", "BOOL", 1, 1, 0), Input("PT", "TIME", 0, 20, 50, 100, 2000)]
    OUTPUTS = [Output("Q", "BOOL"), Output("ET", "TIME")]

    def __init__(self):
        self.phase = "stands"
        self.began_ns = 0
        self.before = False

    def now_ns(self, cycle):
        return cycle.index * cycle.period_ns

    def begin(self, cycle):
        self.phase, self.began_ns = "runs", self.now_ns(cycle)

    def look(self, pt_ms, cycle):
        """The time that runs is over when it is not shorter than the preset time; ET follows it up to there."""
        preset_ms = pt_ms if pt_ms > 0 else 0
        passed_ns = self.now_ns(cycle) - self.began_ns
        if self.phase == "runs" and passed_ns >= preset_ms * MS:
            self.phase = "over"
        return {"stands": 0, "runs": passed_ns // MS, "over": preset_ms}[self.phase]


class Ton(Timer):
    NAME = "TON"

    def step(self, i, cycle):
        if i.IN and not self.before:
            self.begin(cycle)
        if not i.IN:
            self.phase = "stands"
        self.before = i.IN
        et = self.look(i.PT, cycle)
        return [self.phase == "over", et]


class Tof(Timer):
    NAME = "TOF"

    def step(self, i, cycle):
        if not i.IN and self.before:
            self.begin(cycle)
        if i.IN:
            self.phase = "stands"
        self.before = i.IN
        et = self.look(i.PT, cycle)
        return [i.IN or self.phase == "runs", et]


class Tp(Timer):
    NAME = "TP"

    def step(self, i, cycle):
        rises = i.IN and not self.before
        self.before = i.IN
        self.look(i.PT, cycle)
        if rises and self.phase != "runs":
            self.begin(cycle)
        if self.phase == "over" and not i.IN:
            self.phase = "stands"
        et = self.look(i.PT, cycle)
        return [self.phase == "runs", et]


PV = Input("PV", "INT", 1, 2, 3, 5, 10)


class Edge:
    """R_EDGE of an input."""

    def __init__(self):
        self.before = False

    def of(self, value):
        rises = value and not self.before
        self.before = value
        return rises


class Ctu(Oracle):
    NAME = "CTU"
    INPUTS = [Input("CU", "BOOL"), Input("R", "BOOL", 0), PV]
    OUTPUTS = [Output("Q", "BOOL"), Output("CV", "INT")]

    def __init__(self):
        self.cv, self.cu = 0, Edge()

    def step(self, i, cycle):
        cu = self.cu.of(i.CU)
        if i.R:
            self.cv = 0
        elif cu and self.cv < 32767:
            self.cv += 1
        return [self.cv >= i.PV, self.cv]


class Ctd(Oracle):
    NAME = "CTD"
    INPUTS = [Input("CD", "BOOL"), Input("LD", "BOOL", 0), PV]
    OUTPUTS = [Output("Q", "BOOL"), Output("CV", "INT")]

    def __init__(self):
        self.cv, self.cd = 0, Edge()

    def step(self, i, cycle):
        cd = self.cd.of(i.CD)
        if i.LD:
            self.cv = i.PV
        elif cd and self.cv > -32768:
            self.cv -= 1
        return [self.cv <= 0, self.cv]


class Ctud(Oracle):
    NAME = "CTUD"
    INPUTS = [Input("CU", "BOOL"), Input("CD", "BOOL"), Input("R", "BOOL", 0), Input("LD", "BOOL", 0), PV]
    OUTPUTS = [Output("QU", "BOOL"), Output("QD", "BOOL"), Output("CV", "INT")]

    def __init__(self):
        self.cv, self.cu, self.cd = 0, Edge(), Edge()

    def step(self, i, cycle):
        cu, cd = self.cu.of(i.CU), self.cd.of(i.CD)
        if i.R:
            self.cv = 0
        elif i.LD:
            self.cv = i.PV
        elif not (cu and cd):
            if cu and self.cv < 32767:
                self.cv += 1
            elif cd and self.cv > -32768:
                self.cv -= 1
        return [self.cv >= i.PV, self.cv <= 0, self.cv]
