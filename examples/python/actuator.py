"""Drives an actuator by a signal of a node, and to its safe value whenever that is not to be relied on.

    python3 actuator.py [SERVICE] [SIGNAL]

Defaults: SERVICE plant/level, SIGNAL level.y. Ctrl-C and SIGTERM leave the actuator at its safe value.
"""

import math
import signal
import sys

from isochrone import Error, Flags, Frame, Pace, Subscriber

SAFE = 0.0
MAX_AGE_S = 0.1  # several frames, and one period of the pace


def command(frame: "Frame | None", name: str) -> "tuple[float, str]":
    """What to do, and why that is not what the node says."""
    if frame is None:
        return SAFE, "no frame has come"
    if doubts := frame.flags & ~Flags.FORCED:
        return SAFE, doubts.words
    if frame.age > MAX_AGE_S:
        return SAFE, "the newest frame is old"
    value = float(frame[name])
    return (value, "") if math.isfinite(value) else (SAFE, f"{name} is {value}")


def drive(value: float, doubt: str, before: "str | None") -> None:
    """Here the value goes to the hardware. A change of what it rests on is printed."""
    if doubt != before:
        print(f"drives {value}" + (f", the safe value: {doubt}" if doubt else ""), flush=True)


def main(service: str = "plant/level", name: str = "level.y") -> None:
    before = None
    with Subscriber(service, [name]) as subscriber:
        try:
            for _ in Pace("10ms", offset="1ms"):
                value, doubt = command(subscriber.newest(), name)
                drive(value, doubt, before)
                before = doubt
        finally:
            drive(SAFE, "the actuator ends", before)


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        main(*sys.argv[1:])
    except Error as error:
        sys.exit(str(error))
    except KeyboardInterrupt:
        pass
