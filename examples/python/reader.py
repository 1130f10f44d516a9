"""Prints the frames of a service with the signal names that the publisher announces.

    python3 reader.py [SERVICE] [FRAMES]

Defaults: SERVICE plant/level, FRAMES 5. ICEORYX2_CONFIG=FILE selects the domain. Exit status: 0
done, 3 no frame arrived for five seconds.
"""

import ctypes
import json
import sys
import time

import wire

PATIENCE_S = 5.0


def main(service="plant/level", count="5"):
    left = int(count)
    node = wire.join("python/reader")
    # The services must outlive their ports, so both stay in variables.
    frames, layouts = wire.frames(node, service), wire.layouts(node, service)
    subscriber = frames.subscriber_builder().create()
    watcher = layouts.subscriber_builder().create()
    known = {}  # announcements by layout number
    shown = None
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
            time.sleep(0.001)
            continue
        header, values = frame.user_header().contents, wire.elements(frame, ctypes.c_double)
        sequence, layout = header.sequence, header.layout
        frame.delete()
        # A publisher announces its layout when a reader joins. Frames with layout 0 have no names.
        if layout != 0 and layout not in known and time.monotonic() < deadline:
            continue
        announced = known.get(layout, {"signals": [], "publisher": "a plain writer"})
        names = [signal["name"] for signal in announced["signals"]]
        names += [f"ch{channel}" for channel in range(len(names), len(values))]
        if shown != layout:
            print(f"{service} from {announced['publisher']}: {', '.join(names)}")
            shown = layout
        values = " ".join(f"{name}={value}" for name, value in zip(names, values))
        print(f"{sequence} {values}", flush=True)
        left -= 1
        deadline = time.monotonic() + PATIENCE_S
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main(*sys.argv[1:]))
    except KeyboardInterrupt:
        print("ended")
