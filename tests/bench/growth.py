"""Measures how time grows with numbers: growth.py FOLDER, or growth.py --count FOLDER

Writes FOLDER/growth.md. All times are of one run, on one core: of a scene's sizes, one after the
other, in turns. `./dev bench --growth` builds what this needs and runs it.

With --count, writes FOLDER/growth-instructions.md: valgrind counts instructions, which no other
program on the machine changes. `./dev bench --growth-count` does that."""

import json
import math
import random
import re
import sys
import tempfile
from pathlib import Path

import programs
from priority import raise_priority

ROUNDS = 5
CAMERA = {"position": [0, 0, 4], "target": [0, 0, 0], "fov": 28.0724869}  # sees the same at z = 0
# Digits that differ in every request, see jobs.h.
LAMP = {"type": "directional", "direction": ["TURN", -1, -2]}
COLORS = ([0.8, 0.3, 0.2], [0.2, 0.7, 0.3], [0.2, 0.3, 0.8], [0.7, 0.7, 0.2])
# What is drawn at random is drawn the same in every run.
SEED = 15


def scene(objects, *, size=512, samples=1):
    return {"image": {"width": size, "height": size, "samples": samples}, "camera": CAMERA,
            "ambient": 0.1, "lights": [LAMP], "objects": objects}


def colored(kind, number, **more):
    return {"type": kind, "material": {"diffuse": COLORS[number % 4], "specular": 0.2,
                                       "shininess": 20}, **more}


def rounded(values):
    return [round(v, 6) for v in values]


def spheres(count, **more):
    """Of half of the picture's area together, wherever they are."""
    draw = random.Random(SEED)
    radius = math.sqrt(0.5 * 4 / (math.pi * count))
    return scene([colored("sphere", i, radius=round(radius, 6), transform={"translate": rounded(
        (draw.uniform(-1, 1), draw.uniform(-1, 1), draw.uniform(-0.3, 0.3)))})
        for i in range(count)], **more)


def needles(count):
    """A mesh of triangles from corner to corner, and from front to back: half of the picture's area
    together, so that the more there are, the thinner they are. Boxes around them overlap all."""
    draw = random.Random(SEED)
    places, half = [], 0.25 / count * 2 * math.sqrt(2)
    for _ in range(count):
        aside = draw.uniform(-math.sqrt(2), math.sqrt(2))
        x, y = aside / math.sqrt(2), -aside / math.sqrt(2)
        for along, across in ((-1, -half), (-1, half), (1, draw.uniform(-half, half))):
            places += rounded((x + along + across / math.sqrt(2), y + along - across / math.sqrt(2),
                               0.3 * along))
    return scene([colored("mesh", 0, positions=places, indices=list(range(3 * count)))])


def stack(count):
    """Meshes of one triangle that fill the picture, one before the other."""
    return scene([colored("mesh", i, positions=[-3, -2, 0, 3, -2, 0, 0, 4, 0], indices=[0, 1, 2],
                          transform={"translate": [0, 0, round(-i / count, 6)]})
                  for i in range(count)])


def heap(count):
    """The same, from the last to the first: what comes later hides what came before."""
    document = stack(count)
    document["objects"].reverse()
    return document


def cloud(count):
    """A mesh of small triangles, wherever they are: half of the picture's area together."""
    draw = random.Random(SEED)
    places, side = [], math.sqrt(0.5 * 4 / count * 2)
    for _ in range(count):
        x, y, z = (draw.uniform(-1, 1) for _ in range(3))
        places += rounded((x, y, 0.3 * z, x + side, y, 0.3 * z, x, y + side, 0.3 * z))
    return scene([colored("mesh", 0, positions=places, indices=list(range(3 * count)))])


def grid(count):
    """A wavy sheet of so many triangles, which share their corners."""
    side = round(math.sqrt(count / 2))
    places, corners = [], []
    for k in range((side + 1) ** 2):
        x, y = k % (side + 1) / side * 2 - 1, k // (side + 1) / side * 2 - 1
        places += rounded((x, y, 0.2 * math.sin(7 * x) * math.cos(5 * y)))
    for k in range(side * side):
        at = k // side * (side + 1) + k % side
        corners += (at, at + 1, at + side + 1, at + 1, at + side + 2, at + side + 1)
    return scene([colored("mesh", 0, positions=places, indices=corners)])


def pictures(samples):
    """The same rays of 10,000 spheres: as many pixels, or as many samples."""
    return spheres(10000, size=512 if samples == 1 else 64, samples=samples)


def lamps(count, **more):
    """Over a plane and 200 spheres, as bright together whatever their number."""
    draw = random.Random(SEED)
    balls = [colored("sphere", i, radius=0.1, transform={"translate": rounded(
        (draw.uniform(-3, 3), 0.1, draw.uniform(-4, 2)))}) for i in range(200)]
    lights = [{"type": "point", "attenuation": [0, 0, 1], "intensity": round(40 / count, 9),
               "position": rounded((draw.uniform(-12, 12), draw.uniform(1, 3),
                                    draw.uniform(-16, 8)))} for _ in range(count)]
    lights[0] = {**LAMP, "intensity": 0.2}
    return {**scene([{"type": "plane", "material": {"diffuse": 0.7}}, *balls]),
            "camera": {"position": [0, 4, 8], "target": [0, 0, 0]}, "lights": lights, **more}


def crowds(count, **more):
    """As many lamps as spheres, all over each other's place; few pixels, for planning is meant."""
    draw = random.Random(SEED)
    def place(x, y, z):
        return rounded((draw.uniform(-x, x), draw.uniform(-y, y), draw.uniform(-z, z)))
    lights = [{"type": "point", "attenuation": [0, 0, 1], "intensity": round(10 / count, 9),
               "position": place(12, 5, 12)} for _ in range(count)]
    lights[0] = {**LAMP, "intensity": 0.2}
    balls = [colored("sphere", i, radius=0.02, transform={"translate": place(3, 3, 3)})
             for i in range(count)]
    return {**scene(balls, size=64), "lights": lights, **more}


def crowds_on_budget(count):
    return crowds(count, accuracy={"maxError": 0.5})


def mixed(count, **more):
    """The same of any color, spots and directional lights among them, and meshes among spheres."""
    draw = random.Random(SEED)
    document = crowds(count, **more)
    for i, light in enumerate(document["lights"]):
        light["color"] = rounded(draw.random() for _ in range(3))
        aim = rounded(draw.uniform(-1, 1) for _ in range(3))
        if i % 3 == 1:
            light.update(type="spot", direction=aim, angle=round(draw.uniform(10, 60), 3), penumbra=0.2)
        elif i % 10 == 2:
            light.clear()
            light.update(type="directional", direction=aim, intensity=0.2 / count)
    for ball in document["objects"][::4]:
        del ball["radius"]
        ball.update(type="mesh", positions=[0, 0, 0, 0.03, 0, 0, 0, 0.03, 0, 0, 0, 0.03],
                    indices=[0, 1, 2, 0, 2, 3, 0, 3, 1, 1, 3, 2])
    return document


def mixed_on_budget(count):
    return mixed(count, accuracy={"maxError": 0.5})


def plain(samples=1):
    """A sphere, and nothing said of it."""
    return {"objects": [{"type": "sphere", "radius": "RADIUS"}],
            "image": {"width": 512, "height": 512, "samples": samples}}


# What is grown: in words, by which numbers, and how much more ten times (or all) may cost.
ROWS = (
    ("spheres of equal coverage", spheres, (100, 1000, 10000), None, 3),
    ("diagonal needles, one mesh", needles, (100, 1000, 10000), 3, None),
    ("meshes of a triangle, one before the other, nearest first", stack, (10, 100, 1000), 3, None),
    ("the same, farthest first", heap, (10, 100, 1000), 3, None),
    ("small triangles of equal coverage, one mesh", cloud, (100, 1000, 10000), 3, None),
    ("10,000 spheres: 512x512 with 1 sample, 64x64 with 64", pictures, (1, 64), None, None),
    ("lamps and as many spheres", crowds, (100, 1000, 10000), None, None),
    ("the same with a budget", crowds_on_budget, (100, 1000, 10000), None, None),
    ("lamps of all kinds and colors, spheres and meshes", mixed, (100, 1000, 10000), None, None),
    ("those with a budget", mixed_on_budget, (100, 1000, 10000), None, None),
)
PLANNED = (crowds, crowds_on_budget, mixed, mixed_on_budget)  # and not counted by valgrind: minutes of light
MOST_PLANNING = 300  # milliseconds, of the largest of these


# From request to PNG, and by how much the whole may exceed what comes before encoding.
PLAIN = (("one sample, `default`", {}), ("`fast`", {"compression": "fast"}),
         ("`small`", {"compression": "small"}))
MOST_ENCODING = 1.5


def text(document):
    return json.dumps(document, separators=(",", ":")).replace('"TURN"', "-0.5@@@@@@").replace(
        '"RADIUS"', "1.00000@@@@@@")


def measure():
    jobs = {(row[0], number): {"text": text(row[1](number)), "format": "png", "keep": False}
            for row in ROWS for number in row[2]}
    samples = programs.library(list(jobs.values()), ROUNDS, warm=1)
    found = {key: programs.least(times) for key, times in zip(jobs, samples)}
    for times in found.values():
        times["visibility"] += times["build"]
    return found


def told(value):
    return f"{value:.3g}" if value < 1000 else f"{value:,.0f}"


def report(found, machine):
    lines = [
        "# How time grows", "",
        "What `./dev bench --growth` has measured: milliseconds of visibility and shading together,",
        "by the library's own clocks, the least of some rounds on one core. Visibility has the building of",
        "trees in it. Needles lie alike: of those in all directions, boxes still overlap.", "",
        f"On {machine['processor']}, {machine['system']}.", "",
        "| what | number | visibility | shading | together | times the one before | planning |",
        "| --- | --- | --- | --- | --- | --- | --- |"]
    wanted = ["", "| wanted | reached |", "| --- | --- |"]
    for name, make, numbers, step, whole in ROWS:
        seen = [found[name, n]["visibility"] + found[name, n]["shade"] for n in numbers]
        for k, number in enumerate(numbers):
            entry = found[name, number]
            times = f"{seen[k] / seen[k - 1]:.2f}" if k else ""
            lines.append(f"| {name} | {number:,} | {told(entry['visibility'])} | "
                         f"{told(entry['shade'])} | {told(seen[k])} | {times} | "
                         f"{told(entry['plan'])} |")
        steps = [b / a for a, b in zip(seen, seen[1:])]
        if step:
            wanted.append(f"| {name}: at most {step} times for 10 times the number | "
                          f"{max(steps):.2f} times |")
        if whole:
            wanted.append(f"| {name}: at most {whole} times from {numbers[0]:,} to {numbers[-1]:,} "
                          f"| {seen[-1] / seen[0]:.2f} times |")
        if make in PLANNED:
            wanted.append(f"| {name}: {numbers[-1]:,} planned in {MOST_PLANNING} ms | "
                          f"{told(found[name, numbers[-1]]['plan'])} ms |")
    return "\n".join(lines + wanted) + "\n"


def encoding():
    """The part of the page about a lone sphere's way to PNG."""
    jobs = [{"text": text({**plain(), "output": output}), "format": "png", "keep": False}
            for _, output in PLAIN]
    samples = programs.library(jobs, 5 * ROUNDS, warm=2)
    lines = ["", "## From request to PNG", "",
             "A lone sphere of 512 x 512 pixels: milliseconds of the processor, from JSON to bytes.", "",
             "| compression | before encoding | encoding | request | times what comes before | bytes |",
             "| --- | --- | --- | --- | --- | --- |"]
    for (name, _), values in zip(PLAIN, samples):
        found = programs.least(values)
        before = found["cpu"] - found["encode"]
        lines.append(f"| {name} | {told(before)} | {told(found['encode'])} | {told(found['cpu'])} | "
                     f"{found['cpu'] / before:.2f} | {values['bytes']:,} |")
    return "\n".join([*lines, "", f"Wanted, of `default`: at most {MOST_ENCODING} times."]) + "\n"


# What is counted: the functions that begin it, and those within that are not it.
PARTS = {"trees and rays": ("shd_sight_new", "render_tile"), "planning": ("shd_rendering_plan",),
         "reading, without the hash": ("shd_scene_read", "shd_scene_digest")}


def count(document, part):
    """The instructions that `shade` takes for a part of a picture, on one thread."""
    with tempfile.TemporaryDirectory() as folder:
        path, found = Path(folder, "scene.json"), Path(folder, "found")
        path.write_text(text(document).replace("@", "0"), encoding="ascii")
        programs.run(["valgrind", "--tool=callgrind", f"--callgrind-out-file={found}",
                      "--collect-atstart=no",
                      *(f"--toggle-collect={name}" for name in PARTS[part]),
                      programs.BUILD / "shade", "render", path, "-o", Path(folder, "out.png"),
                      "--threads", 1])
        return int(re.search(r"^(?:summary|totals): (\d+)", found.read_text(), re.M)[1]) / 1e6


def counts():
    """The page of instructions."""
    parts = ("trees and rays", "planning", "reading, without the hash")
    lines = [
        "# How instructions grow", "",
        "What `./dev bench --growth-count` has counted: millions of instructions of `shade render`",
        "under valgrind (which has AVX2 at most), for trees, rays and light together, for planning,",
        "and for reading without what the digest takes. The scenes are those of",
        "[how time grows](growth.md); what waits for memory shows there alone.", "",
        "| what | number | trees, rays, light | times the one before | planning | reading |",
        "| --- | --- | --- | --- | --- | --- |"]
    wanted = ["", "| wanted | reached |", "| --- | --- |"]
    for name, make, numbers, step, whole in ROWS:
        if make in PLANNED:
            continue
        found = [[count(make(number), part) for part in parts] for number in numbers]
        for k, (rays, plan, reading) in enumerate(found):
            times = f"{rays / found[k - 1][0]:.2f}" if k else ""
            lines.append(f"| {name} | {numbers[k]:,} | {told(rays)} | {times} | {told(plan)} | "
                         f"{told(reading)} |")
        if step:
            most = max(b[0] / a[0] for a, b in zip(found, found[1:]))
            wanted.append(f"| {name}: at most {step} times for 10 times the number | "
                          f"{most:.2f} times |")
        if whole:
            wanted.append(f"| {name}: at most {whole} times from {numbers[0]:,} to {numbers[-1]:,} "
                          f"| {found[-1][0] / found[0][0]:.2f} times |")
    lines += wanted
    lines += ["", "A sheet of triangles in one mesh:", "",
              "| triangles | reading | trees, rays, light | planning |", "| --- | --- | --- | --- |"]
    for number in (10000, 100000, 1000000):
        document = grid(number)
        rays, plan, reading = (count(document, part) for part in parts)
        lines.append(f"| {number:,} | {told(reading)} | {told(rays)} | {told(plan)} |")
    return "\n".join(lines) + "\n"


def main():
    folder = Path(sys.argv[-1])
    programs.WORK.mkdir(parents=True, exist_ok=True)
    if "--count" in sys.argv:
        (folder / "growth-instructions.md").write_text(counts(), encoding="utf-8")
        return
    raise_priority()
    page = report(measure(), programs.machine()) + encoding()
    (folder / "growth.md").write_text(page, encoding="utf-8")
    print(page)


if __name__ == "__main__":
    main()
