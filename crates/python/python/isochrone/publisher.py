"""The frames that a program publishes."""

from __future__ import annotations

from typing import Iterable, Mapping, NamedTuple, Optional, Sequence, Union

import numpy as np
import numpy.typing as npt

from isochrone import _native
from isochrone.closing import Closing
from isochrone.flags import Flags
from isochrone.member import Member, StrPath, nanoseconds
from isochrone.pace import Release

#: The types, and the least and the greatest whole number that each holds.
RANGES: dict[str, Optional[tuple[int, int]]] = {
    "LREAL": None,
    "INT": (-32768, 32767),
    "BOOL": (0, 1),
    "TIME": (-(2**31), 2**31 - 1),
    "WORD": (0, 65535),
}

Values = Union[npt.ArrayLike, Mapping[str, float]]


class Signal(NamedTuple):
    """One value of a frame, as it is announced."""

    name: str
    """Its name, such as ``level.y``; unique in the frame."""
    type: str = "LREAL"
    """``LREAL``, ``INT``, ``BOOL``, ``TIME`` (ms) or ``WORD``."""
    unit: str = ""
    """Its unit, such as ``m``; empty if it has none. An input of a node compares it, byte for byte."""


class Publisher(Closing):
    """Publishes the frames of one service, and announces what they carry; its only writer.

    ::

        with Publisher("plant/sensor", [Signal("level", unit="m"), "ok"], period="10ms") as publisher:
            for release in Pace("10ms", offset="150us"):
                publisher.publish({"level": measure(), "ok": 1.0}, at=release)

    At the end of ``with``, or by :meth:`close`, the last values are sent once more with ``STOPPED``: readers take them as
    stale at once.

    Args:
        service: its name, such as ``plant/sensor``.
        signals: the values of a frame, in their order; a text is the name of an LREAL.
        period: the time between two frames, in seconds or as a text such as ``"10ms"``, which is announced; ``None``:
            they come as they come.
        finite: whether NaN and infinity are refused, which an input of a node rejects unless its configuration says
            otherwise.
        name: what readers and ``isochrone list`` call this program; default: the name of the script.
        domain: the configuration file of the domain; default: as ``ICEORYX2_CONFIG`` says.
        take_over: whether the service is taken over from a living writer that is not of isochrone, such as one that
            uses iceoryx2 alone.

    Raises:
        Error: somebody writes the service already, here or behind a link; it carries something else; or a name is not
            possible, such as one that begins with ``isochrone/``.

    Any thread may publish, one at a time. A forked process must open its own.
    """

    def __init__(
        self,
        service: str,
        signals: Iterable[Union[str, Signal, Sequence[str]]],
        *,
        period: Union[None, str, float] = None,
        finite: bool = True,
        name: Optional[str] = None,
        domain: Optional[StrPath] = None,
        take_over: bool = False,
    ) -> None:
        if isinstance(signals, str):
            raise TypeError(f"signals is the text {signals!r}; give a list of names")
        self.service = service
        self.signals = tuple(
            Signal(signal) if isinstance(signal, str) else Signal(*signal) for signal in signals
        )
        for signal in self.signals:
            if signal.type not in RANGES:
                there = ", ".join(RANGES)
                raise ValueError(f"{signal.name} is of type {signal.type!r}; there is: {there}")
        self.finite = finite
        self.names = tuple(signal.name for signal in self.signals)
        self._places = {name: place for place, name in enumerate(self.names)}
        self._whole = [
            (place, signal, limits)
            for place, signal in enumerate(self.signals)
            if (limits := RANGES[signal.type]) is not None
        ]
        self._last: Optional[tuple[npt.NDArray[np.float64], int, int]] = None
        period_ns = None if period is None else nanoseconds(period, "period", 1000)
        member = Member.of(name, domain, take_over)
        specs = [tuple(signal) for signal in self.signals]
        self._native = _native.FrameWriter(member, service, specs, period_ns, member.name)

    def publish(
        self,
        values: Values,
        *,
        flags: Union[Flags, int] = 0,
        source_ns: int = 0,
        at: Optional[Release] = None,
    ) -> int:
        """Sends a frame, and returns its sequence number. Never waits for a reader.

        Args:
            values: one for each signal: an array, a sequence, or a mapping with all names.
            flags: what the values are worth.
            source_ns: when the oldest sample was published that they are computed from: ``frame.source_ns``, or
                ``frame.publish_ns`` if that is 0; in ns of ``CLOCK_MONOTONIC``. 0: they are measured now.
            at: the release of a :class:`Pace` that the frame belongs to.

        Raises:
            ValueError: the values are too few or too many, or one does not fit its type, or is no finite number.
            KeyError: a name is missing or unknown.
            Closed: the publisher is closed.
        """
        array = self._array(values)
        cycle, release_ns, _, missed = (0, 0, 0, 0) if at is None else at
        sequence = self._native.send(array, int(flags), cycle, release_ns, source_ns, missed)
        self._last = (array, cycle, missed)
        return sequence

    def _array(self, values: Values) -> npt.NDArray[np.float64]:
        if isinstance(values, Mapping):
            if values.keys() != self._places.keys():
                self._refuse_names(values)
            values = [values[name] for name in self.names]
        array = np.array(values, dtype=np.float64, ndmin=1)
        if array.shape != (len(self.names),):
            raise ValueError(
                f"values have the shape {array.shape}; {self.service!r} has {len(self.names)} signals: "
                f"{', '.join(self.names)}"
            )
        if self.finite and not np.isfinite(array).all():
            place = int(np.flatnonzero(~np.isfinite(array))[0])
            raise ValueError(
                f"{self.names[place]} is {array[place]}; publish the last good value with flags=Flags.STALE, or open the "
                "publisher with finite=False"
            )
        for place, signal, (least, greatest) in self._whole:
            value = array[place]
            if not (least <= value <= greatest and float(value).is_integer()):
                raise ValueError(f"{signal.name} is {signal.type}, which cannot hold {value}")
        return array

    def _refuse_names(self, values: Mapping[str, float]) -> None:
        missing = [name for name in self.names if name not in values]
        unknown = [str(name) for name in values if name not in self._places]
        words = [f"there is no value for {', '.join(missing)}"] if missing else []
        words += [f"{self.service!r} has no signal {', '.join(unknown)}"] if unknown else []
        raise KeyError("; ".join(words))

    @property
    def readers(self) -> int:
        """How many readers the service has now."""
        return self._native.readers

    def close(self) -> None:
        """Sends the last values once more with ``STOPPED``, and leaves the service. Further calls do nothing."""
        last, self._last = self._last, None
        if last is not None:
            values, cycle, missed = last
            self._native.send(values, int(Flags.STOPPED), cycle, 0, 0, missed)
        self._native.close()

    def __repr__(self) -> str:
        return f"<Publisher of {self.service!r}: {', '.join(self.names)}>"
