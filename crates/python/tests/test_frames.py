"""Publishers and subscribers, by themselves and with a node."""

from __future__ import annotations

import gc
import os
import signal
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from conftest import EXAMPLES, Domain, Process, wait_until

import isochrone
from isochrone import Flags, Pace, Publisher, Signal, Subscriber

SIGNALS = [Signal("y", unit="m"), Signal("n", "INT"), Signal("on", "BOOL")]


def pair() -> tuple[Publisher, Subscriber]:
    return Publisher("plant/a", SIGNALS, period="10ms"), Subscriber("plant/a")


def test_a_frame_comes_with_its_names_types_units_and_times(domain: Domain) -> None:
    publisher, subscriber = pair()
    before = time.monotonic_ns()
    assert publisher.publish({"on": True, "y": 1.5, "n": -3}, flags=Flags.STALE) == 0
    frame = subscriber.wait(10)
    assert frame is not None
    assert dict(frame) == {"y": 1.5, "n": -3, "on": True}
    assert [type(frame[name]) for name in frame] == [float, int, bool]
    assert frame.values.dtype == np.float64 and frame.values.tolist() == [1.5, -3.0, 1.0]
    assert (frame.names, frame.types) == (("y", "n", "on"), ("LREAL", "INT", "BOOL"))
    assert (frame.units, frame.period_ns) == (("m", "", ""), 10_000_000)
    assert frame.flags == Flags.STALE and frame.flags.is_in_doubt
    assert before <= frame.publish_ns <= frame.received_ns <= time.monotonic_ns()
    assert frame.is_of_this_clock and frame.sampled_ns == frame.publish_ns
    age_ns = frame.age_ns
    assert 0 < age_ns <= frame.age_ns and frame.age == pytest.approx(frame.age_ns / 1e9, abs=1.0)
    assert (frame.sequence, frame.cycle, frame.release_ns, frame.lost) == (0, 0, 0, 0)
    assert "[STALE]" in repr(frame) and "y" in frame and "z" not in frame


def test_every_frame_is_given_in_its_order_and_the_newest_alone_where_that_is_asked_for(
    domain: Domain,
) -> None:
    publisher, subscriber = pair()
    assert subscriber.newest() is None
    for n in range(5):
        publisher.publish([0.5, n, 0])
    given = [frame["n"] for frame in subscriber.every(timeout=0.5)]
    assert given == [0, 1, 2, 3, 4]
    for n in range(5, 8):
        publisher.publish([0.5, n, 0])
    newest = wait_until("the newest came", lambda: (f := subscriber.newest()) and f["n"] == 7 and f)
    assert newest.lost == 0
    assert subscriber.newest() is newest, "none is newer"


def test_wanted_signals_come_in_the_order_of_their_names(domain: Domain) -> None:
    publisher = Publisher("plant/a", SIGNALS)
    subscriber = Subscriber("plant/a", ["n", "y"])
    publisher.publish([1.0, 2, 0])
    frame = subscriber.wait(10)
    assert frame is not None and frame.values.tolist() == [2.0, 1.0]
    with pytest.raises(isochrone.MissingSignal, match="no signal 'on'; there is: n, y"):
        frame["on"]


def test_a_frame_without_a_wanted_signal_says_so_when_it_is_asked_and_the_next_may_have_it(
    domain: Domain,
) -> None:
    subscriber = Subscriber("plant/a", ["z"])
    with Publisher("plant/a", ["y"]) as publisher:
        publisher.publish([1.0])
        frame = subscriber.wait(10)
    assert frame is not None
    for ask in (lambda: frame.values, lambda: frame["z"], lambda: dict(frame)):
        with pytest.raises(isochrone.MissingSignal, match='no signal "z"; there is: y'):
            ask()
    publisher = Publisher("plant/a", ["z"])
    publisher.publish([4.0])
    later = next(f for f in subscriber.every(10) if f.restarts)
    assert later["z"] == 4.0


def test_a_node_takes_what_is_published_and_its_frames_come_back(
    domain: Domain, ramp: Process
) -> None:
    publisher = Publisher("plant/target", [Signal("y", unit="m")], period="5ms")
    subscriber = Subscriber("plant/level", ["ramp.delayedValue", "target"])
    for release in Pace("5ms", "1ms"):
        publisher.publish([0.5], at=release)
        frame = subscriber.newest()
        if frame and not frame.flags and frame["ramp.delayedValue"] == 0.5:
            break
        assert release.cycle < 10_000, frame
    assert frame is not None and frame.publisher == "level" and frame.source_ns > 0
    publisher.close()
    stopped = wait_until("the end was seen", lambda: (f := subscriber.newest()) and f.flags and f)
    assert Flags.STALE in stopped.flags and stopped["target"] == 0.5


def test_the_last_frame_says_that_nothing_follows(domain: Domain) -> None:
    publisher, subscriber = pair()
    with publisher:
        publisher.publish([1.0, 2, 0])
        frames = [subscriber.wait(10)]
    frames.append(subscriber.wait(10))
    assert [frame and frame.flags for frame in frames] == [Flags(0), Flags.STOPPED]
    assert frames[1] and frames[1].values.tolist() == [1.0, 2.0, 0.0]
    publisher.close()
    with pytest.raises(isochrone.Closed, match='the publisher of "plant/a" is closed'):
        publisher.publish([1.0, 2, 0])


@pytest.mark.parametrize(
    ("values", "error", "says"),
    [
        ([1.0], ValueError, "shape (1,); 'plant/a' has 3 signals: y, n, on"),
        ([[1.0, 2.0, 0.0]], ValueError, "shape (1, 3)"),
        ([np.nan, 0, 0], ValueError, "y is nan; publish the last good value with flags=Flags.STALE"),
        ([0, 0.5, 0], ValueError, "n is INT, which cannot hold 0.5"),
        ([0, 40000, 0], ValueError, "n is INT, which cannot hold 40000.0"),
        ([0, 0, 2], ValueError, "on is BOOL, which cannot hold 2.0"),
        ({"y": 1.0, "n": 0}, KeyError, "there is no value for on"),
        ({"y": 1.0, "n": 0, "on": 0, "x": 1}, KeyError, "has no signal x"),
        (["a", 0, 0], ValueError, "could not convert"),
        (None, (ValueError, TypeError), ""),
    ],
)
def test_values_that_do_not_fit_are_refused_in_words_and_nothing_is_sent(
    domain: Domain, values: object, error: type[Exception], says: str
) -> None:
    publisher, subscriber = pair()
    with pytest.raises(error) as refused:
        publisher.publish(values)  # type: ignore[arg-type]
    assert says in str(refused.value)
    assert publisher.publish([0.0, 0, 0]) == 0
    frame = subscriber.wait(10)
    assert frame is not None and frame.sequence == 0


def test_nan_is_sent_where_the_publisher_says_that_it_may_be(domain: Domain) -> None:
    publisher = Publisher("plant/a", ["y"], finite=False)
    subscriber = Subscriber("plant/a")
    publisher.publish([np.nan])
    frame = subscriber.wait(10)
    assert frame is not None and np.isnan(frame["y"])


def test_signals_services_and_times_that_cannot_be_are_refused_in_words(domain: Domain) -> None:
    for make, error, says in [
        (lambda: Publisher("plant/a", "level"), TypeError, "give a list of names"),
        (lambda: Publisher("plant/a", [Signal("n", "int")]), ValueError, "there is: LREAL, INT"),
        (lambda: Publisher("plant/a", []), isochrone.Error, "the frame has no signal"),
        (lambda: Publisher("plant/a", ["y", "y"]), isochrone.Error, 'both called "y"'),
        (lambda: Publisher("", ["y"]), isochrone.Error, "name"),
        (lambda: Publisher("plant/a", ["y"], period="1 parsec"), ValueError, "period '1 parsec'"),
        (lambda: Publisher("plant/a", ["y"], period=-1.0), ValueError, "period is -1.0"),
        (lambda: Publisher("plant/a", ["y"], name="ä"), isochrone.Error, "ä"),
        (lambda: Publisher("plant/a", ["y"], domain="none.toml"), isochrone.Error, "none.toml"),
        (lambda: Subscriber("plant/a", "y"), TypeError, "give a list of names"),
        (lambda: Subscriber("isochrone/layout/a"), isochrone.Error, "isochrone/layout"),
        (lambda: Subscriber("plant/a").wait(-1.0), ValueError, "timeout is -1.0"),
        (lambda: Subscriber("plant/a").wait(float("nan")), ValueError, "timeout is NaN"),
        (lambda: Pace(0.0), ValueError, "period is 0 ns; it is at least 1000 ns"),
        (lambda: Pace("10ms", offset=True), TypeError, "offset is True"),
    ]:
        with pytest.raises(error) as refused:
            make()
        assert says in str(refused.value)


def test_a_second_publisher_is_refused_by_name(domain: Domain) -> None:
    publisher = Publisher("plant/a", ["y"], name="first")
    with pytest.raises(isochrone.Error, match="first"):
        Publisher("plant/a", ["y"])
    publisher.close()
    Publisher("plant/a", ["y"]).close()


def test_a_view_is_of_the_frame_where_it_lies_and_only_within_with(domain: Domain) -> None:
    publisher, subscriber = pair()
    for n in range(3):
        publisher.publish([0.25, n, 0])
    with subscriber.view(10) as frame:
        assert frame is not None and frame["y"] == 0.25
        assert frame.values.tolist() == [0.25, 0.0, 0.0]
        assert not frame.values.flags.owndata and not frame.values.flags.writeable
        with pytest.raises(ValueError):
            frame.values.setflags(write=True)
        for read in (subscriber.newest, lambda: subscriber.wait(0.1), subscriber.close):
            with pytest.raises(BufferError, match="let go of it, or keep a copy"):
                read()
    assert frame.values.size == 0, "it is gone with its `with`"
    with pytest.raises(isochrone.Closed, match="the view with 'y' ended"):
        frame["y"]
    with pytest.raises(ValueError, match="open the subscriber without names"):
        with Subscriber("plant/a", ["y"]).view(0.1):
            pass
    with pytest.raises(BufferError, match="outlives its `with`"):
        with subscriber.view(10) as frame:
            assert frame is not None
            kept = frame.values[1:]
    assert kept.tolist() == [1.0, 0.0], "it stays valid"
    with pytest.raises(BufferError):
        subscriber.wait(0.1)
    del kept
    later = subscriber.wait(10)
    assert later is not None and later["n"] == 2
    with subscriber.view(0.05) as nothing:
        assert nothing is None


def test_an_array_of_a_view_outlives_even_its_subscriber(domain: Domain) -> None:
    publisher, subscriber = pair()
    publisher.publish([0.25, 1, 0])
    with pytest.raises(BufferError):
        with subscriber.view(10) as frame:
            assert frame is not None
            kept = frame.values
    del subscriber, frame
    publisher.close()
    gc.collect()
    assert kept.tolist() == [0.25, 1.0, 0.0]


def test_one_thread_at_a_time_uses_a_port_and_another_is_told_so(domain: Domain) -> None:
    publisher, subscriber = pair()
    frames: list[object] = []
    reading = threading.Thread(target=lambda: frames.append(subscriber.wait(30)))
    reading.start()

    def refused() -> bool:
        try:
            subscriber.newest()
            return False
        except isochrone.Error as error:
            return 'the subscriber of "plant/a" is used by another thread' in str(error)

    # It looks in steps of 50 ms, and is used by nobody between them.
    wait_until("another thread reads", refused)
    publisher.publish([1.0, 2, 0])
    reading.join(30)
    assert len(frames) == 1 and frames[0] is not None
    # Made here, used and dropped there.
    ended = threading.Thread(target=publisher.close)
    ended.start()
    ended.join(30)
    with pytest.raises(isochrone.Closed):
        publisher.publish([1.0, 2, 0])


def test_other_threads_run_while_one_waits(domain: Domain) -> None:
    subscriber = Subscriber("plant/a")
    waiting = threading.Thread(target=subscriber.wait, args=(0.5,))
    waiting.start()
    turns = 0
    while waiting.is_alive():
        turns += 1
    assert turns > 1000


def test_a_forked_process_is_told_to_open_its_own_and_harms_nothing(domain: Domain) -> None:
    publisher, subscriber = pair()
    publisher.publish([1.0, 2, 0])
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        said = "nothing"
        try:
            publisher.publish([1.0, 2, 0])
        except isochrone.Error as error:
            said = str(error)
        try:
            del publisher, subscriber
            gc.collect()
            os.write(write, said.encode())
        finally:
            os._exit(0)
    os.close(write)
    with os.fdopen(read) as said_by_child:
        said = said_by_child.read()
    assert os.waitpid(child, 0)[1] == 0
    assert f"belongs to process {os.getpid()}" in said and "spawn" in said
    assert publisher.publish([3.0, 2, 0]) == 1
    assert [frame["y"] for frame in subscriber.every(0.5)] == [1.0, 3.0]


FORKS = """
import os, sys
from isochrone import Publisher, Subscriber
publisher, subscriber = Publisher("plant/a", ["y"]), Subscriber("plant/a")
publisher.publish([1.0])
if child := os.fork():
    assert os.waitpid(child, 0)[1] == 0
    publisher.publish([2.0])
    print([frame["y"] for frame in subscriber.every(1)])
else:
    # A port of its own, and an end as of any program.
    with Publisher("plant/b", ["y"]) as own:
        own.publish([3.0])
    sys.exit(0)
"""


def test_a_forked_process_opens_ports_of_its_own_and_ends_as_any_other(domain: Domain) -> None:
    subscriber = Subscriber("plant/b")
    parent = domain.start_python(domain.write("forks.py", FORKS))
    frame = subscriber.wait(30)
    assert frame is not None and frame["y"] == 3.0
    assert parent.finish() == 0 and parent.printed == "[1.0, 2.0]\n", parent.printed
    subscriber.close()
    assert domain.leftovers() == []


def test_ctrl_c_ends_a_wait(domain: Domain) -> None:
    subscriber, pace = Subscriber("plant/a"), Pace(3600.0)
    # The first release is within 20 ms.
    pace.wait()
    for wait in (subscriber.wait, pace.wait, lambda: next(iter(subscriber))):
        killer = threading.Thread(
            target=lambda: (time.sleep(0.2), os.kill(os.getpid(), signal.SIGINT))
        )
        killer.start()
        with pytest.raises(KeyboardInterrupt):
            wait()
        killer.join()
    assert subscriber.wait(0.01) is None, "it can be used on"


def test_nothing_is_left_when_all_is_closed(domain: Domain) -> None:
    with Publisher("plant/a", ["y"]) as publisher, Subscriber("plant/a") as subscriber:
        publisher.publish([1.0])
        assert subscriber.wait(10) is not None
        assert publisher.readers == 1
        assert domain.leftovers()
    assert domain.leftovers() == []


def test_the_releases_of_a_pace_are_on_the_grid_of_all_nodes() -> None:
    pace = Pace("5ms", "150us")
    first, second = pace.wait(), pace.wait()
    assert first.release_ns % 5_000_000 == 650_000
    assert second.release_ns - first.release_ns == (second.cycle - first.cycle) * 5_000_000
    assert first.start_ns >= first.release_ns and (first.cycle, first.missed) == (0, 0)
    time.sleep(0.05)
    late = pace.wait()
    assert late.missed >= 8 and late.cycle == late.missed + 2
    assert late.release_ns % 5_000_000 == 650_000


def test_frames_of_a_pace_carry_its_releases(domain: Domain) -> None:
    publisher, subscriber, pace = *pair(), Pace("5ms")
    for release in (pace.wait(), pace.wait()):
        publisher.publish([1.0, 2, 0], at=release)
        frame = subscriber.wait(10)
        assert frame is not None
        got = (frame.cycle, frame.release_ns, frame.missed)
        assert got == (release.cycle, release.release_ns, release.missed)


def test_what_nodes_say_of_themselves_is_no_service_to_publish_on(domain: Domain) -> None:
    says = 'names that begin with "isochrone/" are for what nodes say of themselves.*"plant/x"'
    for take_over in (False, True):
        with pytest.raises(isochrone.Error, match=says):
            Publisher("isochrone/x", ["y"], take_over=take_over)


def test_a_service_that_somebody_writes_is_refused_by_node_and_process(domain: Domain) -> None:
    writer = domain.start("publish", "plant/a", "--value", "1")
    writer.wait_for("publishing")
    by = rf"is written by .*isochrone/publish.*pid {writer.running.pid}\).*end that one"
    for take_over in (False, True):
        with pytest.raises(isochrone.Error, match=by):
            Publisher("plant/a", ["y"], take_over=take_over)
    writer.finish(signal.SIGTERM)
    Publisher("plant/a", ["y"]).close()


def test_a_service_is_taken_over_from_a_writer_that_is_not_of_isochrone(domain: Domain) -> None:
    writer = domain.start_python(EXAMPLES / "bare/writer.py", "plant/a", "1000000")
    subscriber = Subscriber("plant/a")
    assert subscriber.wait(20), writer.printed
    by = rf"is written by .*python/writer.*pid {writer.running.pid}\).*take the service over"
    with pytest.raises(isochrone.Error, match=by):
        Publisher("plant/a", ["y"])
    with Publisher("plant/a", ["y"], take_over=True) as publisher:
        publisher.publish([7.5])
        taken = next(frame for frame in subscriber.every(20) if "y" in frame)
    assert taken["y"] == 7.5


def test_a_service_of_another_machine_is_refused_by_the_link_that_brings_it(domain: Domain) -> None:
    link = domain.start_python(Path(__file__).with_name("link.py"), "plant/a")
    link.wait_for("linked")
    says = rf"written on another machine already.*arrive through .*pid {link.running.pid}\)"
    for take_over in (False, True):
        with pytest.raises(isochrone.Error, match=says):
            Publisher("plant/a", ["y"], take_over=take_over)
