"""Writes a recording of ROS 2 in MCAP, with rosbags or with mcap-ros2-support, and prints what the frames should have.

    write.py rosbags|mcap|text FOLDER MESSAGES

`text` has no numbers.
"""

import json
import struct
import sys
from pathlib import Path

import numpy
from mcap_ros2.writer import Writer as McapWriter
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

STATE = """\
# All kinds of fields
uint8 OK=0
std_msgs/Header header
bool is_on
string mode
int8 gear
float32 load
own_msgs/Axis[2] axes
float64[] samples
builtin_interfaces/Duration uptime
uint64 ticks
float64[3] gains
"""
AXIS = "float64 position\nstring name\nint16 steps\n"
HEADER = "builtin_interfaces/Time stamp\nstring frame_id\n"
TIME = "int32 sec\nuint32 nanosec\n"
SEPARATOR = "=" * 80
SCHEMA = "\n".join(
    [
        STATE + SEPARATOR,
        f"MSG: own_msgs/Axis\n{AXIS}{SEPARATOR}",
        f"MSG: std_msgs/Header\n{HEADER}{SEPARATOR}",
        f"MSG: builtin_interfaces/Time\n{TIME}{SEPARATOR}",
        f"MSG: builtin_interfaces/Duration\n{TIME}",
    ]
)
START_NS = 1_700_000_000_000_000_000
PERIOD_NS = 20_000_000


def state(number):
    """A message as a dictionary. The text of another length each time moves what stands behind it."""
    axes = [
        {"position": number / 3 + axis, "name": "n" * (number % 5), "steps": -number} for axis in range(2)
    ]
    stamp_ns = START_NS + number * PERIOD_NS - 1_500_000
    return {
        "header": {
            "stamp": {"sec": stamp_ns // 10**9, "nanosec": stamp_ns % 10**9},
            "frame_id": "base"[: number % 4],
        },
        "is_on": number % 2 == 1,
        "mode": "m" * (number % 7),
        "gear": -(number % 100),
        "load": struct.unpack("<f", struct.pack("<f", number / 7))[0],
        "axes": axes,
        "samples": [0.1] * (number % 3),
        "uptime": {"sec": number, "nanosec": 5},
        "ticks": 2**52 + number,
        "gains": [float("nan"), float("-inf"), -0.0],
    }


def expected(value, path=""):
    """The values of a frame, bit for bit, by the names of their signals."""
    if isinstance(value, dict):
        for name, part in value.items():
            if path + name not in ("header", "samples"):
                yield from expected(part, f"{path}{name}.")
    elif isinstance(value, list):
        for index, part in enumerate(value):
            yield from expected(part, f"{path}{index}.")
    elif not isinstance(value, str):
        yield path[:-1], struct.pack("<d", float(value)).hex()


def with_rosbags(folder, count):
    store = get_typestore(Stores.ROS2_JAZZY)
    for name, text in [("own_msgs/msg/Axis", AXIS), ("own_msgs/msg/State", STATE)]:
        store.register(get_types_from_msg(text, name))
    types = store.types

    def made(value, name):
        if name == "own_msgs/msg/State":
            inner = {"header": "std_msgs/msg/Header", "uptime": "builtin_interfaces/msg/Duration"}
            axes = [types["own_msgs/msg/Axis"](**axis) for axis in value["axes"]]
            parts = {key: made(value[key], type_name) for key, type_name in inner.items()}
            arrays = {key: array(value[key]) for key in ("samples", "gains")}
            return types[name](**{**value, **parts, **arrays, "axes": axes})
        if name == "std_msgs/msg/Header":
            value = {**value, "stamp": made(value["stamp"], "builtin_interfaces/msg/Time")}
        return types[name](**value)

    def array(numbers):
        return numpy.array(numbers, dtype=numpy.float64)

    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        named = [("/robot/state", "own_msgs/msg/State"), ("/chatter", "std_msgs/msg/String")]
        topic, chatter = [writer.add_connection(*it, typestore=store) for it in named]
        for number in range(count):
            time_ns = START_NS + number * PERIOD_NS
            message = made(state(number), "own_msgs/msg/State")
            writer.write(topic, time_ns, store.serialize_cdr(message, "own_msgs/msg/State"))
            text = types["std_msgs/msg/String"](data="hello")
            writer.write(chatter, time_ns, store.serialize_cdr(text, "std_msgs/msg/String"))


def with_mcap(folder, count, has_numbers=True):
    folder.mkdir()
    writer = McapWriter(str(folder / f"{folder.name}.mcap"))
    schema = writer.register_msgdef("own_msgs/msg/State", SCHEMA)
    text = writer.register_msgdef("std_msgs/msg/String", "string data\n")
    for number in range(count):
        time_ns = START_NS + number * PERIOD_NS
        if has_numbers:
            writer.write_message("/robot/state", schema, state(number), time_ns, time_ns, number)
        writer.write_message("/chatter", text, {"data": "hello"}, time_ns, time_ns, number)
    writer.finish()


def with_text(folder, count):
    with_mcap(folder, count, has_numbers=False)


library, folder, count = sys.argv[1], Path(sys.argv[2]), int(sys.argv[3])
{"rosbags": with_rosbags, "mcap": with_mcap, "text": with_text}[library](folder, count)
for number in range(count):
    print(json.dumps(dict(expected(state(number)))))
