#!/usr/bin/env python3
"""`./dev bench --cores`: what two threads make of large pictures' files, into docs/bench/cores.md.

Each round has every job once, with one thread and with two, one behind the other: what else the machine does meets
both alike. Ratios are of neighbors; what is told is their median. What one thread does alone is counted by valgrind,
which no other program changes."""

import json
import re
import statistics
import sys
import tempfile
from pathlib import Path

import programs

ROUNDS = 15
GROUND = {"type": "plane", "transform": {"rotate": [70, 0, 0]},
          "material": {"diffuse": {"pattern": "noise", "colors": [[0.1, 0.1, 0.2], [0.8, 0.7, 0.5]]}}}
BALL = {"type": "sphere", "material": {"specular": 0.3, "diffuse": {
    "pattern": "checker", "colors": [0.05, 0.9], "uv": {"scale": [16, 8]}}}}
OBJECTS = {"a sphere": [{"type": "sphere"}], "patterns": [GROUND, BALL]}
SIZES = {"png": (2048, 4096), "jpeg": (2048,)}
PAGE = """# What two cores make of a large picture's file

Made by `./dev bench --cores` on {processor}: the stage that encodes, and all from the request to
the file, with two threads, each on a core of its own, against one; ratios of neighboring runs, and medians of {rounds}.
`alone` is the share of the stage's instructions that one thread does while others wait, by valgrind.

| picture | file | ms with one | with two | times faster | whole request | alone |
| --- | --- | --- | --- | --- | --- | --- |
{rows}

Wanted: {wanted} times.
"""
WANTED = 1.8


def document(name, size, form):
    return {"objects": OBJECTS[name], "image": {"width": size, "height": size, "samples": 1}, "output": {"format": form}}


def alone(name, size, form):
    """The share of the stage's instructions that are in no loop that threads share, in percent."""
    with tempfile.TemporaryDirectory() as folder:
        path, found = Path(folder, "scene.json"), Path(folder, "found")
        path.write_text(json.dumps(document(name, size, form)), encoding="ascii")
        programs.run(["valgrind", "--tool=callgrind", f"--callgrind-out-file={found}", "--collect-atstart=no",
                      "--toggle-collect=shd_image_encode", programs.BUILD / "shade", "render", path, "-o",
                      Path(folder, f"out.{form}"), "--threads", 1])
        told = programs.run(["callgrind_annotate", "--inclusive=yes", "--threshold=100", found]).stdout.decode()

    def count(function):
        return int(re.search(rf"^\s*([\d,]+) .*:{function} ", told, re.M)[1].replace(",", ""))

    return 100 * (1 - count("shd_encode_spread") / count("shd_image_encode"))


def main():
    folder, rounds = Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else ROUNDS
    kinds = [(name, size, form) for form, sizes in SIZES.items() for size in sizes for name in OBJECTS]
    jobs = [{"text": json.dumps(document(*kind)), "format": kind[2], "keep": False, "threads": threads}
            for kind in kinds for threads in (1, 2)]
    samples = programs.library(jobs, rounds, core=None, warm=1)
    rows = []
    for kind, one, two in zip(kinds, samples[::2], samples[1::2]):
        faster = {stage: statistics.median(a / b for a, b in zip(one[stage], two[stage])) for stage in ("encode", "wall")}
        name, size, form = kind
        rows.append(f"| {name}, {size}x{size} | {form.upper()} | {1e3 * statistics.median(one['encode']):.1f} | "
                    f"{1e3 * statistics.median(two['encode']):.1f} | {faster['encode']:.2f} | {faster['wall']:.2f} | "
                    f"{alone(*kind):.1f} % |")
    page = PAGE.format(processor=programs.machine()["processor"], rounds=rounds, rows="\n".join(rows), wanted=WANTED)
    (folder / "cores.md").write_text(page, encoding="utf-8")
    print(page)


if __name__ == "__main__":
    main()
