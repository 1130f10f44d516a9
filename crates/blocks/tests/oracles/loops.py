#!/usr/bin/env python3
"""The loops of examples/, cycle by cycle, of the oracles of their blocks: golden/LOOP/expected.csv.

    python3 crates/blocks/tests/oracles/loops.py            writes these files
    python3 crates/blocks/tests/oracles/loops.py --check    fails where one is not what it would write

A loop whose sensor is an input has the plant here: its in.csv is what the sensor measures of that, and written too.
How the blocks of a loop are connected is written from the drawing and the text of its configuration. What an Expr
computes is Python's arithmetic here, as it is binary64 in the order written. So every digit is the same: a tolerance
would only hide a mistake.
"""

import csv
import sys
from itertools import count
from math import inf
from pathlib import Path
from types import SimpleNamespace

sys.dont_write_bytecode = True
from iec import RTrig, Ton, Tp  # noqa: E402
from lgf import Hysteresis  # noqa: E402
from pid import PID  # noqa: E402
from plants import PlantIntegrator, PlantPT1, PlantPT2, seconds  # noqa: E402

GOLDEN = Path(__file__).resolve().parents[4] / "golden"
PERIOD_NS = 100_000_000
# What docs/blocks.md gives for the pins that a configuration leaves out.
PLANT = {"gain": 1.0, "initialValue": 0.0, "reset": False}
DEFAULTS = {
    PID: {
        "manual": False, "manualValue": 0.0, "track": False, "trackValue": 0.0, "reset": False, "direct": False,
        "parallel": False, "derivativeTime": 0.0, "integralGain": 0.0, "derivativeGain": 0.0, "N": 10.0, "b": 1.0,
        "c": 0.0, "trackingTime": 0.0, "outputMin": 0.0, "outputMax": 100.0, "upRate": inf, "downRate": inf,
    },
    PlantPT1: PLANT, PlantPT2: PLANT, PlantIntegrator: {**PLANT, "load": 0.0},
}


class Instance:
    """A block with the pins that stay as they are; `step` takes those that change. Its outputs are attributes."""

    def __init__(self, oracle, **pins):
        self.block, self.pins = oracle(), {**DEFAULTS.get(oracle, {}), **pins}
        self.cycles = count()
        for pin in oracle.OUTPUTS:
            setattr(self, pin.name, {"BOOL": False, "LREAL": 0.0}.get(pin.pin_type, 0))

    def step(self, **pins):
        cycle = SimpleNamespace(index=next(self.cycles), period_ns=PERIOD_NS)
        outputs = self.block.step(SimpleNamespace(**{**self.pins, **pins}), cycle)
        for pin, value in zip(self.block.OUTPUTS, outputs):
            setattr(self, pin.name, value)


class LevelControl:
    NAME = "level-control"
    COLUMNS = "set_point [m],tank.y [m],control.output [m3/s],control.status,demand [m3/s]"

    def __init__(self):
        self.tank = Instance(PlantIntegrator, gain=2.0, yMin=0.0, yMax=2.0, initialValue=0.2)
        self.control = Instance(PID, gain=0.2, integralTime=10.0, outputMax=0.05)

    def step(self, set_point, demand):
        tank, control = self.tank, self.control
        tank.step(u=control.output, load=demand)
        control.step(setPoint=set_point, processValue=tank.y)
        return set_point, tank.y, control.output, control.status, demand


class ManualAutomatic:
    NAME = "manual-automatic"
    COLUMNS = "set_point [degC],oven.y [degC],control.output [%],control.status,manual,manual_value [%]"

    def __init__(self):
        self.oven = Instance(PlantPT2, gain=2.0, timeConstant=4.0, damping=1.25, initialValue=20.0)
        tuning = {"gain": 2.0, "integralTime": 8.0, "derivativeTime": 1.5, "b": 0.6}
        self.control = Instance(PID, **tuning, upRate=50.0, downRate=50.0)

    def step(self, set_point, manual, manual_value):
        oven, control = self.oven, self.control
        oven.step(u=control.output)
        control.step(setPoint=set_point, processValue=oven.y, manual=manual != 0.0, manualValue=manual_value)
        return set_point, oven.y, control.output, control.status, manual, manual_value


class SensorFailure:
    NAME = "sensor-failure"
    COLUMNS = "set_point [bar],pressure [bar],pressure.ok,control.output [%],control.status"

    CYCLES = 300

    def __init__(self):
        self.control = Instance(PID, trackValue=0.0, gain=20.0, integralTime=5.0, upRate=20.0, downRate=20.0)
        self.vessel = Instance(PlantPT1, gain=0.1, timeConstant=3.0, initialValue=3.5)

    def measure(self, cycle, before):
        """The vessel behind the valve. From 10 s to 14 s the sensor fails, and its last value stays."""
        self.vessel.step(u=self.control.output)
        if 100 <= cycle < 140:
            return {"pressure": before["pressure"], "pressure.ok": 0}
        return {"pressure": round(self.vessel.y, 4), "pressure.ok": 1}

    def step(self, pressure, pressure_ok):
        control = self.control
        control.step(setPoint=4.0, processValue=pressure, track=pressure_ok == 0.0)
        return 4.0, pressure, pressure_ok, control.output, control.status


class Cascade:
    NAME = "cascade"
    COLUMNS = (
        "set_point.delayedValue [m],tank.y [m],level_control.output [m3/s],pipe.y [m3/s],flow_control.output [%],"
        "manual,demand [m3/s]"
    )

    def __init__(self):
        self.pipe = Instance(PlantPT1, gain=0.0005, timeConstant=1.0)
        self.tank = Instance(PlantIntegrator, gain=2.0, yMin=0.0, yMax=2.0)
        self.set_point, self.most = 0.0, 0.05 * seconds(PERIOD_NS)
        self.level = Instance(PID, gain=0.1, integralTime=20.0, outputMax=0.05)
        self.flow = Instance(PID, gain=2000.0, integralTime=0.8)

    def step(self, wanted, demand, manual, valve):
        pipe, tank, level, flow = self.pipe, self.tank, self.level, self.flow
        pipe.step(u=flow.output)
        tank.step(u=pipe.y, load=demand)
        # LimRateOfChangeCI: one step a cycle, and exactly onto the value.
        way = wanted - self.set_point
        is_near = abs(way) <= self.most
        self.set_point = wanted if is_near else self.set_point + (self.most if way > 0.0 else -self.most)
        level.step(setPoint=self.set_point, processValue=tank.y, track=manual != 0.0, trackValue=pipe.y)
        flow.step(setPoint=level.output, processValue=pipe.y, manual=manual != 0.0, manualValue=valve)
        return self.set_point, tank.y, level.output, pipe.y, flow.output, manual, demand


class TwoPointControl:
    NAME = "two-point-control"
    COLUMNS = "temp [degC],lim.high [degC],lim.low [degC],heater.on,hot.output,run.Q,pause.Q"
    CYCLES = 1_200

    def __init__(self):
        self.high, self.low = 60.0 + 2.0 / 2.0, 60.0 - 2.0 / 2.0
        self.hot = Instance(Hysteresis, setHighLim=self.high, setLowLim=self.low)
        self.run, self.pause = Instance(Tp, PT=5_000), Instance(Tp, PT=5_000)
        self.on, self.box = False, 55.0

    def measure(self, cycle, before):
        """A box that the heater would bring to 100 degrees. From 60 s on it is five times as fast, so that the shortest
        times decide; from 90 s to 100 s the sensor fails."""
        time_constant_s = 200.0 if cycle < 600 else 40.0
        self.box += ((100.0 if self.on else 20.0) - self.box) * 0.1 / time_constant_s
        if 900 <= cycle < 1000:
            return {"temp": before["temp"], "temp.ok": 0}
        return {"temp": round(self.box, 4), "temp.ok": 1}

    def step(self, temp, temp_ok):
        hot, run, pause = self.hot, self.run, self.pause
        hot.step(value=temp)
        # The timers are those of the cycle before.
        self.on = run.Q or (not hot.output and not pause.Q and temp_ok != 0.0)
        run.step(IN=self.on)
        pause.step(IN=not self.on)
        return temp, self.high, self.low, self.on, hot.output, run.Q, pause.Q


class Sequence:
    NAME = "sequence"
    COLUMNS = "button,step.n,tank.y [m],temp.y [degC],act.wait,act.fill,act.heat,act.stir,act.drain,stir.ET"
    WAIT, FILL, HEAT, STIR, DRAIN = range(5)

    def __init__(self):
        self.now = self.WAIT
        self.start, self.stir = Instance(RTrig), Instance(Ton, PT=10_000)
        self.tank = Instance(PlantIntegrator, yMin=0.0, yMax=2.0)
        self.temp = Instance(PlantPT1, timeConstant=20.0, initialValue=20.0)

    def step(self, button):
        start, stir, tank, temp = self.start, self.stir, self.tank, self.temp
        # The plant lives on what the sequence did in the cycle before.
        tank.step(u=0.15 * (self.now == self.FILL), load=0.2 * (self.now == self.DRAIN))
        temp.step(u=20.0 + 100.0 * (self.now == self.HEAT))
        start.step(CLK=button != 0.0)
        is_over = [start.Q, tank.y >= 1.5, temp.y >= 60.0, stir.Q, tank.y <= 0.02][self.now]
        self.now = (self.now + is_over) % 5
        stir.step(IN=self.now == self.STIR)
        acts = [self.now == act for act in range(5)]
        return button, self.now, tank.y, temp.y, *acts, stir.ET


def text(value):
    """A number as Rust's {:?} prints it."""
    mantissa, e, exponent = repr(float(value)).partition("e")
    return mantissa if not e else f"{mantissa.removesuffix('.0')}e{int(exponent)}"


def pages(loop):
    """The files of a loop that are made here, by their names: a row of outputs for each row of inputs."""
    instance, measures = loop(), hasattr(loop, "measure")
    rows = [None] * loop.CYCLES if measures else given(loop)
    outputs = [f"cycle,{loop.COLUMNS}"]
    for cycle in range(len(rows)):
        if measures:
            rows[cycle] = instance.measure(cycle, rows[cycle - 1])
        pins = {name.replace(".", "_"): float(value) for name, value in rows[cycle].items()}
        outputs.append(",".join([str(cycle), *map(text, instance.step(**pins))]))
    made = {"expected.csv": outputs}
    if measures:
        made["in.csv"] = [",".join(rows[0])] + [",".join(map(str, row.values())) for row in rows]
    return {name: "\n".join(lines) + "\n" for name, lines in made.items()}


def given(loop):
    """The rows of in.csv."""
    with open(GOLDEN / loop.NAME / "in.csv", newline="") as file:
        return list(csv.DictReader(file))


def main():
    failed = False
    for loop in (LevelControl, ManualAutomatic, SensorFailure, Cascade, TwoPointControl, Sequence):
        for name, made in pages(loop).items():
            path = GOLDEN / loop.NAME / name
            if sys.argv[1:] != ["--check"]:
                path.write_text(made)
            elif path.read_text() != made:
                lines = zip(count(1), path.read_text().splitlines() + [""], made.splitlines() + [""])
                line, found, expected = next(it for it in lines if it[1] != it[2])
                print(f"{path}:{line}: {found!r}, and the oracles of its blocks make {expected!r}")
                failed = True
    sys.exit(failed)


if __name__ == "__main__":
    main()
