"""A configuration without a clock and without services."""

from __future__ import annotations

import os
import warnings
from typing import TYPE_CHECKING, Iterable, Literal, Mapping, Optional, Union, overload

import numpy as np
import numpy.typing as npt

from isochrone import _native
from isochrone.member import StrPath

if TYPE_CHECKING:
    import pandas


@overload
def simulate(
    config: StrPath,
    inputs: Optional[Mapping[str, npt.ArrayLike]] = ...,
    *,
    cycles: Optional[int] = ...,
    task: Optional[str] = ...,
    signals: Iterable[str] = ...,
    pandas: Literal[False] = ...,
) -> dict[str, npt.NDArray[np.float64]]: ...


@overload
def simulate(
    config: StrPath,
    inputs: Optional[Mapping[str, npt.ArrayLike]] = ...,
    *,
    cycles: Optional[int] = ...,
    task: Optional[str] = ...,
    signals: Iterable[str] = ...,
    pandas: Literal[True],
) -> pandas.DataFrame: ...


def simulate(
    config: StrPath,
    inputs: Optional[Mapping[str, npt.ArrayLike]] = None,
    *,
    cycles: Optional[int] = None,
    task: Optional[str] = None,
    signals: Iterable[str] = (),
    pandas: bool = False,
) -> Union[dict[str, npt.NDArray[np.float64]], pandas.DataFrame]:
    """Steps a configuration as fast as it goes, as ``isochrone simulate`` does, and returns a value of each signal for
    each cycle.

    ::

        out = simulate("level.toml", {"target": np.r_[np.zeros(100), np.ones(900)]})
        plot(out["time_s"], out["ramp.delayedValue"])

    Args:
        config: a configuration file; or the text of one, if it has a line break.
        inputs: arrays by the names of inputs and variables. Row *k* applies at cycle *k*, and the last row holds. A number
            alone stands for all cycles. An input without values keeps its default and is not ok; ``NAME.ok`` and
            ``NAME.age`` (s) say otherwise what it is worth.
        cycles: how many; default: as many as ``inputs`` have rows.
        task: the task whose cycles are meant; default: the first.
        signals: names and globs of the signals that are wanted; default: those of all outputs.
        pandas: whether to return a ``DataFrame`` with the index ``time_s``, which needs pandas.

    Returns:
        Arrays of ``float64`` by name, and ``time_s``: when each cycle is due, in seconds after the first (unless a signal
        has that name).

    Raises:
        Error: the configuration cannot be read or has errors, or a block panicked.
        KeyError: an input or a signal does not exist.
        ValueError: there is no such task, arrays are of different lengths, or nothing says how many cycles.

    Warnings of the configuration, and samples that do not fit the type of their input, are Python warnings. Ctrl-C ends
    it.
    """
    path = os.fspath(config)
    text = path if "\n" in path else None
    columns, rows = [], {}
    for name, values in (inputs or {}).items():
        array = np.asarray(values, dtype=np.float64)
        if array.ndim > 1:
            raise ValueError(f"{name!r} has the shape {array.shape}; give one value for each cycle")
        rows[name] = array
    length = max((array.size for array in rows.values() if array.ndim), default=None)
    if rows and length is None and cycles is None:
        raise ValueError("give cycles, or an array for an input: numbers alone do not say how long to simulate")
    for name, array in rows.items():
        whole = array if array.ndim else np.full(1 if length is None else length, array)
        columns.append((name, np.ascontiguousarray(whole)))
    if isinstance(signals, str):
        raise TypeError(f"signals is the text {signals!r}; give a list of names")
    if cycles is not None and cycles < 0:
        raise ValueError(f"cycles is {cycles}; give a number from 0")
    period_ns, arrays, notes = _native.simulate(
        "configuration" if text is not None else path, text, columns, cycles, task, list(signals)
    )
    for note in notes:
        warnings.warn(note, stacklevel=2)
    count = len(next(iter(arrays.values()))) if arrays else 0
    result = {"time_s": np.arange(count) * period_ns / 1e9, **arrays}
    if not pandas:
        return result
    import pandas as pd

    index = pd.Index(result.pop("time_s"), name="time_s")
    return pd.DataFrame(result, index=index)
