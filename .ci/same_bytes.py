"""Runs one drawn experiment of the quick report once more, with another number of threads, and compares every file byte for byte.

    python3 .ci/same_bytes.py [ID]

What depends on the machine is left out: index.html, report.json and timings/. Compares with target/reproduce, which
`cargo run --release` has just written. The comparison is shown to work first: a changed byte must be found.
"""

import json
import os
import random
import subprocess
import sys
import tempfile
from pathlib import Path

REPORT = Path("target/reproduce")
LONGEST = 60.0  # seconds of an experiment that may be drawn


def files(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def differing(ours, theirs):
    return sorted(name for name in ours.keys() | theirs.keys() if ours.get(name) != theirs.get(name))


def main():
    report = json.loads((REPORT / "report.json").read_text())
    costs = {entry["id"]: entry["seconds"] for entry in report["experiments"]}
    drawn = [name for name, seconds in costs.items() if seconds < LONGEST and files(REPORT / name)]
    name = sys.argv[1] if len(sys.argv) > 1 else random.choice(drawn)
    threads = 1 if report["environment"]["threads"] != 1 else 2
    print(f"{name}: {report['environment']['threads']} threads against {threads}", flush=True)
    first = files(REPORT / name)
    broken = dict(first)
    victim = min(broken)
    broken[victim] = broken[victim][:-1] + bytes([broken[victim][-1] ^ 1])
    if differing(first, broken) != [victim]:
        sys.exit("the comparison did not find a changed byte")
    with tempfile.TemporaryDirectory() as folder:
        command = ["target/release/reproduce", "run", name, "--out", folder]
        environment = dict(os.environ, RAYON_NUM_THREADS=str(threads))
        subprocess.run(command, env=environment, check=True, stdout=subprocess.DEVNULL)
        wrong = differing(first, files(Path(folder) / name))
    if wrong:
        sys.exit(f"{name}: files that differ between numbers of threads: {', '.join(wrong)}")
    print(f"{len(first)} files with the same bytes")


main()
