"""Writes a service as a link between machines does: both ends of it are in one node.

    python3 link.py SERVICE
"""

import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "examples/python/bare"))

import wire  # noqa: E402
import writer  # noqa: E402

node = wire.join("link")
port = writer.Writer(node, sys.argv[1])
reader = port.service.subscriber_builder().create()
print("linked", flush=True)
while True:
    port.send([0.0] * len(writer.SIGNALS))
    time.sleep(0.005)
