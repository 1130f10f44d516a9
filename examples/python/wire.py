"""Frames and layouts of isochrone (docs/wire.md) for Python: the header, and how services are opened.

Needs nothing but iceoryx2, in exactly the version that isochrone has: pip install iceoryx2==0.10.0
"""

import ctypes
import os
import time

import iceoryx2 as iox2


class FrameHeader(ctypes.Structure):
    """The user header of a frame. iceoryx2 compares its name, size and alignment."""

    _fields_ = [
        ("sequence", ctypes.c_uint64),  # 0, 1, 2 ... per publisher; a gap is a loss
        ("cycle", ctypes.c_uint64),  # the publisher's cycle, skipped ones included
        ("release_ns", ctypes.c_uint64),  # when the cycle was due, CLOCK_MONOTONIC
        ("publish_ns", ctypes.c_uint64),  # just before the frame was sent
        ("source_ns", ctypes.c_uint64),  # of the oldest sample behind the values; 0: none
        ("missed", ctypes.c_uint64),  # cycles the publisher has lost since its start
        ("flags", ctypes.c_uint64),  # 0 in this version
        ("term", ctypes.c_uint64),  # when the publisher took the service; 0: a plain writer
        ("layout", ctypes.c_uint64),  # which layout the frame has; 0: it does not say
    ]

    @staticmethod
    def type_name() -> str:
        return "isochrone.FrameHeader.v2"


def join(name):
    """Joins the domain of the file that ICEORYX2_CONFIG names (the --iceoryx2-config of isochrone);
    without it that of config/iceoryx2.toml, or iceoryx2's default domain."""
    iox2.set_log_level(iox2.LogLevel.Error)
    builder = iox2.NodeBuilder.new().name(iox2.NodeName.new(name))
    if file := os.environ.get("ICEORYX2_CONFIG"):
        builder = builder.config(iox2.config.from_file(iox2.FilePath.new(file)))
    # Python turns a signal into KeyboardInterrupt; iceoryx2 need not catch it too.
    builder = builder.signal_handling_mode(iox2.SignalHandlingMode.Disabled)
    return builder.create(iox2.ServiceType.Ipc)


def frames(node, service):
    """The service that carries the frames."""

    def builder():
        name = iox2.ServiceName.new(service)
        return (
            node.service_builder(name)
            .publish_subscribe(iox2.Slice[ctypes.c_double])
            .user_header(FrameHeader)
        )

    return _open_or_create(builder, buffer=256, borrowed=2)


def layouts(node, service):
    """The service on which the layout of the frames is announced."""

    def builder():
        name = iox2.ServiceName.new("isochrone/layout/" + service)
        return node.service_builder(name).publish_subscribe(iox2.Slice[ctypes.c_uint8])

    return _open_or_create(builder, buffer=1, borrowed=1)


def _open_or_create(builder, buffer, borrowed):
    """Whoever opens a service takes it as it is; whoever creates one makes it as isochrone does."""
    for _ in range(100):
        try:
            return builder().open()
        except iox2.PublishSubscribeOpenError as error:
            if "DoesNotExist" not in str(error):
                raise
        try:
            return (
                builder()
                .enable_safe_overflow(True)
                .history_size(0)
                .subscriber_max_buffer_size(buffer)
                .subscriber_max_borrowed_samples(borrowed)
                .max_publishers(5)
                .max_subscribers(17)
                .max_nodes(40)
                .create()
            )
        except iox2.PublishSubscribeCreateError:
            time.sleep(0.01)  # somebody else creates it at this moment
    return builder().open()


def host():
    """What tells a reader whether its clock is that of the writer."""
    with open("/proc/sys/kernel/random/boot_id", encoding="ascii") as boot_id:
        return boot_id.read().strip()


def elements(sample, element):
    """The payload of a received sample, copied; its own len() counts bytes."""
    payload = sample.payload()
    array = element * (payload.len() // ctypes.sizeof(element))
    return array.from_buffer_copy(ctypes.string_at(payload.as_ptr(), ctypes.sizeof(array)))
