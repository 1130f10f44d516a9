"""Publishes a sine and a counter, and announces their layout so that a node can read them by name.

    python3 writer.py [SERVICE] [FRAMES] [HZ] [PHASE_US]

Defaults: SERVICE plant/python, FRAMES 1000, HZ 100, PHASE_US 150. ICEORYX2_CONFIG=FILE selects the domain. If
20 ms are a multiple of the time between two frames, they are due PHASE_US after the releases of all tasks without
a phase. Ctrl-C and SIGTERM end it cleanly. An input of a node that reads one of the signals:

    [[input]]
    name = "wave"
    service = "plant/python"
    signal = "sine"
"""

import ctypes
import json
import math
import signal
import sys
import time

import iceoryx2 as iox2
import wire

SIGNALS = [
    {"name": "sine", "type": "LREAL", "unit": "m"},
    {"name": "count", "type": "INT"},
]
# Any number except 0; equal layouts must have equal numbers, because readers only compare them.
LAYOUT = 0x7079_0000_0000_0001
ANNOUNCE_S = 0.5
HEAD_START_NS = 50_000_000


class Announcer:
    """Sends the layout when a reader joins, and every half second while there is one."""

    def __init__(self, node, service, period_ns):
        announcement = {
            "layout": f"{LAYOUT:016x}",
            "publisher": "python",
            "host": wire.host(),
            "period_ns": period_ns,
            "signals": SIGNALS,
        }
        self.json = json.dumps(announcement).encode()
        self.service = wire.layouts(node, service)
        self.publisher = (
            self.service.publisher_builder().initial_max_slice_len(len(self.json)).create()
        )
        self.readers = 0
        self.sent_s = -math.inf

    def tend(self):
        readers = self.service.dynamic_config.number_of_subscribers
        is_due = time.monotonic() - self.sent_s >= ANNOUNCE_S
        if readers > self.readers or (readers > 0 and is_due):
            message = self.publisher.loan_slice_uninit(len(self.json))
            ctypes.memmove(message.payload().as_ptr(), self.json, len(self.json))
            message.assume_init().send()
            self.sent_s = time.monotonic()
        self.readers = readers


class Writer:
    """Sends frames. A publisher of one's own sets at least `sequence` and `publish_ns`."""

    def __init__(self, node, service):
        self.service = wire.frames(node, service)
        self.publisher = self.service.publisher_builder().initial_max_slice_len(len(SIGNALS)).create()
        self.sequence = 0

    def send(self, values, **header):
        frame = self.publisher.loan_slice_uninit(len(values))
        header = wire.FrameHeader(sequence=self.sequence, layout=LAYOUT, **header)
        payload = (ctypes.c_double * len(values))(*values)
        ctypes.memmove(frame.payload().as_ptr(), payload, ctypes.sizeof(payload))
        header.publish_ns = time.monotonic_ns()
        ctypes.memmove(frame.user_header_ptr, ctypes.byref(header), ctypes.sizeof(header))
        frame.assume_init().send()
        self.sequence += 1


def main(service="plant/python", count="1000", hz="100", phase_us="150"):
    period_ns, phase_ns = round(1e9 / float(hz)), round(1000 * float(phase_us))
    node = wire.join("python/writer")
    writer = Writer(node, service)
    announcer = Announcer(node, service, period_ns)
    announcer.tend()
    # Give waiting readers time to receive the layout before the first frame.
    epoch_ns = wire.next_epoch_ns(time.monotonic_ns() + HEAD_START_NS)
    values = [0.0] * len(SIGNALS)
    cycle = missed = 0
    try:
        while writer.sequence < int(count):
            # Counted from the epoch: sleeping for a period would add what each frame takes.
            release_ns = epoch_ns + phase_ns + cycle * period_ns
            while (rest_ns := release_ns - time.monotonic_ns()) > 0:
                announcer.tend()
                time.sleep(min(rest_ns / 1e9, 0.02))
            values = [math.sin(cycle / 50), cycle % 32768]
            writer.send(values, cycle=cycle, release_ns=release_ns, missed=missed)
            announcer.tend()
            # Releases that passed meanwhile are left out: the next frame is on the grid again.
            late = max(0, (time.monotonic_ns() - release_ns) // period_ns)
            missed += late
            cycle += 1 + late
    finally:
        # The last frame says that nothing follows. Readers take its values as stale at once, and do not wait for
        # their age to tell.
        writer.send(values, cycle=cycle, missed=missed, flags=wire.STOPPED)
    return 0


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        sys.exit(main(*sys.argv[1:]))
    except iox2.PublisherCreateError as refused:
        sys.exit(f"cannot publish: {refused}")
    except KeyboardInterrupt:
        # Leaving main() has already closed the ports.
        print("ended")
