"""Frames and layouts of isochrone (docs/wire.md) for Python: the header, and opening services.

Requires iceoryx2 in the version that isochrone uses: pip install iceoryx2==0.10.0
"""

import ctypes
import os
import time

import iceoryx2 as iox2


class FrameHeader(ctypes.Structure):
    """The user header of a frame. iceoryx2 compares its name, size and alignment."""

    _fields_ = [
        ("sequence", ctypes.c_uint64),  # 0, 1, 2, ... per publisher; a gap means lost frames
        ("cycle", ctypes.c_uint64),  # the publisher's cycle, counting skipped ones
        ("release_ns", ctypes.c_uint64),  # due time of the cycle, CLOCK_MONOTONIC
        ("publish_ns", ctypes.c_uint64),  # time just before the frame was sent
        ("source_ns", ctypes.c_uint64),  # publish time of the oldest input sample; 0: none
        ("missed", ctypes.c_uint64),  # releases that the publisher has missed since its start
        ("flags", ctypes.c_uint64),  # see docs/quality.md; 0: nothing to say
        ("term", ctypes.c_uint64),  # time when the publisher took the service; 0: a plain writer
        ("layout", ctypes.c_uint64),  # number of the announced layout; 0: none announced
    ]

    @staticmethod
    def type_name() -> str:
        return "isochrone.FrameHeader.v2"


def join(name):
    """Joins the domain that the file in ICEORYX2_CONFIG selects (isochrone: --iceoryx2-config), or
    else that of config/iceoryx2.toml, or else iceoryx2's default domain."""
    iox2.set_log_level(iox2.LogLevel.Error)
    builder = iox2.NodeBuilder.new().name(iox2.NodeName.new(name))
    if file := os.environ.get("ICEORYX2_CONFIG"):
        builder = builder.config(iox2.config.from_file(iox2.FilePath.new(file)))
    # Python itself turns a signal into KeyboardInterrupt.
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
    """The service that announces the layout of the frames."""

    def builder():
        name = iox2.ServiceName.new("isochrone/layout/" + service)
        return node.service_builder(name).publish_subscribe(iox2.Slice[ctypes.c_uint8])

    return _open_or_create(builder, buffer=1, borrowed=1)


def _open_or_create(builder, buffer, borrowed):
    """Opens the service with the settings that it has, or creates it with those of isochrone."""
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
            time.sleep(0.01)  # another process is creating it
    return builder().open()


def host():
    """Identifies this boot of this machine, so that a reader knows whether it shares the clock."""
    with open("/proc/sys/kernel/random/boot_id", encoding="ascii") as boot_id:
        return boot_id.read().strip()


def elements(sample, element):
    """Copies the payload of a received sample, whose own len() counts bytes."""
    payload = sample.payload()
    array = element * (payload.len() // ctypes.sizeof(element))
    return array.from_buffer_copy(ctypes.string_at(payload.as_ptr(), ctypes.sizeof(array)))
