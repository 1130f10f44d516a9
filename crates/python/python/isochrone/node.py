"""A running node, as a program operates it."""

from __future__ import annotations

import json
import math
import os
from typing import Any, Iterable, Iterator, Mapping, NamedTuple, Optional, Union

import numpy as np
import numpy.typing as npt

from isochrone import _native
from isochrone.closing import Closing
from isochrone.errors import Closed, MissingSignal
from isochrone.flags import Flags
from isochrone.frame import Value
from isochrone.member import Member, StrPath, nanoseconds

Given = Union[bool, int, float, str]


class Values(dict[str, Value]):
    """Values by the names of signals, all of one task of one cycle.

    Attributes:
        flags: by name, what a value is worth, as the flags of a frame with this signal alone; only those with flags.
            Empty also where the node cannot tell.
        cycles: by task, the cycle that the values were read after.
    """

    def __init__(self, values: dict[str, Value], flags: dict[str, Flags], cycles: dict[str, int]) -> None:
        super().__init__(values)
        self.flags = flags
        self.cycles = cycles


class Change(NamedTuple):
    """What a request has changed."""

    transaction: int
    """Its number, for :meth:`Node.undo`."""
    cycles: dict[str, int]
    """By task, the first cycle with the new values."""
    pending: bool
    """Whether a cycle is still to come."""
    before: dict[str, Value]
    """The values before, by name."""
    after: dict[str, Value]
    """The values now."""
    warnings: list[str]
    """What is worth knowing: a block will report an error with these values, a force holds another one."""


class Trace(Mapping[str, npt.NDArray[np.float64]]):
    """Every cycle of some signals of a task: ``trace["ramp.value"]`` has the value after each.

    Attributes:
        task: the task.
        period_ns: from release to release, ns.
        cycle: the index of each cycle, ``int64``.
        release_ns: when each was due, ns of ``CLOCK_MONOTONIC``, ``int64``.
        time_s: the same in seconds after the first.
        lost: cycles that ran and are not in the trace.
        missed: cycles that the node missed meanwhile.
        units: by name, a signal's unit; an empty text for none.
    """

    def __init__(self, traced: dict[str, Any]) -> None:
        self._values: dict[str, npt.NDArray[np.float64]] = traced["values"]
        self.task: str = traced["task"]
        self.period_ns: int = traced["period_ns"]
        self.cycle: npt.NDArray[np.int64] = traced["cycle"].view(np.int64)
        self.release_ns: npt.NDArray[np.int64] = traced["release_ns"].view(np.int64)
        first = self.release_ns[:1]
        self.time_s: npt.NDArray[np.float64] = (self.release_ns - first) / 1e9
        self.lost: int = traced["lost"]
        self.missed: int = traced["missed"]
        self.units: dict[str, str] = dict(zip(self._values, traced["units"]))

    def __getitem__(self, name: str) -> npt.NDArray[np.float64]:
        return self._values[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        """How many signals there are."""
        return len(self._values)

    def __repr__(self) -> str:
        return f"<Trace of {len(self.cycle)} cycles of {self.task!r}: {', '.join(self._values)}>"


class Node(Closing):
    """Looks at a running node, and changes it.

    ::

        with Node("level") as level:
            print(level.get("ramp.delayedValue"), level.alarms())
            level.set({"ramp.setChangeRate": 5.0}, comment="too fast")
            trace = level.trace(["ramp.*"], seconds=2)

    Args:
        node: its name, as ``isochrone list`` shows it.
        timeout: how long to wait for an answer, in seconds.
        name: what its journal calls this program; default: the name of the script.
        domain: the configuration file of the domain; default: as ``ICEORYX2_CONFIG`` says.

    Each method raises :class:`Refused` if the node refuses, and :class:`NoAnswer` if it does not run or answer. What it
    answers, and which changes its configuration allows, is in docs/control.md. Other threads run meanwhile, and Ctrl-C
    ends the wait; what was asked for may still be done then.
    """

    def __init__(
        self,
        node: str,
        *,
        timeout: float = 5.0,
        name: Optional[str] = None,
        domain: Optional[StrPath] = None,
    ) -> None:
        nanoseconds(timeout, "timeout", 1_000_000)
        self.node = node
        self._timeout = float(timeout)
        self._member = Member.of(name, domain)
        self._acts = False
        self._client: Optional[_native.Client] = self._connect(False)

    def _connect(self, acts: bool) -> _native.Client:
        return _native.Client(self._member, self.node, self._timeout, acts)

    def call(self, method: str, **params: Any) -> dict[str, Any]:
        """Calls a method of docs/control.md with its parameters, and returns its result."""
        text = json.dumps(params, default=_plain, allow_nan=False)
        if self._client is None:
            raise Closed(f"the client of node {self.node!r} is closed")
        if not self._acts and _native.Client.changes(method):
            # A place among those that are kept for clients which change something.
            acting = self._connect(True)
            self._client.close()
            self._client, self._acts = acting, True
        result: dict[str, Any] = json.loads(self._client.call(method, text))
        return result

    def _pages(self, method: str, items: str, **params: Any) -> list[dict[str, Any]]:
        found: list[dict[str, Any]] = []
        while True:
            page = self.call(method, offset=len(found), **params)
            found += page[items]
            if not page[items] or len(found) >= page["total"]:
                return found

    def describe(self) -> dict[str, Any]:
        """What the node is: its tasks, their timing, its configuration."""
        return self.call("describe")

    def signals(self, match: Optional[str] = None) -> list[dict[str, Any]]:
        """The signals that a name or a glob matches, or all: ``name``, ``type``, ``unit``, ``role``, ``task`` …"""
        return self._pages("signals", "signals", match=match)

    def values(self, *names: str) -> Values:
        """The values of names and globs, such as ``ramp.*``. If there are more than 4096, they are of several cycles."""
        values: dict[str, Value] = {}
        flags: dict[str, Flags] = {}
        cycles: dict[str, int] = {}
        while True:
            page = self.call("get", names=list(names), offset=len(values), types=True)
            values.update(_values(page["values"], page.get("types") or {}))
            for name, words in (page.get("quality") or {}).items():
                flags[name] = _flags(words)
            cycles.update((task, read["cycle"]) for task, read in page["tasks"].items())
            if not page["values"] or len(values) >= page["total"]:
                return Values(values, flags, cycles)

    def get(self, name: str) -> Value:
        """The value of one signal: a ``bool`` for a BOOL, an ``int`` for INT, TIME (ms) and WORD, else a ``float``."""
        values = self.values(name)
        if name not in values:
            raise MissingSignal(f"{name!r} is no name of one signal; use values() for globs")
        return values[name]

    def set(
        self,
        values: Mapping[str, Given],
        *,
        at: Union[None, int, str] = None,
        comment: Optional[str] = None,
    ) -> Change:
        """Sets parameters and variables: all of them in one cycle of their task, or none.

        Args:
            values: by name; a text is a value as people write it, such as ``"T#100ms"`` or ``"16#8F00"``.
            at: the cycle to take effect before: its number, or ``"+500"``: 500 cycles after the next; at most 10 s ahead.
            comment: why, for the journal.
        """
        return self._change("set", values=_given(values), at=at, comment=comment)

    def force(
        self,
        values: Mapping[str, Given],
        *,
        seconds: Optional[float],
        at: Union[None, int, str] = None,
        comment: Optional[str] = None,
    ) -> Change:
        """Holds signals at values, all from one cycle on, for so many ``seconds``; ``None``: until they are released."""
        params = {"values": _given(values), "at": at, "comment": comment}
        done = self.call("force", seconds=seconds, client=self._member.name, **params)
        return _change(done)

    def release(self, *names: str) -> Change:
        """Ends forces, by the names and globs of their signals."""
        return self._change("release", names=list(names))

    def undo(self, transaction: int) -> Change:
        """Takes back a :meth:`set`, by the number of its transaction."""
        return self._change("undo", transaction=transaction)

    def _change(self, method: str, **params: Any) -> Change:
        return _change(self.call(method, client=self._member.name, **params))

    def forces(self) -> list[dict[str, Any]]:
        """The forces in place: ``name``, ``value``, ``since_cycle``, ``until_cycle``, ``client``."""
        return self._pages("forces", "forces")

    def alarms(self) -> list[dict[str, Any]]:
        """What is wrong with the node itself: ``name``, ``meaning``, ``task``, ``since_cycle``, ``count`` …"""
        return self._all_alarms()[0]

    def process_alarms(self) -> list[dict[str, Any]]:
        """The process alarms that stand or that nobody has acknowledged: ``name``, ``severity``, ``text``, ``state`` …"""
        return self._all_alarms()[1]

    def _all_alarms(self) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
        alarms: list[dict[str, Any]] = []
        process: list[dict[str, Any]] = []
        while True:
            page = self.call("alarms", offset=len(alarms) + len(process))
            alarms += page["alarms"]
            process += page["process"]
            total = page["total"] + page["process_total"]
            if not (page["alarms"] or page["process"]) or len(alarms) + len(process) >= total:
                return alarms, process

    def ack(
        self, alarm: str, *, occurrence: Optional[int] = None, comment: Optional[str] = None
    ) -> dict[str, Any]:
        """Acknowledges a process alarm, up to an occurrence or all; returns the alarm as it is now."""
        params = {"occurrence": occurrence, "comment": comment, "client": self._member.name}
        done: dict[str, Any] = self.call("ack", alarm=alarm, **params)["alarm"]
        return done

    def journal(self, since: Optional[int] = None) -> list[dict[str, Any]]:
        """What operators did, from the entry with the ``sequence`` ``since`` on: ``action``, ``cycle``, ``changes``,
        ``client``, ``comment`` … The node keeps the last 10,000 entries."""
        entries: list[dict[str, Any]] = []
        while True:
            page = self.call("journal", since=since)
            entries += page["entries"]
            if len(page["entries"]) >= page["total"] or not page["entries"]:
                return entries
            since = page["entries"][-1]["sequence"] + 1

    def save(self) -> str:
        """The configuration with the current values, as TOML."""
        text, read = "", 0
        while True:
            page = self.call("save", offset=read)
            part: str = page["configuration"]
            text += part
            # Pages are counted in bytes.
            read += len(part.encode())
            if not part or read >= page["total"]:
                return text

    def apply(
        self,
        config: StrPath,
        *,
        dry_run: bool = False,
        allow_missed: bool = False,
        comment: Optional[str] = None,
    ) -> dict[str, Any]:
        """Gives the node another configuration: a file, or the text of one if it has a line break.

        Args:
            dry_run: change nothing, and say what would change.
            allow_missed: change it even if a task misses cycles.
        """
        path = os.fspath(config)
        file = None
        if "\n" not in path:
            file = path
            with open(path, encoding="utf-8") as opened:
                path = opened.read()
        params = {"dry_run": dry_run, "allow_missed": allow_missed, "comment": comment}
        return self.call("apply", configuration=path, file=file, client=self._member.name, **params)

    def trace(
        self,
        names: Iterable[str],
        *,
        cycles: Optional[int] = None,
        seconds: Optional[float] = None,
    ) -> Trace:
        """Every cycle of at most 64 signals of one task, by names and globs, for so many cycles or seconds, from now on.

        The node copies the signals in the slack of each cycle. Ctrl-C ends it.
        """
        if isinstance(names, str):
            raise TypeError(f"names is the text {names!r}; give a list of names")
        if (cycles is None) == (seconds is None):
            raise ValueError("give cycles or seconds: how long to trace")
        if cycles is not None and cycles < 0:
            raise ValueError(f"cycles is {cycles}; give a number from 0")
        if seconds is not None:
            nanoseconds(seconds, "seconds", 0)
        traced = _native.trace(
            self._member, self.node, list(names), cycles, seconds, self._timeout
        )
        return Trace(traced)

    def close(self) -> None:
        """Leaves the node alone. Further calls of this do nothing; forces and changes stay."""
        if self._client is not None:
            self._client.close()
            self._client = None

    def __repr__(self) -> str:
        return f"<Node {self.node!r}>"


def _plain(value: Any) -> Any:
    """A scalar of NumPy as JSON has it."""
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"{value!r} is no value of a signal; give a bool, a number or a text")


def _given(values: Mapping[str, Given]) -> dict[str, Given]:
    """Values as a request has them."""
    if not isinstance(values, Mapping):
        raise TypeError(f"values is {values!r}; give a dict of values by name")

    def given(value: Given) -> Given:
        plain: Given = _plain(value) if isinstance(value, np.generic) else value
        if isinstance(plain, float) and not math.isfinite(plain):
            return "NaN" if math.isnan(plain) else ("inf" if plain > 0 else "-inf")
        return plain

    return {name: given(value) for name, value in values.items()}


def _values(values: Mapping[str, Given], types: Mapping[str, str]) -> dict[str, Value]:
    """Values as Python has them."""

    def read(value: Given, value_type: Optional[str]) -> Value:
        if value_type == "LREAL" or value in ("NaN", "inf", "-inf"):
            return float(value)
        # A task, at a callOB, is a text.
        return value  # type: ignore[return-value]

    return {name: read(value, types.get(name)) for name, value in values.items()}


def _flags(words: Iterable[str]) -> Flags:
    known = Flags.__members__
    return Flags(sum(known[word] if word in known else 1 << int(word[3:]) for word in words))


def _change(done: Mapping[str, Any]) -> Change:
    types = done.get("types") or {}
    tasks = done["tasks"]
    return Change(
        done["transaction"],
        {task: part["cycle"] for task, part in tasks.items()},
        any(part.get("pending", False) for part in tasks.values()),
        _values(done["before"], types),
        _values(done.get("after") or {}, types),
        ["; ".join(filter(None, (it["message"], it.get("help")))) for it in done["warnings"]],
    )
