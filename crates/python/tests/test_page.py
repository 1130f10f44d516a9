"""docs/python.md, followed by copy and paste."""

from __future__ import annotations

import code
import re
import shlex
import signal
import sys
from types import CodeType
from typing import Any

import pytest
from conftest import REPOSITORY, Domain, wait_until

from isochrone import Node

PAGE = (REPOSITORY / "docs/python.md").read_text()
PROGRAM = "target/release/isochrone"


class Prompt(code.InteractiveConsole):
    """Python before 3.13, which takes what is pasted line by line."""

    def paste(self, text: str) -> None:
        # At the end one presses Enter: a part may end indented.
        for line in [*text.splitlines(), ""]:
            self.push(line)

    def runcode(self, code: CodeType) -> None:
        exec(code, self.locals)  # type: ignore[arg-type]

    def showsyntaxerror(self, filename: str | None = None, **_: Any) -> None:
        raise sys.exc_info()[1]  # type: ignore[misc]


def test_the_page_can_be_followed(
    domain: Domain, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(domain.folder)
    (domain.folder / "examples").symlink_to(REPOSITORY / "examples")
    blocks = re.findall(r"^```(sh|python|toml)\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    pasted: dict[str, Any] = {}
    prompt = Prompt(pasted, "docs/python.md")
    sensor = None
    for language, text in blocks:
        if language == "python" and (file := re.match(r"# (\w+\.py)", text)):
            sensor = domain.start_python(domain.write(file[1], text))
            wait_until("the node has samples", lambda: Node("level").get("level_raw.ok"))
        elif language == "toml" and (file := re.match(r"# (\w+\.toml)", text)):
            domain.write(file[1], text)
        elif language == "python":
            prompt.paste(text)
        elif text.startswith(PROGRAM):
            # Those lines that install the package are tried by whoever runs this test.
            started = domain.start(*shlex.split(text)[1:])
            if "--seconds" in text:
                assert started.finish() == 0, started.printed
            else:
                started.wait_for("is running")
    assert sensor is not None and sensor.finish(signal.SIGINT) != 0
    assert len(pasted["frames"]) == 500 and pasted["frame"].values.size == 0
    assert len(pasted["trace"].cycle) > 100 and len(pasted["out"]["time_s"]) == 10_000
    assert len(pasted["tank"].time) > 1000
    printed = capsys.readouterr().out
    high = "high_level active_unacknowledged Tank above 1.6 m\nactive_acknowledged\n"
    for text in [high, "\n[] []\n", "\n0.5 2.42", "level.y", "did you mean", "ramp.setChangeRat there is no signal"]:
        assert text in printed, printed

