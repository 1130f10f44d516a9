"""docs/python.md, followed by copy and paste."""

from __future__ import annotations

import re
import shlex
import signal
from typing import Any

import pytest
from conftest import REPOSITORY, Domain, wait_until

from isochrone import Node

PAGE = (REPOSITORY / "docs/python.md").read_text()
PROGRAM = "target/release/isochrone"


def test_the_page_can_be_followed(
    domain: Domain, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(domain.folder)
    (domain.folder / "examples").symlink_to(REPOSITORY / "examples")
    blocks = re.findall(r"^```(sh|python|toml)\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    pasted: dict[str, Any] = {}
    sensor = None
    for language, text in blocks:
        if language == "python" and (file := re.match(r"# (\w+\.py)", text)):
            sensor = domain.start_python(domain.write(file[1], text))
            wait_until("the node has samples", lambda: Node("level").get("level_raw.ok"))
        elif language == "toml" and (file := re.match(r"# (\w+\.toml)", text)):
            domain.write(file[1], text)
        elif language == "python":
            exec(compile(text, "docs/python.md", "exec"), pasted)
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
    high = "high_level active_unacknowledged Tank above 1.6 m\nactive_acknowledged\n[] ["
    for text in [high, "level.y", "did you mean", "ramp.setChangeRat there is no signal"]:
        assert text in printed, printed

