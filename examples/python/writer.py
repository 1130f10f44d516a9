"""Publishes a sine and a counter, and announces their layout so that a node can read them by name.

    python3 writer.py [SERVICE] [FRAMES] [HZ]

Defaults: SERVICE plant/python, FRAMES 1000, HZ 100. ICEORYX2_CONFIG=FILE selects the domain. Ctrl-C
and SIGTERM end it cleanly. An input of a node that reads one of the signals:

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
HEAD_START_S = 0.05


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


def main(service="plant/python", count="1000", hz="100"):
    period_s = 1 / float(hz)
    node = wire.join("python/writer")
    frames = wire.frames(node, service)
    publisher = frames.publisher_builder().initial_max_slice_len(len(SIGNALS)).create()
    announcer = Announcer(node, service, int(period_s * 1e9))
    announcer.tend()
    # Give waiting readers time to receive the layout before the first frame.
    due_s = time.monotonic() + HEAD_START_S
    for sequence in range(int(count)):
        while (rest_s := due_s - time.monotonic()) > 0:
            announcer.tend()
            time.sleep(min(rest_s, 0.02))
        due_s += period_s
        frame = publisher.loan_slice_uninit(len(SIGNALS))
        header = wire.FrameHeader(sequence=sequence, layout=LAYOUT)
        values = (ctypes.c_double * len(SIGNALS))(math.sin(sequence / 50), sequence % 32768)
        ctypes.memmove(frame.payload().as_ptr(), values, ctypes.sizeof(values))
        header.publish_ns = time.clock_gettime_ns(time.CLOCK_MONOTONIC)
        ctypes.memmove(frame.user_header_ptr, ctypes.byref(header), ctypes.sizeof(header))
        frame.assume_init().send()
        announcer.tend()
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
