"""What can go wrong, as exceptions whose texts say what to do about it."""

from __future__ import annotations

from typing import Any, Sequence


class Error(Exception):
    """Something failed: a service cannot be opened, a configuration has errors, another thread uses the port."""


class Closed(Error, ValueError):
    """A port was used after it had been closed."""


class MissingSignal(Error, LookupError):
    """A frame has no value for a name: its publisher announces none, or others. It may come back with this one."""


class NoAnswer(Error):
    """No such node runs, it takes no requests, it has ended, or it did not answer in time.

    In the latter case what was asked for may still be done.
    """


class Refused(Error):
    """A node refused a request. Nothing has changed.

    Attributes:
        code: the number of docs/control.md, such as 3 for a value of the wrong type, out of range or NaN.
        findings: everything that is wrong, each with ``name``, ``message`` and, mostly, ``help``; in a configuration
            also ``line`` and ``column``.
    """

    def __init__(self, message: str, code: int = 0, findings: Sequence[dict[str, Any]] = ()) -> None:
        super().__init__(message)
        self.code = code
        self.findings = list(findings)


class IncompleteRecording(UserWarning):
    """A recording was not closed, or is damaged: it is not all that its recorder received."""
