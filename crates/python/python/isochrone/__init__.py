"""isochrone from Python: the frames of services, running nodes, simulations and recordings.

- :class:`Publisher` and :class:`Subscriber` write and read the frames of a service.
- :class:`Pace` keeps a program on the grid on which all nodes release their tasks.
- :class:`Node` looks at a running node, and changes it.
- :func:`simulate` steps a configuration without a clock, from arrays to arrays.
- :func:`read` gives a recording as arrays.

Values are ``float64``, which represents INT, BOOL, TIME (ms) and WORD exactly. Times are in seconds, or in nanoseconds
where a name ends in ``_ns``; those of frames are of ``CLOCK_MONOTONIC``, as ``time.monotonic_ns()`` reads it.

The environment variable ``ICEORYX2_CONFIG`` names the configuration file of the domain to join, as it does for
isochrone's own programs; or say ``domain=FILE``.
"""

from isochrone._native import __version__
from isochrone.errors import Closed, Error, IncompleteRecording, MissingSignal, NoAnswer, Refused
from isochrone.flags import Flags
from isochrone.frame import Frame
from isochrone.node import Change, Node, Trace, Values
from isochrone.pace import Pace, Release
from isochrone.publisher import Publisher, Signal
from isochrone.recording import Recording, read
from isochrone.simulation import simulate
from isochrone.subscriber import Subscriber

__all__ = [
    "Change",
    "Closed",
    "Error",
    "Flags",
    "Frame",
    "IncompleteRecording",
    "MissingSignal",
    "NoAnswer",
    "Node",
    "Pace",
    "Publisher",
    "Recording",
    "Refused",
    "Release",
    "Signal",
    "Subscriber",
    "Trace",
    "Values",
    "__version__",
    "read",
    "simulate",
]
