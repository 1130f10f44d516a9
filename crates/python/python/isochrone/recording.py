"""A recording as arrays."""

from __future__ import annotations

import os
import warnings
from typing import TYPE_CHECKING, Any, Iterator, Mapping, Optional

import numpy as np
import numpy.typing as npt

from isochrone import _native
from isochrone.errors import IncompleteRecording
from isochrone.member import StrPath

if TYPE_CHECKING:
    import pandas


_NUMBERS = ("time_ns", "cycle", "release_ns", "publish_ns", "missed", "flags")


class Recording(Mapping[str, npt.NDArray[np.float64]]):
    """The frames of one service, in their order: ``recording["level.y"]`` has a value for each of them.

    Where the service changed its signals, those that a frame does not have are NaN.

    Attributes:
        service: the name of the service; of what the inputs of a recorded node read, ``NODE/TASK``.
        publisher: who wrote the frames; an empty text where nobody announced it.
        period_ns: the time between two frames, ns; ``None``: none was announced.
        time: when each frame's cycle was due, ``datetime64[ns]`` in UTC.
        time_s: the same in seconds after the first, as of a trace and a simulation.
        time_ns: the same in Unix ns; this and the following are ``int64``.
        cycle: the publisher's cycle.
        release_ns: when it was due, ns of the publisher's ``CLOCK_MONOTONIC``.
        publish_ns: when the frame was sent, in the same.
        missed: cycles that the publisher had missed since its start.
        flags: what the values are worth: good where ``recording.flags == 0``, stale where ``recording.flags &
            Flags.STALE``.
        lost: how many frames the recorder lost.
        units: by name, a signal's unit; an empty text for none.
        types: by name, a signal's type.
    """

    def __init__(self, channels: list[dict[str, Any]]) -> None:
        last = channels[-1]
        self.service: str = last["service"]
        self.publisher: str = last["publisher"]
        self.period_ns: Optional[int] = last["period_ns"]
        self.lost: int = sum(channel["lost"] for channel in channels)
        self.time_ns, self.cycle, self.release_ns, self.publish_ns, self.missed, self.flags = (
            _joined(channels, key) for key in _NUMBERS
        )
        self.units: dict[str, str] = {}
        self.types: dict[str, str] = {}
        self._values: dict[str, npt.NDArray[np.float64]] = {}
        begin = 0
        for channel in channels:
            names = _names(channel["names"])
            end = begin + len(channel["time_ns"])
            self.units.update(zip(names, channel["units"]))
            self.types.update(zip(names, channel["types"]))
            for name, values in zip(names, channel["values"]):
                if len(channels) == 1:
                    self._values[name] = values
                    continue
                whole = self._values.setdefault(name, np.full(len(self.time_ns), np.nan))
                whole[begin:end] = values
            begin = end
        if len(channels) > 1:
            # One layout may have come before and after another.
            order = np.argsort(self.time_ns, kind="stable")
            for key in _NUMBERS:
                setattr(self, key, getattr(self, key)[order])
            self._values = {name: values[order] for name, values in self._values.items()}
        self.time = self.time_ns.astype("datetime64[ns]")
        self.time_s: npt.NDArray[np.float64] = (self.time_ns - self.time_ns[:1]) / 1e9

    def __getitem__(self, name: str) -> npt.NDArray[np.float64]:
        return self._values[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        """How many signals there are."""
        return len(self._values)

    def to_pandas(self) -> pandas.DataFrame:
        """The signals as a ``DataFrame`` with the index ``time``, which needs pandas."""
        import pandas as pd

        return pd.DataFrame(self._values, index=pd.DatetimeIndex(self.time, name="time", tz="UTC"))

    def __repr__(self) -> str:
        frames, signals = len(self.time_ns), ", ".join(self._values)
        return f"<Recording of {self.service!r}: {frames} frames of {signals}>"


def _joined(channels: list[dict[str, Any]], key: str) -> npt.NDArray[np.int64]:
    columns = [channel[key].view(np.int64) for channel in channels]
    return columns[0] if len(columns) == 1 else np.concatenate(columns)


def _names(names: list[str]) -> list[str]:
    return [name or f"ch{channel}" for channel, name in enumerate(names)]


def read(path: StrPath) -> dict[str, Recording]:
    """The frames of a recording (``isochrone record``, ``run --record``), by service.

    ::

        level = read("run.mcap")["plant/level"]
        good = level.flags == 0
        plot(level.time[good], level["level.y"][good])

    The recording of a node has its outputs by their services, and what the inputs of each task read in each cycle as
    ``NODE/TASK``, with ``NAME``, ``NAME.ok`` and ``NAME.age`` (s).

    Args:
        path: an MCAP file that isochrone wrote. Messages of other programs are passed over.

    Raises:
        Error: it is no such file.
        OSError: it cannot be opened.

    A file that was not closed, or is damaged, is read as far as it goes, with the warning :class:`IncompleteRecording`.
    Ctrl-C ends it.
    """
    channels, doubt = _native.read(os.fspath(path))
    if doubt is not None:
        warnings.warn(doubt, IncompleteRecording, stacklevel=2)
    services: dict[str, list[dict[str, Any]]] = {}
    for channel in channels:
        services.setdefault(channel["service"], []).append(channel)
    return {service: Recording(of_service) for service, of_service in services.items()}
