"""A frame that was received."""

from __future__ import annotations

from typing import Iterator, NamedTuple, Optional, Sequence, Union

import numpy as np
import numpy.typing as npt

from isochrone import _native
from isochrone.errors import Closed, MissingSignal
from isochrone.flags import Flags

Value = Union[bool, int, float]


class Described(NamedTuple):
    """What is known of a layout; made by the native part."""

    names: list[str]
    types: list[str]
    units: list[str]
    publisher: Optional[str]
    period_ns: Optional[int]
    is_here: bool
    error: Optional[str]


class Layout:
    """What the values of some frames are."""

    __slots__ = (
        "error",
        "is_here",
        "names",
        "period_ns",
        "places",
        "publisher",
        "types",
        "units",
        "unnamed",
    )

    def __init__(self, wanted: bool, described: dict[str, object]) -> None:
        given = Described(**described)  # type: ignore[arg-type]
        self.names = tuple(given.names)
        self.types = tuple(given.types)
        self.units = tuple(given.units)
        self.publisher = given.publisher
        self.period_ns = given.period_ns
        self.is_here = given.is_here
        self.error = given.error
        # Values without names serve those who asked for none.
        self.unnamed = not wanted and given.publisher is None
        self.places = {name: place for place, name in enumerate(self.names)}


def typed(value: float, value_type: str) -> Value:
    """A value as Python has it: a bool for a BOOL, an int for INT, TIME and WORD."""
    if value_type == "BOOL":
        return bool(value)
    if value_type in ("INT", "TIME", "WORD") and float(value).is_integer():
        return int(value)
    return float(value)


class Frame:
    """One frame of a service: a consistent snapshot of one cycle of its publisher.

    ``frame["level.y"]`` is a value by its name: a ``bool`` for a BOOL, an ``int`` for INT, TIME (ms) and WORD, else a
    ``float``. ``dict(frame)`` has all of them, and ``frame.values`` is the array, in the order of ``frame.names``.
    """

    __slots__ = (
        "_layout",
        "_values",
        "cycle",
        "flags",
        "lost",
        "missed",
        "publish_ns",
        "received_ns",
        "release_ns",
        "restarts",
        "sampled_ns",
        "sequence",
        "source_ns",
        "term",
    )

    sequence: int
    """The frame's number: 0, 1, 2 … of one publisher."""
    cycle: int
    """The publisher's cycle, skipped ones included."""
    release_ns: int
    """When the cycle was due, ns of the publisher's ``CLOCK_MONOTONIC``; 0: it does not say."""
    publish_ns: int
    """When the frame was sent, ns of the publisher's clock."""
    source_ns: int
    """When the oldest sample behind the values was published, ns; 0: there is none."""
    missed: int
    """Cycles that the publisher has missed since its start."""
    flags: Flags
    """What the values are worth."""
    term: int
    """When the publisher took the service over, Unix ns; 0: a plain writer."""
    received_ns: int
    """When the frame was received, ns of ``time.monotonic_ns()``."""
    sampled_ns: int
    """From when on the values age, ns of ``time.monotonic_ns()``: ``publish_ns``, or ``received_ns`` where the frame
    was stamped by another clock."""
    lost: int
    """Frames that were lost between the one received before and this one."""
    restarts: int
    """How often the publisher has restarted, or was replaced, between the two."""

    def __init__(
        self, values: npt.NDArray[np.float64], layout: Layout, numbers: Sequence[int]
    ) -> None:
        self._values = values
        self._layout = layout
        (
            self.sequence,
            self.cycle,
            self.release_ns,
            self.publish_ns,
            self.source_ns,
            self.missed,
            flags,
            self.term,
            self.received_ns,
            self.sampled_ns,
            self.lost,
            self.restarts,
        ) = numbers
        self.flags = Flags(flags)

    @property
    def values(self) -> npt.NDArray[np.float64]:
        """The values as an array of ``float64``, in the order of :attr:`names`. Those of a publisher that announces no
        names come in the order of its frame.

        Raises:
            MissingSignal: the subscriber asked for names, and the frame does not have one of them.
        """
        if self._layout.error is not None and not self._layout.unnamed:
            raise MissingSignal(self._layout.error)
        return self._values

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the signals: those that the subscriber asked for, or all. Empty: none are announced."""
        return self._layout.names

    @property
    def types(self) -> tuple[str, ...]:
        """Their types: ``LREAL``, ``INT``, ``BOOL``, ``TIME``, ``WORD``, or an empty text where it is unknown."""
        return self._layout.types

    @property
    def units(self) -> tuple[str, ...]:
        """Their units, such as ``m``; an empty text where none is announced."""
        return self._layout.units

    @property
    def publisher(self) -> Optional[str]:
        """Who publishes the frames; ``None``: nobody announces them."""
        return self._layout.publisher

    @property
    def period_ns(self) -> Optional[int]:
        """The time between two frames, ns; ``None``: none is announced."""
        return self._layout.period_ns

    @property
    def age_ns(self) -> int:
        """How old the values are now, ns."""
        return max(0, _native.now_ns() - self.sampled_ns)

    @property
    def age(self) -> float:
        """How old the values are now, in seconds."""
        return self.age_ns / 1e9

    @property
    def is_of_this_clock(self) -> bool:
        """Whether the publisher's stamps are of this machine's clock. Otherwise the age counts from the arrival."""
        return self._layout.is_here and self.sampled_ns == self.publish_ns

    def keys(self) -> tuple[str, ...]:
        """The names, so that ``dict(frame)`` works."""
        if self._layout.error is not None:
            raise MissingSignal(self._layout.error)
        return self._layout.names

    def __getitem__(self, name: str) -> Value:
        place = self._layout.places.get(name)
        if place is None:
            if self._layout.error is not None:
                raise MissingSignal(self._layout.error)
            there = ", ".join(self._layout.names)
            raise MissingSignal(f"the frame has no signal {name!r}; there is: {there}")
        if place >= len(self._values):
            raise Closed(f"the view with {name!r} ended with its `with`; keep what is needed of it")
        return typed(self._values[place], self._layout.types[place])

    def __contains__(self, name: object) -> bool:
        return name in self._layout.places

    def __iter__(self) -> Iterator[str]:
        return iter(self._layout.names)

    def __len__(self) -> int:
        return len(self._values)

    def __repr__(self) -> str:
        if self._layout.names:
            pairs = zip(self._layout.names, self._values.tolist())
            values = " ".join(f"{name}={value}" for name, value in pairs)
        else:
            values = str(self._values.tolist())
        flags = f" [{self.flags.words}]" if self.flags else ""
        return f"<Frame {self.sequence}: {values}{flags}>"
