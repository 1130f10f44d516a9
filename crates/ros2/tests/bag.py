"""Writes a recording of ROS 2 with rosbags, reads it again, and prints each message as a line of JSON.

    bag.py FOLDER MESSAGES
"""

import json
import sys
from pathlib import Path

import numpy
from rosbags.rosbag2 import Reader, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

IMU = "sensor_msgs/msg/Imu"
store = get_typestore(Stores.ROS2_JAZZY)
types = store.types


def made(number):
    """A message whose values have all their bits."""
    vector = types["geometry_msgs/msg/Vector3"]
    stamp = types["builtin_interfaces/msg/Time"](sec=1_700_000_000, nanosec=number)
    values = numpy.sin(numpy.arange(9) + number) * 10.0 ** (number % 300 - 150)
    return types[IMU](
        header=types["std_msgs/msg/Header"](stamp=stamp, frame_id="base"[: number % 5]),
        orientation=types["geometry_msgs/msg/Quaternion"](x=-0.0, y=number / 3, z=1e-320, w=float("inf")),
        orientation_covariance=values,
        angular_velocity=vector(x=float(number), y=number / 7, z=-number / 11),
        angular_velocity_covariance=values[::-1].copy(),
        linear_acceleration=vector(x=values[0], y=values[1], z=values[2]),
        linear_acceleration_covariance=numpy.full(9, number * 0.1),
    )


def plain(value):
    """A message as what JSON has."""
    if isinstance(value, numpy.ndarray):
        return value.tolist()
    fields = [name for name in getattr(value, "__dataclass_fields__", {}) if name != "__msgtype__"]
    return {name: plain(getattr(value, name)) for name in fields} if fields else value


folder, count = Path(sys.argv[1]), int(sys.argv[2])
with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
    topic = writer.add_connection("/imu", IMU, typestore=store)
    for number in range(count):
        writer.write(topic, 1_700_000_000_000_000_000 + number * 5_000_000, store.serialize_cdr(made(number), IMU))
with Reader(folder) as reader:
    for _, _, data in reader.messages():
        print(json.dumps(plain(store.deserialize_cdr(data, IMU))))
