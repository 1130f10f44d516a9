"""Publishes a sine and a counter on the grid of all nodes.

    python3 writer.py [SERVICE] [FRAMES] [HZ] [PHASE_US]

Defaults: SERVICE plant/python, FRAMES 1000, HZ 100, PHASE_US 150: if 20 ms are a multiple of the time between two
frames, they are due PHASE_US after the releases of all tasks without a phase. Ctrl-C and SIGTERM end it cleanly. An
input of a node that reads one of the signals:

    [[input]]
    name = "wave"
    service = "plant/python"
    signal = "sine"
"""

import math
import signal
import sys

from isochrone import Error, Pace, Publisher, Signal

SIGNALS = [Signal("sine", unit="m"), Signal("count", "INT")]


def main(service: str = "plant/python", count: str = "1000", hz: str = "100", phase_us: str = "150") -> None:
    period_s, phase_s = 1 / float(hz), float(phase_us) / 1e6
    with Publisher(service, SIGNALS, period=period_s) as publisher:
        for release in Pace(period_s, offset=phase_s):
            values = [math.sin(release.cycle / 50), release.cycle % 32768]
            if publisher.publish(values, at=release) + 1 >= int(count):
                break
    # Leaving `with` has sent the last values once more with STOPPED, which readers take as stale at once.


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        main(*sys.argv[1:])
    except Error as error:
        sys.exit(str(error))
    except KeyboardInterrupt:
        print("ended")
