"""Recordings as arrays."""

from __future__ import annotations

import signal
import time

import numpy as np
import pytest
from conftest import RAMP, Domain, wait_until

import isochrone
from isochrone import Flags, Publisher, Signal, read


def test_a_recorded_service_has_its_frames_with_times_and_flags(domain: Domain) -> None:
    recorder = domain.start("record", "plant/a", "-o", "a.mcap")
    recorder.wait_for("recording")
    with Publisher("plant/a", [Signal("y", unit="m"), Signal("n", "INT")], name="sensor") as publisher:
        wait_until("the recorder reads", lambda: publisher.readers > 0)
        begin = time.time_ns()
        for n in range(20):
            publisher.publish([n / 2, n], flags=Flags.STALE if n == 3 else 0)
        end = time.time_ns()
    with Publisher("plant/a", [Signal("y", unit="m"), "z"]) as publisher:
        publisher.publish([7.0, 8.0])
        # It connects at its next look, and then says what it hears.
        recorder.wait_for("now carries")
    assert recorder.finish(signal.SIGINT) == 0, recorder.printed
    (service,) = (recordings := read(domain.folder / "a.mcap"))
    a = recordings[service]
    assert service == "plant/a" and len(a.time_ns) == len(a["y"])
    assert a["y"][:20].tolist() == [n / 2 for n in range(20)]
    assert a["n"][:20].tolist() == list(range(20)) and np.isnan(a["n"][-1])
    assert a["y"][-1] == 7.0 and a["z"][-1] == 8.0 and np.isnan(a["z"][0])
    assert np.flatnonzero(a.flags == Flags.STALE).tolist() == [3]
    assert np.flatnonzero(a.flags & Flags.STOPPED != 0).tolist() == [20, 22]
    second = 1_000_000_000
    assert begin - second <= a.time_ns[0] <= a.time_ns[19] <= end + second
    assert a.time.dtype == np.dtype("datetime64[ns]")
    assert a.time_s[0] == 0.0 and a.time_s[-1] == (a.time_ns[-1] - a.time_ns[0]) / 1e9
    assert (a.units["y"], a.types["n"], a.lost) == ("m", "INT", 0)
    assert list(a) == ["y", "n", "z"] and len(a) == 3


def test_a_recorded_node_has_its_outputs_and_what_its_inputs_read(domain: Domain) -> None:
    node = domain.node(RAMP, "--record", "run.mcap", "--cycles", "200")
    assert node.finish() == 0, node.printed
    recordings = read(domain.folder / "run.mcap")
    level, inputs = recordings["plant/level"], recordings["level/fast"]
    assert list(level) == ["ramp.delayedValue", "target"]
    assert list(inputs) == ["target", "target.ok", "target.age"]
    assert level.cycle.tolist() == inputs.cycle.tolist() and len(level.cycle) == 200
    assert (level.publisher, level.period_ns) == ("level", 5_000_000)
    assert set(inputs["target"]) == {1.0} and set(inputs["target.ok"]) == {0.0}
    assert np.isinf(inputs["target.age"]).all()
    assert (level.flags & Flags.SUBSTITUTE != 0).all()
    pandas = pytest.importorskip("pandas")
    table = level.to_pandas()
    assert isinstance(table, pandas.DataFrame) and len(table) == len(level.time)
    assert str(table.index.tz) == "UTC"


def test_a_recording_that_was_not_closed_is_read_with_a_warning(domain: Domain) -> None:
    node = domain.node(RAMP, "--record", "run.mcap")
    file = domain.folder / "run.mcap"
    wait_until("rows are in the file", lambda: file.stat().st_size > 20_000)
    node.finish(signal.SIGKILL)
    with pytest.warns(isochrone.IncompleteRecording, match="was not closed"):
        recordings = read(file)
    assert len(recordings["plant/level"].cycle) > 0


def test_what_is_no_recording_is_refused_in_words(domain: Domain) -> None:
    with pytest.raises(FileNotFoundError):
        read("none.mcap")
    with pytest.raises(isochrone.Error, match="is no file"):
        read(domain.folder)
    with pytest.raises(isochrone.Error, match="cannot read .*MCAP"):
        read(domain.write("text.mcap", "no recording"))
