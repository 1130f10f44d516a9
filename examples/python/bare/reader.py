"""Prints the frames of a service with the signal names that the publisher announces.

    python3 reader.py [SERVICE] [FRAMES]

Defaults: SERVICE plant/level, FRAMES 5. ICEORYX2_CONFIG=FILE selects the domain. Behind the values stands what they
are worth: their age, and in brackets why they are not to be relied on. Exit status: 0 done, 3 no frame arrived for
five seconds.
"""

import ctypes
import json
import sys
import time

import wire

PATIENCE_S = 5.0
# Values that are older are not to be relied on, nor is what came last once nothing has come for so long.
MAX_AGE_NS = 500_000_000
NAP_NS = 100_000
LONGEST_NAP_NS = 5_000_000


def nap_s(sent_ns, period_ns):
    """How long to sleep now. Nobody wakes a reader: the next frame is due a period after the last one was sent."""
    early_ns = sent_ns + period_ns - time.monotonic_ns()
    nap_ns = early_ns if 0 < early_ns <= period_ns else NAP_NS
    return min(nap_ns, LONGEST_NAP_NS) / 1e9


def doubts(header, age_ns):
    """Why the values of a frame are not to be relied on."""
    reasons = wire.flag_words(header.flags)
    if age_ns is None:
        reasons.append("of another clock")
    elif age_ns > MAX_AGE_NS:
        reasons.append("old")
    return f"  [{', '.join(reasons)}]" if reasons else ""


def main(service="plant/level", count="5"):
    left = int(count)
    node = wire.join("python/reader")
    # The services must outlive their ports, so both stay in variables.
    frames, layouts = wire.frames(node, service), wire.layouts(node, service)
    subscriber = frames.subscriber_builder().create()
    watcher = layouts.subscriber_builder().create()
    known = {}  # announcements by layout number
    shown = None
    sent_ns = period_ns = 0
    heard_ns = None  # when the newest frame came, until its silence is told
    deadline = time.monotonic() + PATIENCE_S
    while left > 0:
        message = watcher.receive()
        if message is not None:
            announced = json.loads(bytes(wire.elements(message, ctypes.c_uint8)))
            known[int(announced["layout"], 16)] = announced
            message.delete()
        frame = subscriber.receive()
        if frame is None:
            if time.monotonic() > deadline:
                print(f"no frames on {service}; start its publisher in this domain")
                return 3
            if heard_ns and time.monotonic_ns() - heard_ns > MAX_AGE_NS:
                print(f"no frame for {MAX_AGE_NS / 1e9} s: the values above are old", flush=True)
                heard_ns = None
            time.sleep(nap_s(sent_ns, period_ns))
            continue
        header = wire.FrameHeader.from_buffer_copy(frame.user_header().contents)
        values, layout = wire.elements(frame, ctypes.c_double), header.layout
        heard_ns = time.monotonic_ns()
        sent_ns = header.publish_ns
        frame.delete()
        # A publisher announces its layout when a reader joins. Frames with layout 0 have no names.
        if layout != 0 and layout not in known and time.monotonic() < deadline:
            continue
        announced = known.get(layout, {"signals": [], "publisher": "a plain writer"})
        period_ns = announced.get("period_ns", 0)
        names = [signal["name"] for signal in announced["signals"]]
        names += [f"ch{channel}" for channel in range(len(names), len(values))]
        if shown != layout:
            print(f"{service} from {announced['publisher']}: {', '.join(names)}")
            shown = layout
        values = " ".join(f"{name}={value}" for name, value in zip(names, values))
        age_ns = wire.age_ns(header, announced, heard_ns)
        age = "-" if age_ns is None else f"{age_ns / 1e6:.3f}"
        print(f"{header.sequence} {values}  age {age} ms{doubts(header, age_ns)}", flush=True)
        left -= 1
        deadline = time.monotonic() + PATIENCE_S
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main(*sys.argv[1:]))
    except KeyboardInterrupt:
        print("ended")
