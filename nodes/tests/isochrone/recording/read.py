"""Prints the frames of a recording as JSON: as mcap-ros2-support reads them, and as rosbags does."""

import json
import struct
import sys
from pathlib import Path

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore


def flat(message, fields, path=""):
    """The numbers of a message by the names of their fields, bit for bit."""
    for name in fields(message):
        value = getattr(message, name)
        if isinstance(value, float):
            yield f"{path}{name}", struct.pack("<d", value).hex()
        elif isinstance(value, (int, str)):
            yield f"{path}{name}", str(value)
        else:
            yield from flat(value, fields, f"{path}{name}.")


def with_mcap(file):
    def fields(message):
        return message.__slots__

    with open(file, "rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        for schema, channel, message, decoded in reader.iter_decoded_messages():
            yield {
                "topic": channel.topic,
                "type": schema.name,
                "log_time": message.log_time,
                "publish_time": message.publish_time,
                "metadata": channel.metadata,
                "fields": dict(flat(decoded, fields)),
            }


def with_rosbags(file):
    def fields(message):
        return [name for name in message.__dataclass_fields__ if name != "__msgtype__"]

    with Reader(Path(file)) as reader:
        store = get_typestore(Stores.EMPTY)
        for connection in reader.connections:
            store.register(get_types_from_msg(connection.msgdef.data, connection.msgtype))
        for connection, timestamp, data in reader.messages():
            decoded = store.deserialize_cdr(data, connection.msgtype)
            yield {
                "topic": connection.topic,
                "type": connection.msgtype,
                "log_time": timestamp,
                "fields": dict(flat(decoded, fields)),
            }


readers = {"mcap": with_mcap, "rosbags": with_rosbags}
for frame in readers[sys.argv[1]](sys.argv[2]):
    print(json.dumps(frame))
