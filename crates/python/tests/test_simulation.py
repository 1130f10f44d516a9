"""Configurations without a clock."""

from __future__ import annotations

import csv
import os
import signal
import subprocess
import threading
import time

import numpy as np
import pytest
from conftest import RAMP, Domain, isochrone as program

import isochrone
from isochrone import simulate


def test_a_simulation_has_the_values_of_the_command_line_bit_for_bit(domain: Domain) -> None:
    target = np.concatenate([np.zeros(10), np.linspace(0.0, 3.0, 90)])
    path = domain.write("ramp.toml", RAMP)
    given = domain.folder / "in.csv"
    with given.open("w") as rows:
        rows.write("target,target.age\n")
        rows.writelines(f"{value!r},0.25\n" if n == 50 else f"{value!r},0.0\n" for n, value in enumerate(target.tolist()))
    told = domain.folder / "out.csv"
    command = [program(), "simulate", path, "--inputs", given, "--output", told, "--cycles", "150"]
    subprocess.run(command, check=True)
    with told.open() as rows:
        expected = list(csv.DictReader(rows))
    age = np.where(np.arange(100) == 50, 0.25, 0.0)
    out = simulate(path, {"target": target, "target.age": age}, cycles=150)
    assert list(out) == ["time_s", "ramp.delayedValue", "target"]
    assert out["time_s"][:3].tolist() == [0.0, 0.005, 0.01]
    for name in ("ramp.delayedValue", "target"):
        assert out[name].tolist() == [float(row[name]) for row in expected]


def test_inputs_may_be_lists_scalars_and_variables_and_signals_are_chosen_by_globs() -> None:
    text = RAMP.replace('"target"]', '"target", "v"]') + '[[variable]]\nname = "v"\ninitial = 1.0\n'
    out = simulate(text, {"target": 2.0, "v": [1, 2, 3]}, signals=["ramp.set*", "v", "target.ok"])
    assert out["v"].tolist() == [1.0, 2.0, 3.0]
    assert out["target.ok"].tolist() == [1.0, 1.0, 1.0]
    assert "ramp.setChangeRate" in out and "ramp.delayedValue" not in out
    assert len(simulate(text, cycles=0)["time_s"]) == 0
    assert simulate(text, {"target": 2.0}, cycles=3)["target"].tolist() == [2.0, 2.0, 2.0]


def test_a_data_frame_is_made_where_it_is_asked_for() -> None:
    pytest.importorskip("pandas")
    table = simulate(RAMP, {"target": np.ones(4)}, pandas=True)
    assert list(table.columns) == ["ramp.delayedValue", "target"]
    assert table.index.name == "time_s" and table.index.tolist() == [0.0, 0.005, 0.01, 0.015]


def test_a_hundred_thousand_cycles_are_computed_and_their_number_is_right() -> None:
    out = simulate(RAMP, {"target": np.ones(100_000)})
    assert len(out["target"]) == 100_000 and out["ramp.delayedValue"][-1] == 1.0


def test_what_cannot_be_simulated_is_refused_in_words(domain: Domain) -> None:
    for arguments, options, error, says in [
        (["none.toml"], {"cycles": 1}, isochrone.Error, "cannot read none.toml"),
        (["[node]\nname = 5\n"], {"cycles": 1}, isochrone.Error, "configuration: "),
        ([RAMP], {}, ValueError, "give cycles, or inputs"),
        ([RAMP, {"target": 1.0}], {}, ValueError, "give cycles, or an array for an input"),
        ([RAMP], {"cycles": -1}, ValueError, "cycles is -1"),
        ([RAMP], {"cycles": 2**62}, MemoryError, "do not fit into memory"),
        ([RAMP, {"tarjet": [1.0]}], {}, KeyError, "no input or variable"),
        ([RAMP, {"target": [1.0], "target.ok": [1, 1]}], {}, ValueError, "has 1"),
        ([RAMP, {"target": [[1.0]]}], {}, ValueError, "has the shape (1, 1)"),
        ([RAMP, {"target": ["a"]}], {}, ValueError, "could not convert"),
        ([RAMP], {"cycles": 1, "task": "fats"}, ValueError, "there is: fast"),
        ([RAMP], {"cycles": 1, "signals": ["nothing"]}, KeyError, "nothing"),
        ([RAMP], {"cycles": 1, "signals": "target"}, TypeError, "give a list of names"),
    ]:
        with pytest.raises(error) as refused:
            simulate(*arguments, **options)  # type: ignore[call-overload]
        assert says in str(refused.value), str(refused.value)


def test_samples_that_do_not_fit_are_a_warning() -> None:
    text = RAMP.replace('"target"]', '"target", "n"]')
    text += '[[input]]\nname = "n"\nservice = "plant/n"\ntype = "INT"\n'
    with pytest.warns(UserWarning, match="n is INT, which cannot hold 0.5"):
        out = simulate(text, {"n": [3.0, 0.5]}, signals=["n"])
    assert out["n"].tolist() == [3.0, 3.0]


def test_ctrl_c_ends_a_simulation() -> None:
    interrupt = threading.Thread(
        target=lambda: (time.sleep(0.5), os.kill(os.getpid(), signal.SIGINT))
    )
    interrupt.start()
    with pytest.raises(KeyboardInterrupt):
        simulate(RAMP, cycles=200_000_000, signals=["target"])
    interrupt.join()
