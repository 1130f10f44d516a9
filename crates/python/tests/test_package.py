"""The package itself: its types, its examples, its pages."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from conftest import EXAMPLES, REPOSITORY, Domain, Process, wait_until

import isochrone
from isochrone import Flags, Publisher, Subscriber


def run(*command: str, folder: Path = REPOSITORY) -> None:
    done = subprocess.run([sys.executable, *command], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_stubs_are_what_the_native_part_has(tmp_path: Path) -> None:
    run("-m", "mypy.stubtest", "isochrone._native", folder=tmp_path)


def test_the_package_and_its_examples_are_of_correct_types(tmp_path: Path) -> None:
    mypy = ["-m", "mypy", "--config-file", str(REPOSITORY / "crates/python/pyproject.toml")]
    run(*mypy, "-p", "isochrone", folder=tmp_path)
    run(*mypy, *map(str, sorted(EXAMPLES.glob("*.py"))), folder=tmp_path)


def test_every_public_name_is_documented() -> None:
    for name in isochrone.__all__:
        thing = getattr(isochrone, name)
        if name == "__version__":
            continue
        assert thing.__doc__, name
        for member, value in vars(thing).items() if isinstance(thing, type) else ():
            if not member.startswith("_") and (callable(value) or isinstance(value, property)):
                assert value.__doc__, f"{name}.{member}"


def test_the_flags_are_those_of_a_header() -> None:
    page = (REPOSITORY / "docs/quality.md").read_text()
    rows = re.findall(r"^\| (\d+) \| `([A-Z]+)` \|", page, re.MULTILINE)
    assert [(1 << int(bit), word) for bit, word in rows] == [(f.value, f.name) for f in Flags]
    assert Flags(1 | 1 << 20).words == "STALE BIT20" and Flags(1 << 20).is_in_doubt is False
    assert not Flags.FORCED.is_in_doubt and Flags.UPSTREAM.is_in_doubt


def test_the_reader_prints_what_the_writer_publishes_to_its_end(domain: Domain) -> None:
    writer = domain.start_python(EXAMPLES / "writer.py", "plant/python", "600", "200")
    reader = domain.start_python(EXAMPLES / "reader.py", "plant/python", "100000")
    reader.wait_for("[STOPPED]")
    assert writer.finish() == 0 and reader.finish(signal.SIGINT) == 0
    first, *lines = reader.printed.splitlines()
    assert first == "plant/python from writer: sine, count"
    assert re.fullmatch(r"\d+ sine=0\.\d+ count=\d+  age \d+\.\d{3} ms", lines[0]), lines[0]
    assert lines[-2].startswith("600 sine=") and lines[-2].endswith(" ms  [STOPPED]"), lines[-2]
    assert lines[-1] == "ended"
    nobody = domain.start_python(EXAMPLES / "reader.py", "plant/nobody", "1")
    assert nobody.finish() == 3
    assert nobody.printed == "no frames on plant/nobody; start its publisher in this domain\n"


def test_the_writer_is_on_the_grid_of_all_nodes(domain: Domain) -> None:
    subscriber = Subscriber("plant/python")
    domain.start_python(EXAMPLES / "writer.py", "plant/python", "1000", "200", "700")
    for _ in range(20):
        frame = subscriber.wait(30)
        assert frame is not None
        assert frame.release_ns % 5_000_000 == 1_200_000
        assert frame.release_ns <= frame.publish_ns and frame.period_ns == 5_000_000
        assert frame.cycle == frame.sequence + frame.missed


def test_the_actuator_goes_to_its_safe_value_without_good_frames(domain: Domain) -> None:
    actuator = domain.start_python(EXAMPLES / "actuator.py", "plant/a", "y")
    actuator.wait_for("drives 0.0, the safe value: no frame has come\n")
    with Publisher("plant/a", ["y"], finite=False) as publisher:

        def publish_until(text: str, value: float, flags: Flags = Flags(0)) -> None:
            def is_so() -> bool:
                publisher.publish([value], flags=flags)
                return text in actuator.printed

            wait_until(f"{text!r}: {actuator.printed}", is_so)

        publish_until("drives 2.5\n", 2.5)
        actuator.wait_for("the safe value: the newest frame is old\n")
        publish_until("the safe value: STALE ERROR\n", 2.5, Flags.STALE | Flags.ERROR)
        publish_until("the safe value: y is nan\n", float("nan"))
        publish_until("drives 3.5\n", 3.5, Flags.FORCED)
    actuator.wait_for("the safe value: STOPPED\n")
    assert actuator.finish(signal.SIGTERM) == 0
    assert actuator.printed.endswith("drives 0.0, the safe value: the actuator ends\n")


def test_a_node_is_operated_from_the_command_line(domain: Domain, ramp: Process) -> None:
    def operate(status: int, arguments: str) -> str:
        done = domain.start_python(EXAMPLES / "operate.py", *arguments.split())
        assert done.finish() == status, done.printed
        return done.printed

    assert operate(0, "level list ramp.set*") == "ramp.setChangeRate LREAL parameter\n"
    said = operate(0, "level set ramp.setChangeRate=16#A")
    assert said.startswith("transaction 1 in cycle: fast ")
    assert said.endswith("\nramp.setChangeRate: 10.0 -> 10.0\n")
    assert operate(0, "level get ramp.setChangeRate") == "ramp.setChangeRate=10.0\n"
    assert operate(0, "level get target") == "target=1.0  [SUBSTITUTE]\n"
    assert "(to come)" in operate(0, "level set ramp.setChangeRate=1 --at +1500")
    operate(0, "level force target=3 --seconds 60")
    assert operate(0, "level list target") == "target LREAL input forced\n"
    rows = operate(0, "level trace target --seconds 0.2").splitlines()
    assert rows[0] == "cycle target" and rows[1].endswith(" 3.0")
    assert "there is no signal" in operate(1, "level set ramp.x=2")
    assert "no node \"nobody\" runs here" in operate(3, "nobody get n")
    assert "NAME=VALUE" in operate(2, "level set ramp.x")


@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_examples_in_order_and_nothing_is_left(
    domain: Domain, sent: signal.Signals
) -> None:
    writer = domain.start_python(EXAMPLES / "writer.py", "plant/python", "100000")
    reader = domain.start_python(EXAMPLES / "reader.py", "plant/python", "100000")
    reader.wait_for("plant/python from writer: sine, count")
    time.sleep(0.1)
    assert writer.finish(sent) == 0 and writer.printed == "ended\n"
    reader.wait_for("[STOPPED]")
    assert reader.finish(signal.SIGINT) == 0 and reader.printed.endswith("ended\n")
    assert domain.leftovers() == []
