"""Prints the frames of a service with the names that their publisher announces.

    python3 reader.py [SERVICE] [FRAMES]

SERVICE is plant/level and FRAMES 5 if left out; ICEORYX2_CONFIG=FILE chooses the domain. Exit status:
0 done, 3 nobody published for five seconds.
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
    # Ports keep their service alive; it must not go before them.
    frames, layouts = wire.frames(node, service), wire.layouts(node, service)
    subscriber = frames.subscriber_builder().create()
    watcher = layouts.subscriber_builder().create()
    known = {}  # announcements by number
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
                print(f"no frames on {service}")
                return 3
            time.sleep(0.001)
            continue
        header, values = frame.user_header().contents, wire.elements(frame, ctypes.c_double)
        sequence, layout = header.sequence, header.layout
        frame.delete()
        # The announcement comes when a reader comes; a frame that does not say has no names.
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
