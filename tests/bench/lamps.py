"""Counts what many lamps cost with a budget and without: lamps.py FOLDER

Writes FOLDER/lamps.md. Valgrind counts the instructions of seeing and lighting tiles, which are
the same on a busy machine, as times are not. Ten thousand lamps would take it an hour, so that
growth with numbers is told in processor time: of one run, in turns, as ratios. `./dev bench
--lamps` builds what this needs and runs it."""

import json
import os
import random
import re
import resource
import statistics
import sys
from pathlib import Path

import growth
import programs
import scenes

BUDGET = {"maxError": 0.5}


def around(count):
    """At random distances in all directions from the sphere."""
    draw = random.Random(growth.SEED)
    result = []
    for i in range(count):
        way = [draw.gauss(0, 1) for _ in range(3)]
        far = draw.uniform(2, 8) / sum(w * w for w in way) ** 0.5
        result.append({"type": "point", "attenuation": [0, 0, 1], "intensity": 20 / count,
                       "color": scenes.TINTS[i % 4], "position": growth.rounded(
                           w * far for w in way)})
    return result


# What is lit, by how many lamps, and its document.
ROWS = (
    ("a sphere, lamps around it", 1024, lambda n, **more: scenes.scene(around(n), **more)),
    ("a sphere, lamps before it on a disc", 1024,
     lambda n, **more: scenes.scene(scenes.lamps(n), **more)),
    ("a plane and 200 spheres, lamps above them", 100, growth.lamps),
)
NUMBERS = (100, 1000, 10000)
ROUNDS = 3


def rendering(document, name):
    """The command that renders a document, which it writes."""
    scene, picture = programs.WORK / f"{name}.json", programs.WORK / f"{name}.png"
    text = json.dumps(document).replace('"RADIUS"', "1").replace('"TURN"', "-0.5")
    scene.write_text(text, encoding="utf-8")
    return [os.path.join(programs.BUILD, "shade"), "render", str(scene), "-o", str(picture),
            "--threads", "1"]


def count(document):
    """Million instructions in tiles."""
    told = programs.run(["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null",
                         "--toggle-collect=shd_tile_look", *rendering(document, "lamps")]).stderr
    return int(re.search(rb"Collected : (\d+)", told)[1]) / 1e6


def processor_seconds(command):
    """Of the command and its threads, in user space."""
    began = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    programs.run(command)
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - began


def grow():
    """Rows of the processor time of so many lamps, whole and less that of the scene without any."""
    commands = {number: rendering(growth.lamps(number, accuracy=BUDGET), f"lamps{number}")
                for number in NUMBERS}
    commands[0] = rendering({**growth.lamps(1), "lights": [], "accuracy": BUDGET}, "lamps0")
    spent = {number: [] for number in commands}
    for _ in range(ROUNDS):
        for number, command in commands.items():
            spent[number].append(processor_seconds(command))
    seconds = {number: statistics.median(values) for number, values in spent.items()}
    first = seconds[NUMBERS[0]] - seconds[0]
    for number in NUMBERS:
        lit = seconds[number] - seconds[0]
        yield (f"| {number:,} | {seconds[number] * 1e3:,.0f} | {lit * 1e3:,.0f} | "
               f"{lit / first:.1f} |")


def main():
    folder = Path(sys.argv[-1])
    programs.WORK.mkdir(parents=True, exist_ok=True)
    lines = [
        "# What many lamps cost", "",
        "What `./dev bench --lamps` has counted: million instructions of seeing and lighting the",
        "tiles of 512x512 pixels, by valgrind's callgrind, with kernels that it can run (AVX2).",
        "Budgets are 0.5 CIEDE2000.", "",
        "| lit | lamps | with a budget | without | times |",
        "| --- | --- | --- | --- | --- |"]
    for name, number, make in ROWS:
        few, whole = count(make(number, accuracy=BUDGET)), count(make(number))
        lines.append(f"| {name} | {number:,} | {few:,.0f} | {whole:,.0f} | {whole / few:.2f} |")
        print(lines[-1], flush=True)
    lines += [
        "", "How that grows with the number of lamps above the plane and 200 spheres: milliseconds",
        "of one processor in user space, of the whole command and of what it takes more than",
        "without lamps, as medians of one run. The more lamps there are, the fainter is each.", "",
        "| lamps | with a budget | by lamps | times |", "| --- | --- | --- | --- |"]
    for row in grow():
        lines.append(row)
        print(row, flush=True)
    page = "\n".join(lines) + "\n"
    (folder / "lamps.md").write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
