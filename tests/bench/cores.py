#!/usr/bin/env python3
"""`./dev bench --cores`: what two cores make of large pictures' files, into docs/bench/cores.md.

Each round has every picture once on one core and once on two, one behind the other: what else the machine does meets
both alike. A program that is told to use one thread still writes what is encoded beside that: so it is kept on one core.
Ratios are of neighbors; what is told is their median. What one thread does alone of encoding is counted by valgrind, which
no other program changes, of the smaller pictures: the larger ones have the same loops."""

import json
import re
import statistics
import sys
import tempfile
import time
from pathlib import Path

import programs

ROUNDS = 5
GROUND = {"type": "plane", "transform": {"rotate": [70, 0, 0]},
          "material": {"diffuse": {"pattern": "noise", "colors": [[0.1, 0.1, 0.2], [0.8, 0.7, 0.5]]}}}
BALL = {"type": "sphere", "material": {"specular": 0.3, "diffuse": {
    "pattern": "checker", "colors": [0.05, 0.9], "uv": {"scale": [16, 8]}}}}
OBJECTS = {"a sphere": [{"type": "sphere"}], "patterns": [GROUND, BALL]}
COUNTED = 2048
SIZES = {"png": (COUNTED, 4096), "jpeg": (COUNTED,)}
SMALL = 16
PAGE = """# What two cores make of a large picture's file

Made by `./dev bench --cores` on {processor}: `shade render` on one core with one thread, and on two cores with two,
less what a picture of {small} x {small} pixels takes; ratios of neighboring runs, and medians of {rounds}. `alone` is the share of
the instructions of encoding that one thread does while others wait, by valgrind.

| picture | file | ms on one core | on two | times faster | alone |
| --- | --- | --- | --- | --- | --- |
{rows}

Wanted: {wanted} times. What is rendered and encoded in a moment waits for the rest: memory that the kernel clears, and the file.
More than 2 times is no doing of threads: the kernel had more to do for memory while there was one core.
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


def seconds(folder, kind, cores):
    path = Path(folder, "scene.json")
    path.write_text(json.dumps(document(*kind)), encoding="ascii")
    begin = time.monotonic()
    programs.run(["taskset", "-c", ",".join(map(str, range(cores))), programs.BUILD / "shade", "render", path, "-o",
                  Path(folder, f"out.{kind[2]}"), "--threads", cores])
    return time.monotonic() - begin


def measure(folder, kind, cores):
    name, _, form = kind
    return seconds(folder, kind, cores) - seconds(folder, (name, SMALL, form), cores)


def main():
    folder, rounds = Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else ROUNDS
    kinds = [(name, size, form) for form, sizes in SIZES.items() for size in sizes for name in OBJECTS]
    with tempfile.TemporaryDirectory() as scratch:
        runs = [[[measure(scratch, kind, cores) for cores in (1, 2)] for kind in kinds] for _ in range(rounds)]
    rows = []
    for kind, pairs in zip(kinds, zip(*runs)):
        one, two = (1e3 * statistics.median(times) for times in zip(*pairs))
        faster = statistics.median(a / b for a, b in pairs)
        name, size, form = kind
        told = f"{alone(*kind):.1f} %" if size == COUNTED else ""
        rows.append(f"| {name}, {size}x{size} | {form.upper()} | {one:.0f} | {two:.0f} | {faster:.2f} | {told} |")
    page = PAGE.format(processor=programs.machine()["processor"], rounds=rounds, small=SMALL, rows="\n".join(rows),
                       wanted=WANTED)
    (folder / "cores.md").write_text(page, encoding="utf-8")
    print(page)


if __name__ == "__main__":
    main()
