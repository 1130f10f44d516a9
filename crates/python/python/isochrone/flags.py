"""What the values of a frame are worth."""

from __future__ import annotations

import enum


class Flags(enum.IntFlag):
    """What a frame's values are worth (docs/quality.md). No flag: nothing is known to be wrong with them."""

    STALE = 1
    """A source is older than its ``max_age``, treated as bad, or its publisher has ended."""
    SUBSTITUTE = 2
    """A source reads its default, or a value on the way to it or back, instead of a sample."""
    REJECTED = 4
    """The newest sample of a source could not be taken; the one before stays."""
    FORCED = 8
    """An operator's force acts on a signal, or upstream of it."""
    UPSTREAM = 16
    """The frame that a source came from had one of the flags but FORCED and STOPPED."""
    ERROR = 32
    """A block upstream of a signal reports an error."""
    STOPPED = 64
    """The last frame: its publisher ends."""
    RESTORED = 128
    """An input began with its value of an earlier run, and no sample has come for it yet."""

    @property
    def is_in_doubt(self) -> bool:
        """Whether the values are in doubt: any flag but FORCED and STOPPED, which a node passes on as UPSTREAM."""
        return bool(int(self) & 0b1011_0111)

    @property
    def words(self) -> str:
        """The names of the flags that are set, as isochrone's programs print them: ``STALE UPSTREAM``."""
        names = {flag.value: flag.name for flag in Flags}
        bits = (bit for bit in range(64) if int(self) >> bit & 1)
        return " ".join(names.get(1 << bit) or f"BIT{bit}" for bit in bits)
