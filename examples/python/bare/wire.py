"""Frames and layouts of isochrone (docs/wire.md) for Python: the header, the grid, and opening services.

Requires iceoryx2 in the version that isochrone uses: pip install iceoryx2==0.10.0
"""

import ctypes
import functools
import os
import time

import iceoryx2 as iox2

# What the bits of a header's word `flags` stand for (docs/quality.md).
FLAGS = ["STALE", "SUBSTITUTE", "REJECTED", "FORCED", "UPSTREAM", "ERROR", "STOPPED", "RESTORED"]
STOPPED = 1 << FLAGS.index("STOPPED")

# The grid on which nodes release their tasks begins anew at each multiple of 20 ms, half a millisecond
# off the kernel's ticks.
GRID_NS = 20_000_000
GRID_OFFSET_NS = 500_000


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

    return _open_or_create(builder, buffer=256, borrowed=2, readers=16)


def layouts(node, service):
    """The service that announces the layout of the frames."""

    def builder():
        name = iox2.ServiceName.new("isochrone/layout/" + service)
        return node.service_builder(name).publish_subscribe(iox2.Slice[ctypes.c_uint8])

    return _open_or_create(builder, buffer=1, borrowed=1, readers=64)


def _open_or_create(builder, buffer, borrowed, readers):
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
                .max_subscribers(readers + 1)
                .max_nodes(readers + 24)
                .create()
            )
        except iox2.PublishSubscribeCreateError:
            time.sleep(0.01)  # another process is creating it
    return builder().open()


def next_epoch_ns(earliest_ns):
    """The first instant from earliest_ns on, on CLOCK_MONOTONIC, at which the grid of a node may begin. Whoever
    begins there, with a period that divides 20 ms, shares the grid of all nodes."""
    return -(-earliest_ns // GRID_NS) * GRID_NS + GRID_OFFSET_NS


def flag_words(flags):
    """The names of the flags that are set, and BIT8 and so on for those that have none yet."""
    bits = (bit for bit in range(64) if flags >> bit & 1)
    return [FLAGS[bit] if bit < len(FLAGS) else f"BIT{bit}" for bit in bits]


def age_ns(header, announced, now_ns):
    """How old a frame is, or None if its stamps are of another clock."""
    is_far = announced.get("host", host()) != host()
    return None if is_far or header.publish_ns > now_ns else now_ns - header.publish_ns


@functools.cache
def host():
    """Identifies this boot of this machine, so that a reader knows whether it shares the clock."""
    with open("/proc/sys/kernel/random/boot_id", encoding="ascii") as boot_id:
        return boot_id.read().strip()


def elements(sample, element):
    """Copies the payload of a received sample, whose own len() counts bytes."""
    payload = sample.payload()
    array = element * (payload.len() // ctypes.sizeof(element))
    return array.from_buffer_copy(ctypes.string_at(payload.as_ptr(), ctypes.sizeof(array)))
