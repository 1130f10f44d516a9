#!/usr/bin/env python3
"""golden/step-responses/expected.csv: loops of the oracles of PID and of the plants.

    python3 crates/blocks/tests/oracles/golden_steps.py            writes it
    python3 crates/blocks/tests/oracles/golden_steps.py --check    fails where it is not what this would write
"""

import sys
from math import inf
from pathlib import Path
from types import SimpleNamespace

sys.dont_write_bytecode = True
from common import MS  # noqa: E402
from pid import PID  # noqa: E402
from plants import PlantPT1, PlantPT2  # noqa: E402

GOLDEN = Path(__file__).resolve().parents[4] / "golden" / "step-responses"
CYCLES, PERIOD_NS = 600, 20 * MS
CONTROLLER = {
    "setPoint": 1.0, "manual": False, "manualValue": 0.0, "track": False, "trackValue": 0.0, "reset": False,
    "direct": False, "parallel": False, "gain": 1.0, "integralTime": 0.0, "derivativeTime": 0.0, "integralGain": 0.0,
    "derivativeGain": 0.0, "N": 10.0, "b": 1.0, "c": 0.0, "trackingTime": 0.0, "outputMin": -inf, "outputMax": inf,
    "upRate": inf, "downRate": inf,
}
PLANT = {"gain": 1.0, "timeConstant": 1.0, "damping": 1.0, "initialValue": 0.0, "reset": False}
PARALLEL = {"parallel": True, "gain": 4.0, "integralGain": 1.3333333333333333, "derivativeGain": 3.2, "b": 0.6}
# Names and inputs of plant and controller.
LOOPS = [
    ("pt1", PlantPT1, {}, "pi", {"gain": 2.0, "integralTime": 1.0}),
    ("damped", PlantPT2, {"damping": 0.7}, "weighted", {"gain": 0.8, "integralTime": 1.2, "b": 0.5}),
    ("critical", PlantPT2, {}, "pid", {"gain": 4.0, "integralTime": 1.6, "derivativeTime": 0.4}),
    ("oscillating", PlantPT2, {"gain": 0.5, "timeConstant": 2.0, "damping": 0.4}, "parallel", PARALLEL),
]


def answers(plant, of_plant, of_controller):
    """Value of the process and output in each cycle; the plant gets the output of the cycle before."""
    plant, controller, u = plant(), PID(), 0.0
    for index in range(CYCLES):
        cycle = SimpleNamespace(index=index, period_ns=PERIOD_NS)
        y = plant.step(SimpleNamespace(**{**PLANT, **of_plant, "u": u}), cycle)[0]
        u = controller.step(SimpleNamespace(**{**CONTROLLER, **of_controller, "processValue": y}), cycle)[0]
        yield y, u


if __name__ == "__main__":
    names = [f"{plant}.y,{controller}.output" for plant, _, _, controller, _ in LOOPS]
    rows = [",".join(["cycle"] + names)]
    loops = [answers(plant, of_plant, of_controller) for _, plant, of_plant, _, of_controller in LOOPS]
    for index, row in enumerate(zip(*loops)):
        rows.append(",".join([str(index)] + [repr(value) for both in row for value in both]))
    text, file = "\n".join(rows) + "\n", GOLDEN / "expected.csv"
    if "--check" not in sys.argv:
        file.write_text(text)
    elif file.read_text() != text:
        sys.exit(f"{file} is not what the oracles make")
