"""Chooses the corpus of a target: of all files that libFuzzer looked at for a merge, those that reach most, few and small.

    python3 fuzz/choose.py TARGET CONTROL_FILE
"""

import hashlib
import pathlib
import sys

MOST_FILES = 40
MOST_BYTES = 33_000

target, control = sys.argv[1], pathlib.Path(sys.argv[2])
lines = control.read_text().splitlines()
paths = [pathlib.Path(line) for line in lines[2 : 2 + int(lines[0])]]
reached = {}
for line in lines[2 + len(paths) :]:
    kind, index, *features = line.split()
    if kind == "FT":
        reached[paths[int(index)]] = set(features)

corpus = pathlib.Path("fuzz/corpus", target)
# What a person named stays: it is an example, or was a finding.
named = [path for path in corpus.iterdir() if len(path.name) < 40]
known = set().union(*(reached.pop(path, set()) for path in named))
left = MOST_BYTES - sum(path.stat().st_size for path in named)
chosen = {}
while len(named) + len(chosen) < MOST_FILES:

    def gain(path):
        # Bytes count where files are large.
        return len(reached[path] - known) / (1000 + path.stat().st_size)

    best = max((path for path in reached if path.stat().st_size <= left), key=gain, default=None)
    if best is None or gain(best) == 0:
        break
    known |= reached.pop(best)
    content = best.read_bytes()
    left -= len(content)
    chosen[hashlib.sha1(content).hexdigest()] = content
for path in set(corpus.iterdir()) - set(named):
    path.unlink()
for name, content in chosen.items():
    (corpus / name).write_bytes(content)
print(f"{target}: {len(named) + len(chosen)} files, {MOST_BYTES - left} bytes, {len(known)} features")
