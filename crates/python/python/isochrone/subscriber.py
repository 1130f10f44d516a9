"""The frames of a service, as a program reads them."""

from __future__ import annotations

import functools
from contextlib import contextmanager
from typing import Iterable, Iterator, Optional

from isochrone import _native
from isochrone.closing import Closing
from isochrone.frame import Frame, Layout
from isochrone.member import Member, StrPath


class Subscriber(Closing):
    """Reads the frames of one service, which need not exist yet.

    ::

        with Subscriber("plant/level", ["level.y"]) as level:
            for frame in level:
                print(frame.sequence, frame["level.y"], frame.age, frame.flags)

    It follows one publisher at a time, and changes over as every reader of isochrone does (docs/wire.md). Frames wait for
    it, as many as the service has room for: up to 256.

    Args:
        service: its name, such as ``plant/level``.
        names: the signals that are wanted, in this order; default: all, as the publisher announces them.
        name: what ``isochrone list`` calls this program; default: the name of the script.
        domain: the configuration file of the domain; default: as ``ICEORYX2_CONFIG`` says.

    Raises:
        Error: the name is not possible, or the service carries something else or has no place left.

    Any thread may read, one at a time. A forked process must open its own.
    """

    def __init__(
        self,
        service: str,
        names: Optional[Iterable[str]] = None,
        *,
        name: Optional[str] = None,
        domain: Optional[StrPath] = None,
    ) -> None:
        if isinstance(names, str):
            raise TypeError(f"names is the text {names!r}; give a list of names")
        wanted = [] if names is None else list(names)
        self._wants_all = not wanted
        layout = functools.partial(Layout, bool(wanted))
        self.service = service
        self._last: Optional[Frame] = None
        member = Member.of(name, domain)
        self._native = _native.FrameReader(member, service, wanted, layout)

    def wait(self, timeout: Optional[float] = None) -> Optional[Frame]:
        """The next frame in line. Waits for one up to ``timeout`` seconds, or for ever; ``None``: none came.

        Other threads run meanwhile, and Ctrl-C ends the wait.
        """
        given = self._native.wait(timeout)
        if given is None:
            return None
        self._last = Frame(*given)
        return self._last

    def newest(self) -> Optional[Frame]:
        """The newest frame, without waiting: one that came, or else the one that was returned last. ``None``: there was
        none yet. Its ``age`` grows until a newer one comes; ``lost`` counts lost frames, not those that were passed over.
        """
        given = self._native.newest()
        if given is not None:
            self._last = Frame(*given)
        return self._last

    def every(self, timeout: Optional[float] = None) -> Iterator[Frame]:
        """Every frame, one after the other, until none has come for ``timeout`` seconds."""
        while (frame := self.wait(timeout)) is not None:
            yield frame

    def __iter__(self) -> Iterator[Frame]:
        """Every frame, one after the other, for ever."""
        return self.every()

    @contextmanager
    def view(self, timeout: Optional[float] = None) -> Iterator[Optional[Frame]]:
        """The next frame in line, with all of its values, where it lies in shared memory; ``None`` as with :meth:`wait`.

        ::

            with level.view() as frame:
                mean = frame.values.mean()

        Nothing is copied, so the array is read-only, and only good within ``with``: the publisher lends two frames at
        most. The subscriber receives no other frame meanwhile.

        Raises:
            ValueError: the subscriber was opened for some signals only.
            BufferError: at the end of ``with`` a name still refers to the array, or to a part of it. It stays valid; the
                subscriber receives nothing until it is gone.
        """
        if not self._wants_all:
            raise ValueError("a view has all values of a frame; open the subscriber without names for it")
        given = self._native.lend(timeout)
        if given is None:
            yield None
            return
        frame = Frame(*given)
        del given
        try:
            yield frame
        finally:
            frame._values = frame._values[:0].copy()
        if self._native.is_lent:
            raise BufferError(
                f"an array of a frame of {self.service!r} outlives its `with`: keep a copy (.copy()), or delete it before"
            )

    def close(self) -> None:
        """Leaves the service. Further calls do nothing."""
        self._native.close()

    def __repr__(self) -> str:
        return f"<Subscriber of {self.service!r}>"
