"""A running node, operated."""

from __future__ import annotations

import os
import signal
import threading
import time

import numpy as np
import pytest
from conftest import RAMP, Domain, Process, wait_until

import isochrone
from isochrone import Flags, Node

ALARM = """
[[variable]]
name = "level"
initial = 0.0
[[alarm]]
name = "high"
when = "level > 1.5"
severity = "warning"
text = "the tank is full"
"""


def test_values_are_read_with_their_types_flags_and_cycle(domain: Domain, ramp: Process) -> None:
    with Node("level") as node:
        rate = node.get("ramp.setChangeRate")
        assert (rate, type(rate)) == (10.0, float)
        assert node.get("target.ok") is False
        values = node.values("ramp.set*", "target")
        assert values["target"] == 1.0 and values["ramp.setChangeRate"] == 10.0
        assert Flags.SUBSTITUTE in values.flags["target"]
        assert "ramp.setChangeRate" not in values.flags
        assert values.cycles.keys() == {"fast"}
        assert node.get("target.age") == float("inf")


def test_several_values_are_set_in_one_transaction_or_none(domain: Domain, ramp: Process) -> None:
    with Node("level", name="tuner") as node:
        done = node.set({"ramp.setChangeRate": np.float64(5.0)}, comment="too fast")
        assert done.before == {"ramp.setChangeRate": 10.0}
        assert done.after == {"ramp.setChangeRate": 5.0} and not done.pending
        assert node.get("ramp.setChangeRate") == 5.0
        with pytest.raises(isochrone.Refused) as refused:
            node.set({"ramp.setChangeRate": 7.0, "ramp.valeu": 1, "target": 2.0})
        assert refused.value.code == 1
        assert {finding["name"] for finding in refused.value.findings} == {"ramp.valeu", "target"}
        assert "did you mean" in str(refused.value)
        assert node.get("ramp.setChangeRate") == 5.0, "nothing has changed"
        with pytest.raises(isochrone.Refused, match="NaN"):
            node.set({"ramp.setChangeRate": float("nan")})
        node.undo(done.transaction)
        assert node.get("ramp.setChangeRate") == 10.0
        first, second = node.journal()
        assert (first["action"], first["client"], first["comment"]) == ("set", "tuner", "too fast")
        assert second["undone"] == done.transaction
        assert node.journal(second["sequence"]) == [second]
        assert "setChangeRate = 10" in node.save()


def test_a_value_takes_effect_in_the_cycle_that_was_asked_for(domain: Domain, ramp: Process) -> None:
    with Node("level") as node:
        soon = node.set({"ramp.setChangeRate": "2.5"}, at="+20")
        assert not soon.pending and node.get("ramp.setChangeRate") == 2.5
        later = node.set({"ramp.setChangeRate": 3.5}, at="+1500")
        assert later.pending
        with pytest.raises(isochrone.Refused) as refused:
            node.set({"ramp.setChangeRate": 1.0}, at=soon.cycles["fast"])
        assert refused.value.code == 4


def test_forces_hold_until_they_are_released(domain: Domain, ramp: Process) -> None:
    with Node("level") as node:
        done = node.force({"target": 7.5}, seconds=None)
        assert done.before == {"target": 1.0}
        assert [force["name"] for force in node.forces()] == ["target"]
        assert Flags.FORCED in node.values("target").flags["target"]
        node.release("tar*")
        assert node.forces() == [] and node.get("target") == 1.0
        node.force({"target": 3.0}, seconds=0.2)
        wait_until("the force has ended", lambda: node.forces() == [])


def test_alarms_of_the_node_and_of_the_process_are_listed_and_acknowledged(domain: Domain) -> None:
    domain.node(RAMP + ALARM)
    with Node("level") as node:
        (alarm,) = wait_until("the input is missing", node.alarms)
        assert alarm["name"] == "target" and alarm["meaning"]
        assert node.process_alarms() == []
        node.set({"level": 2.0})
        (high,) = wait_until("the alarm came", node.process_alarms)
        assert (high["name"], high["text"]) == ("high", "the tank is full")
        assert node.ack("high", comment="seen")["unacknowledged"] == 0


def test_every_cycle_is_traced_into_arrays(domain: Domain, ramp: Process) -> None:
    with Node("level") as node:
        trace = node.trace(["ramp.*", "target"], cycles=100)
        assert len(trace.cycle) == len(trace.time_s) == len(trace["ramp.value"]) == 100
        assert (trace.task, trace.period_ns, trace.lost) == ("fast", 5_000_000, 0)
        steps = np.diff(trace.cycle)
        assert steps.min() >= 1 and steps.sum() == 99 + trace.missed
        assert set(trace["target"]) == {1.0} and "ramp.value" in trace.units
        assert trace.time_s[0] == 0.0 and trace.time_s[-1] == pytest.approx(steps.sum() * 0.005)
        short = node.trace(["target"], seconds=0.2)
        assert 1 <= len(short.cycle)
        for names, lengths, error, says in [
            (["nothing"], {"cycles": 1}, isochrone.Refused, "nothing"),
            (["target"], {}, ValueError, "give cycles or seconds"),
            ("target", {"cycles": 1}, TypeError, "give a list of names"),
        ]:
            with pytest.raises(error, match=says):
                node.trace(names, **lengths)


def test_another_configuration_is_tried_and_applied(domain: Domain, ramp: Process) -> None:
    new = RAMP.replace("setChangeRate = 10.0", "setChangeRate = 20.0")
    with Node("level") as node:
        tried = node.apply(new, dry_run=True)
        assert tried["transaction"] is None and tried["refused"] is None
        assert node.get("ramp.setChangeRate") == 10.0
        node.apply(domain.write("new.toml", new), comment="faster")
        assert node.get("ramp.setChangeRate") == 20.0
        with pytest.raises(isochrone.Refused) as refused:
            node.apply("[node]\nname = 5\n")
        assert refused.value.code == 8
        assert {finding["line"] for finding in refused.value.findings} >= {2}


def test_signals_are_described_and_any_method_can_be_called(domain: Domain, ramp: Process) -> None:
    with Node("level") as node:
        (target,) = node.signals("target")
        assert (target["type"], target["role"], target["task"]) == ("LREAL", "input", "fast")
        assert len(node.signals()) > 5
        assert node.describe()["tasks"][0]["period_ns"] == 5_000_000
        assert node.call("get", names=["target"])["values"] == {"target": 1.0}
        with pytest.raises(isochrone.Refused, match="no method \"gte\"; did you mean \"get\""):
            node.call("gte")
        with pytest.raises(isochrone.Refused) as refused:
            node.call("get", name="target")
        assert refused.value.code == -32602
        with pytest.raises(TypeError, match="is no value of a signal"):
            node.set({"ramp.setChangeRate": object()})  # type: ignore[dict-item]
        with pytest.raises(isochrone.MissingSignal, match="use values"):
            node.get("ramp.*")


def test_a_node_that_does_not_run_has_ended_or_is_closed_is_told(domain: Domain) -> None:
    ramp = domain.node(RAMP)
    with pytest.raises(isochrone.NoAnswer, match='no node "lvel" runs here; did you mean "level"'):
        Node("lvel")
    node = Node("level")
    ramp.finish(signal.SIGTERM)
    with pytest.raises(isochrone.NoAnswer, match="ended before it answered"):
        node.get("target")
    node.close()
    with pytest.raises(isochrone.Closed, match="the client of node 'level' is closed"):
        node.get("target")


def test_a_node_that_is_stopped_is_named_and_ctrl_c_ends_the_wait_for_it(
    domain: Domain, ramp: Process
) -> None:
    node = Node("level", timeout=0.5)
    patient = Node("level", timeout=60.0)
    ramp.running.send_signal(signal.SIGSTOP)
    try:
        with pytest.raises(isochrone.NoAnswer, match="is stopped: continue it"):
            node.get("target")
        interrupt = threading.Thread(
            target=lambda: (time.sleep(0.3), os.kill(os.getpid(), signal.SIGINT))
        )
        interrupt.start()
        with pytest.raises(KeyboardInterrupt):
            patient.get("target")
        interrupt.join()
    finally:
        ramp.running.send_signal(signal.SIGCONT)
    assert wait_until("it answers again", lambda: patient.get("target")) == 1.0
    assert node.get("target") == 1.0, "a late answer is not taken for another"


def test_ctrl_c_ends_a_trace(domain: Domain, ramp: Process) -> None:
    node = Node("level")
    interrupt = threading.Thread(
        target=lambda: (time.sleep(0.5), os.kill(os.getpid(), signal.SIGINT))
    )
    interrupt.start()
    with pytest.raises(KeyboardInterrupt):
        node.trace(["target"], seconds=3600)
    interrupt.join()
    assert node.get("target") == 1.0
