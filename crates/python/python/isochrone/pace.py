"""The grid on which nodes release their tasks."""

from __future__ import annotations

from typing import Iterator, NamedTuple, Union

from isochrone import _native
from isochrone.member import nanoseconds


class Release(NamedTuple):
    """One release of a :class:`Pace`."""

    cycle: int
    """Its index, from 0; releases that were missed count."""
    release_ns: int
    """When it was due, ns of ``CLOCK_MONOTONIC``."""
    start_ns: int
    """When the wait for it ended, ns; never before ``release_ns``."""
    missed: int
    """How many releases were missed so far: they were over before the program waited for them."""


class Pace:
    """Waits on the grid of ``CLOCK_MONOTONIC`` on which all nodes release their tasks, whenever they were started.

    Release *n* is due at ``k * 20 ms + 0.5 ms + offset + n * period``; the grid begins after the first wait. If the
    period divides 20 ms, a frame that is published after each wait has the same distance from the releases of its
    readers at every start. Releases that are over are left out, so the program never drifts and never catches up::

        for release in Pace("10ms", offset="150us"):
            publisher.publish(measure(), at=release)

    Args:
        period: the time between two releases, in seconds, or a text such as ``"10ms"``.
        offset: how long after the releases of tasks without a ``phase``, in seconds or as a text.

    Ctrl-C ends a wait.
    """

    def __init__(self, period: Union[str, float], offset: Union[str, float] = 0.0) -> None:
        self.period_ns = nanoseconds(period, "period", 1000)
        self.offset_ns = nanoseconds(offset, "offset", 0)
        self._native = _native.Pace(self.period_ns, self.offset_ns)

    def wait(self) -> Release:
        """Waits for the next release that is not over yet."""
        return Release(*self._native.wait())

    def __iter__(self) -> Iterator[Release]:
        """One release after the other, for ever."""
        while True:
            yield self.wait()

    def __repr__(self) -> str:
        return f"Pace(period={self.period_ns / 1e9}, offset={self.offset_ns / 1e9})"
