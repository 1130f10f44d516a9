#!/usr/bin/env python3
"""Writes the digests that the blocks are compared with, or shows a case.

make.py [BLOCK ...]        write BLOCK.txt, or those of all blocks
make.py --check            fail if a file is not what its oracle makes
make.py --case N BLOCK     print the inputs and outputs of a case, cycle by cycle

Each other file here but common.py has the oracles of a family of blocks.
"""

import argparse
import importlib
import signal
import sys
from pathlib import Path

sys.dont_write_bytecode = True
import common  # noqa: E402

HERE = Path(__file__).resolve().parent


def oracles():
    """All oracles, by the names of their blocks."""
    found = {}
    for path in sorted(HERE.glob("*.py")):
        if path.stem in ("common", "make"):
            continue
        for member in vars(importlib.import_module(path.stem)).values():
            if isinstance(member, type) and issubclass(member, common.Oracle) and member.NAME:
                if found.setdefault(member.NAME, member) is not member:
                    sys.exit(f"{member.NAME} has two oracles")
    return found


def page(block):
    """The file of a block: its pins, then a digest for each case."""
    lines = []
    for pin in block.INPUTS:
        usual = "".join(f" {common.text(float(value))}" for value in pin.usual)
        lines.append(f"in {pin.name} {pin.pin_type}{usual}")
    lines += [f"out {pin.name} {pin.pin_type}" for pin in block.OUTPUTS]
    lines += [f"{common.digest(block, number):016x}" for number in range(common.CASES)]
    return "\n".join(lines) + "\n"


def show(block, number):
    for cycle, inputs, outputs in common.run(block, number):
        pins = [f"{name}={common.text(value)}" for name, value in inputs.items()]
        results = [f"{pin.name}={common.text(value)}" for pin, value in zip(block.OUTPUTS, outputs)]
        print(f"{cycle.index} x {cycle.period_ns} ns: {' '.join(pins)} -> {' '.join(results)}")


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("blocks", nargs="*", metavar="BLOCK")
    arguments.add_argument("--case", type=int, metavar="N")
    arguments.add_argument("--check", action="store_true")
    options = arguments.parse_args()
    known = oracles()
    for name in options.blocks:
        if name not in known:
            sys.exit(f"{name} has no oracle; there are {', '.join(known) or 'none'}")
    chosen = [known[name] for name in options.blocks] or list(known.values())
    if options.case is not None:
        if len(chosen) != 1:
            sys.exit("name one block")
        show(chosen[0], options.case)
        return
    outdated = []
    for block in chosen:
        path, made = HERE / f"{block.NAME}.txt", page(block)
        if options.check:
            if not path.exists() or path.read_text() != made:
                outdated.append(path.name)
        else:
            path.write_text(made)
    if outdated:
        sys.exit(f"not what the oracles make: {', '.join(outdated)}; run make.py and look at what changed")


signal.signal(signal.SIGPIPE, signal.SIG_DFL)
main()
