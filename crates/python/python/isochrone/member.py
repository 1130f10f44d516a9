"""What this process is in a domain."""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path
from typing import NamedTuple, Optional, Union

StrPath = Union[str, "os.PathLike[str]"]


class Member(NamedTuple):
    """Its name, the configuration file of the domain, and whether it takes services over."""

    name: str
    domain: Optional[str]
    take_over: bool

    @classmethod
    def of(cls, name: Optional[str], domain: Optional[StrPath], take_over: bool = False) -> Member:
        """As a port was told; without a name, that of the script."""
        path = None if domain is None else os.fspath(domain)
        return cls(script() if name is None else name, path, take_over)


def script() -> str:
    """The name of the program: ``sensor`` for ``sensor.py``; ``python`` where there is no script."""
    stem = Path(sys.argv[0]).stem if sys.argv else ""
    return stem if re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,100}", stem) else "python"


def nanoseconds(value: Union[str, float], what: str, least_ns: int) -> int:
    """A duration in seconds, or as a configuration has it, such as ``10ms``."""
    from isochrone import _native

    if isinstance(value, str):
        try:
            ns = _native.duration_ns(value)
        except ValueError as error:
            raise ValueError(f"{what} {value!r}: {error}") from None
    elif isinstance(value, bool) or not isinstance(value, (int, float)):
        raise TypeError(f"{what} is {value!r}; give seconds, or a text such as '10ms'")
    elif not 0 <= value < 1e9:
        raise ValueError(f"{what} is {value!r}; give seconds from 0, or a text such as '10ms'")
    else:
        ns = round(value * 1e9)
    if ns < least_ns:
        raise ValueError(f"{what} is {ns} ns; it is at least {least_ns} ns")
    return ns
