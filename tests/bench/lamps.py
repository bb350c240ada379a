"""Counts what many lamps cost with a budget and without: lamps.py FOLDER

Writes FOLDER/lamps.md. Valgrind counts the instructions of seeing and lighting tiles, which are
the same on a busy machine, as times are not. `./dev bench --lamps` builds what this needs and runs
it."""

import json
import os
import random
import re
import subprocess
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


# What is lit, by how many lamps, its document, and whether it is lit without a budget, too.
ROWS = (
    ("a sphere, lamps around it", 1024, lambda n, **more: scenes.scene(around(n), **more), True),
    ("a sphere, lamps before it on a disc", 1024,
     lambda n, **more: scenes.scene(scenes.lamps(n), **more), True),
    ("a plane and 200 spheres, lamps above them", 100, growth.lamps, True),
    ("a plane and 200 spheres, lamps above them", 10000, growth.lamps, False),  # an hour
)


def count(document):
    """Million instructions in tiles."""
    scene, picture = programs.WORK / "lamps.json", programs.WORK / "lamps.png"
    text = json.dumps(document).replace('"RADIUS"', "1").replace('"TURN"', "-0.5")
    scene.write_text(text, encoding="utf-8")
    told = subprocess.run(
        ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null",
         "--toggle-collect=shd_tile_look", os.path.join(programs.BUILD, "shade"), "render",
         str(scene), "-o", str(picture), "--threads", "1"],
        check=True, capture_output=True, text=True, env=programs.clean_environment()).stderr
    return int(re.search(r"Collected : (\d+)", told)[1]) / 1e6


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
    for name, number, make, both in ROWS:
        few, whole = count(make(number, accuracy=BUDGET)), count(make(number)) if both else None
        beside = f"{whole:,.0f} | {whole / few:.2f}" if both else " | "
        lines.append(f"| {name} | {number:,} | {few:,.0f} | {beside} |")
        print(lines[-1], flush=True)
    page = "\n".join(lines) + "\n"
    (folder / "lamps.md").write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
