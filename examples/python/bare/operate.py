"""Looks at and changes a running node: the calls of `isochrone/<node>/control`, with nothing but iceoryx2.

    python3 operate.py NODE list [GLOB]
    python3 operate.py NODE get NAME...
    python3 operate.py NODE set NAME=VALUE... [--at CYCLE]
    python3 operate.py NODE force NAME=VALUE... --seconds SECONDS

The node reads a VALUE as it is written: true, 0.5, 16#8F00, or T#100ms where it is a time. CYCLE is its number, or
+500: in 500 cycles. ICEORYX2_CONFIG=FILE selects the domain. Exit status: 0 done, 1 refused, 2 usage, 3 no such node
or no answer.
"""

import ctypes
import json
import sys
import time
import uuid

import iceoryx2 as iox2
import wire

MAX_MESSAGE_BYTES = 256 * 1024
PATIENCE_S = 5.0


class Refused(Exception):
    """The node said no: the `error` of its answer, with all findings in `data`."""

    def __init__(self, error):
        findings = error.get("data", [])
        lines = ["; ".join(filter(None, (one["message"], one.get("help")))) for one in findings]
        super().__init__("\n".join(lines) or error["message"])
        self.code = error["code"]
        self.findings = findings


class NoAnswer(Exception):
    """No such node takes requests, or it did not answer."""


class Node:
    """A node that runs, asked one request at a time."""

    def __init__(self, name):
        self.name = name
        # The participant and the service must outlive the port, so all stay in members.
        self.participant = wire.join("python/operate")
        service = iox2.ServiceName.new(f"isochrone/{name}/control")
        builder = self.participant.service_builder(service)
        bytes_type = iox2.Slice[ctypes.c_uint8]
        try:
            self.service = builder.request_response(bytes_type, bytes_type).open()
        except iox2.RequestResponseOpenError as error:
            raise NoAnswer(f'no node "{name}" takes requests here ({error})') from error
        ports = self.service.client_builder()
        # As much memory as three requests need; without a limit it would be five.
        ports = ports.initial_max_slice_len(MAX_MESSAGE_BYTES)
        self.client = ports.allocation_strategy(iox2.AllocationStrategy.Static).create()

    def call(self, method, **params):
        """Asks, and returns the result; raises Refused or NoAnswer."""
        # Answers are recognised by the id: a late one may be another client's.
        request_id = str(uuid.uuid4())
        request = {"jsonrpc": "2.0", "id": request_id, "method": method, "params": params}
        text = json.dumps(request, allow_nan=False).encode()
        if len(text) > MAX_MESSAGE_BYTES:
            raise ValueError(f"a request of {len(text)} bytes; at most {MAX_MESSAGE_BYTES}")
        loaned = self.client.loan_slice_uninit(len(text))
        ctypes.memmove(loaned.payload().as_ptr(), text, len(text))
        pending = loaned.assume_init().send()
        try:
            deadline = time.monotonic() + PATIENCE_S
            while time.monotonic() < deadline:
                response = pending.receive()
                if response is None:
                    time.sleep(0.001)  # iceoryx2 has no way to sleep until an answer comes
                    continue
                answer = json.loads(bytes(wire.elements(response, ctypes.c_uint8)))
                response.delete()
                if answer["id"] != request_id:
                    continue
                if "error" in answer:
                    raise Refused(answer["error"])
                return answer["result"]
        finally:
            pending.delete()
        raise NoAnswer(f'node "{self.name}" did not answer within {PATIENCE_S} s')

    def signals(self, pattern=None):
        """All signals, page by page."""
        params = {} if pattern is None else {"match": pattern}
        signals = []
        while True:
            page = self.call("signals", offset=len(signals), **params)
            signals += page["signals"]
            if not page["signals"] or len(signals) >= page["total"]:
                return signals


def number(text):
    """A number as JSON has it; what is none stays a string, of which the node says what is wrong with it."""
    try:
        return json.loads(text)
    except ValueError:
        return text


def pairs(arguments):
    """NAME=VALUE... as an object."""
    if not arguments or not all("=" in argument for argument in arguments):
        raise SystemExit(usage())
    return dict(argument.split("=", 1) for argument in arguments)


def option(arguments, name):
    """Takes `name VALUE` out of the arguments."""
    if name not in arguments:
        return None
    at = arguments.index(name)
    if at + 1 == len(arguments):
        raise SystemExit(usage())
    text = arguments.pop(at + 1)
    arguments.pop(at)
    return number(text)


def usage():
    print(__doc__.strip(), file=sys.stderr)
    return 2


def main(arguments):
    if len(arguments) < 2:
        return usage()
    name, verb, *rest = arguments
    if verb not in ("list", "get", "set", "force"):
        return usage()
    at, seconds = option(rest, "--at"), option(rest, "--seconds")
    try:
        node = Node(name)
        if verb == "list":
            for signal in node.signals(*rest[:1]):
                mark = " forced" if signal["forced"] else ""
                print(f"{signal['name']} {signal['type']} {signal['role']}{mark}")
        elif verb == "get":
            for signal, now in node.call("get", names=rest)["values"].items():
                print(f"{signal}={now}")
        else:
            params = {"values": pairs(rest), "client": "python/operate"}
            if at is not None:
                params["at"] = at
            if verb == "force":
                if seconds is None:
                    return usage()
                params["seconds"] = seconds
            done = node.call(verb, **params)
            tasks = done["tasks"].items()
            cycles = (
                f"{task} {part['cycle']}" + (" (to come)" if part.get("pending") else "")
                for task, part in tasks
            )
            print(f"transaction {done['transaction']} in cycle: {', '.join(cycles)}")
            for signal, before in done["before"].items():
                print(f"{signal}: {before} -> {done['after'].get(signal)}")
    except Refused as refused:
        print(f"refused ({refused.code}): {refused}", file=sys.stderr)
        return 1
    except NoAnswer as silence:
        print(silence, file=sys.stderr)
        return 3
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
