"""Prints the frames of a service: values, age, and in brackets what they are worth.

    python3 reader.py [SERVICE] [FRAMES]

Defaults: SERVICE plant/level, FRAMES 5. Exit status: 0 done, 3 no frame arrived for five seconds.
"""

import sys

from isochrone import Error, Subscriber


def main(service: str = "plant/level", count: str = "5") -> int:
    left, shown = int(count), None
    with Subscriber(service) as subscriber:
        for frame in subscriber.every(timeout=5.0):
            if frame.names != shown:
                print(f"{service} from {frame.publisher or 'a plain writer'}: {', '.join(frame.names)}")
                shown = frame.names
            if frame.lost:
                print(f"{frame.lost} frames were lost")
            values = " ".join(f"{name}={frame[name]}" for name in frame) or frame.values
            flags = f"  [{frame.flags.words}]" if frame.flags else ""
            print(f"{frame.sequence} {values}  age {1000 * frame.age:.3f} ms{flags}", flush=True)
            left -= 1
            if left == 0:
                return 0
    print(f"no frames on {service}; start its publisher in this domain")
    return 3


if __name__ == "__main__":
    try:
        sys.exit(main(*sys.argv[1:]))
    except Error as error:
        sys.exit(str(error))
    except KeyboardInterrupt:
        print("ended")
