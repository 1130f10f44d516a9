"""Looks at and changes a running node.

    python3 operate.py NODE list [GLOB]
    python3 operate.py NODE get NAME...
    python3 operate.py NODE set NAME=VALUE... [--at CYCLE]
    python3 operate.py NODE force NAME=VALUE... --seconds SECONDS
    python3 operate.py NODE trace NAME... --seconds SECONDS

The node reads a VALUE as it is written: true, 0.5, 16#8F00, or T#100ms where it is a time. CYCLE is its number, or
+500: in 500 cycles. Exit status: 0 done, 1 refused, 2 usage, 3 no such node or no answer.
"""

import argparse
import sys

from isochrone import Error, NoAnswer, Node


def pair(text: str) -> "tuple[str, str]":
    name, equals, value = text.partition("=")
    if not equals:
        raise argparse.ArgumentTypeError(f"{text!r} is not NAME=VALUE")
    return name, value


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("node")
    verbs = parser.add_subparsers(dest="verb", required=True)
    verbs.add_parser("list").add_argument("glob", nargs="?")
    verbs.add_parser("get").add_argument("names", nargs="+")
    change = verbs.add_parser("set")
    change.add_argument("values", nargs="+", type=pair)
    change.add_argument("--at", type=lambda text: text if text.startswith("+") else int(text))
    force = verbs.add_parser("force")
    force.add_argument("values", nargs="+", type=pair)
    force.add_argument("--seconds", type=float, required=True)
    trace = verbs.add_parser("trace")
    trace.add_argument("names", nargs="+")
    trace.add_argument("--seconds", type=float, required=True)
    return parser.parse_args()


def main(args: argparse.Namespace) -> None:
    with Node(args.node) as node:
        if args.verb == "list":
            for signal in node.signals(args.glob):
                forced = " forced" if signal["forced"] else ""
                print(f"{signal['name']} {signal['type']} {signal['role']}{forced}")
        elif args.verb == "get":
            values = node.values(*args.names)
            for name, value in values.items():
                flags = f"  [{values.flags[name].words}]" if name in values.flags else ""
                print(f"{name}={value}{flags}")
        elif args.verb == "trace":
            trace = node.trace(args.names, seconds=args.seconds)
            print("cycle", *trace)
            for cycle, *row in zip(trace.cycle, *trace.values()):
                print(cycle, *row)
        else:
            if args.verb == "set":
                done = node.set(dict(args.values), at=args.at)
            else:
                done = node.force(dict(args.values), seconds=args.seconds)
            cycles = ", ".join(f"{task} {cycle}" for task, cycle in done.cycles.items())
            to_come = " (to come)" if done.pending else ""
            print(f"transaction {done.transaction} in cycle: {cycles}{to_come}")
            for name, before in done.before.items():
                print(f"{name}: {before} -> {done.after.get(name)}")


if __name__ == "__main__":
    try:
        main(arguments())
    except NoAnswer as silence:
        print(silence, file=sys.stderr)
        sys.exit(3)
    except Error as refused:
        print(refused, file=sys.stderr)
        sys.exit(1)
