"""A domain of its own for each test, and node processes in it."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any, Callable, Iterator

import pytest

REPOSITORY = Path(__file__).resolve().parents[3]
EXAMPLES = REPOSITORY / "examples" / "python"
PATIENCE_S = 60.0


def isochrone() -> Path:
    """The program, as `cargo build` leaves it, or the one that ISOCHRONE names."""
    program = Path(os.environ.get("ISOCHRONE", REPOSITORY / "target" / "debug" / "isochrone"))
    if not program.is_file():
        pytest.fail(f"{program} is missing: run `cargo build`, or name the program in ISOCHRONE")
    return program


def wait_until(what: str, is_so: Callable[[], Any]) -> Any:
    """Waits for something to become true, and returns it."""
    deadline = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline:
        if found := is_so():
            return found
        time.sleep(0.01)
    raise AssertionError(f"not within {PATIENCE_S} s: {what}")


class Process:
    """A program that a test has started."""

    def __init__(self, command: list[str], folder: Path) -> None:
        self.command = command
        # The domain is that of the test, by its environment.
        self.running = subprocess.Popen(
            command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        self.stdout: list[str] = []
        self.stderr: list[str] = []
        pipes = [(self.running.stdout, self.stdout), (self.running.stderr, self.stderr)]
        self.threads = [
            threading.Thread(target=into.extend, args=(pipe,), daemon=True) for pipe, into in pipes
        ]
        for thread in self.threads:
            thread.start()

    @property
    def printed(self) -> str:
        return "".join(self.stdout) + "".join(self.stderr)

    def wait_for(self, text: str) -> None:
        """Waits until it prints a text."""

        def is_so() -> bool:
            if self.running.poll() is not None:
                for thread in self.threads:
                    thread.join()
                assert text in self.printed, f"{self.command} ended:\n{self.printed}"
            return text in self.printed

        wait_until(f"{self.command} prints {text!r}: {self.printed}", is_so)

    def finish(self, by: int | None = None) -> int:
        """Waits for its end, asked for by a signal or not, and returns its exit status."""
        if by is not None:
            self.running.send_signal(by)
        status = self.running.wait(PATIENCE_S)
        for thread in self.threads:
            thread.join()
        return status


class Domain:
    """A domain that nobody else uses, and a folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.prefix = f"isopytest{os.getpid()}_{time.monotonic_ns()}_"
        self.file = folder / "domain.toml"
        root = folder / "iceoryx2"
        self.file.write_text(f'[global]\nroot-path = "{root}"\nprefix = "{self.prefix}"\n')
        self.processes: list[Process] = []

    def write(self, name: str, text: str) -> Path:
        path = self.folder / name
        path.write_text(text)
        return path

    def start(self, *arguments: str) -> Process:
        """Starts isochrone."""
        return self.start_program(str(isochrone()), *arguments)

    def start_program(self, *command: str) -> Process:
        process = Process(list(command), self.folder)
        self.processes.append(process)
        return process

    def start_python(self, program: Path, *arguments: str) -> Process:
        return self.start_program(sys.executable, "-u", str(program), *arguments)

    def node(self, configuration: str, *arguments: str) -> Process:
        """Starts a node, and waits until it runs."""
        self.write("node.toml", configuration)
        node = self.start("run", "node.toml", *arguments)
        node.wait_for("is running")
        return node

    def leftovers(self) -> list[str]:
        """What is left in shared memory, without what counts the domain's nodes."""
        files = [file for file in os.listdir("/dev/shm") if file.startswith(self.prefix)]
        return [file for file in files if not file.endswith(".global_mgmt")]

    def end(self) -> None:
        for process in self.processes:
            if process.running.poll() is None:
                process.running.send_signal(signal.SIGTERM)
        for process in self.processes:
            try:
                process.running.wait(PATIENCE_S)
            except subprocess.TimeoutExpired:
                process.running.kill()
                process.running.wait()
        for file in os.listdir("/dev/shm"):
            if file.startswith(self.prefix):
                os.unlink(os.path.join("/dev/shm", file))


@pytest.fixture
def domain(monkeypatch: pytest.MonkeyPatch) -> Iterator[Domain]:
    # Not pytest's folders, whose paths are too long for iceoryx2.
    folder = Path(tempfile.mkdtemp(prefix="isopy"))
    domain = Domain(folder)
    monkeypatch.setenv("ICEORYX2_CONFIG", str(domain.file))
    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")
    try:
        yield domain
    finally:
        domain.end()
        shutil.rmtree(folder)


RAMP = """
[node]
name = "level"
control = "force"
[[task]]
name = "fast"
period = "5ms"
[[input]]
name = "target"
service = "plant/target"
signal = "y"
default = 1.0
max_age = "200ms"
[[block]]
name = "ramp"
type = "LimRateOfChangeCI"
in = { value = "target", setChangeRate = 10.0 }
[[output]]
service = "plant/level"
signals = ["ramp.delayedValue", "target"]
"""


@pytest.fixture
def ramp(domain: Domain) -> Process:
    """A node "level" with a ramp to `y` of plant/target."""
    return domain.node(RAMP)
