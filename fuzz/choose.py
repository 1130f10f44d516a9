"""Chooses the corpus of a target: of all files that libFuzzer looked at for a merge, those that reach most, few and small.

    python3 fuzz/choose.py TARGET CONTROL_FILE
"""

import hashlib
import pathlib
import sys

MOST_FILES = 40
MOST_BYTES = 30_000

target, control = sys.argv[1], pathlib.Path(sys.argv[2])
lines = control.read_text().splitlines()
paths = [pathlib.Path(line) for line in lines[2 : 2 + int(lines[0])]]
reached = {}
for line in lines[2 + len(paths) :]:
    kind, index, *features = line.split()
    if kind == "FT":
        reached[paths[int(index)]] = set(features)

corpus = pathlib.Path("fuzz/corpus", target)
# What a person named says more than a hash does.
named = lambda path: path.parent == corpus and len(path.name) < 40
chosen, known, left = {}, set(), MOST_BYTES
while len(chosen) < MOST_FILES:
    def gain(path):
        return len(reached[path] - known) * (2 if named(path) else 1) / (100 + path.stat().st_size)

    fitting = [path for path in reached if path.stat().st_size <= left]
    best = max(fitting, key=gain, default=None)
    if best is None or gain(best) == 0:
        break
    known |= reached.pop(best)
    content = best.read_bytes()
    left -= len(content)
    chosen[best.name if named(best) else hashlib.sha1(content).hexdigest()] = content
for path in corpus.iterdir():
    path.unlink()
for name, content in chosen.items():
    (corpus / name).write_bytes(content)
print(f"{target}: {len(chosen)} files, {MOST_BYTES - left} bytes, {len(known)} features")
