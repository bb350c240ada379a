"""How many instructions tiers and budgets take from rays to codes, which needs no quiet machine:
instructions.py FOLDER, where build/shade is built. valgrind knows no AVX-512."""

import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import scenes

SHADE = Path(__file__).resolve().parents[2] / "build/shade"
KERNELS = ("portable", "avx2")
TIERS = ("draft", "standard", "exact")
BUDGETS = ({"maxError": 0.01, "metric": "linear"}, {"maxError": 1e-6, "metric": "linear"},
           {"maxError": 0.5, "metric": "deltaE2000"}, {"maxError": 1, "metric": "code"})
HEAD = """# Instructions of tiers and budgets

What `./dev bench --instructions` has counted: millions of instructions between the planned scene and 8-bit sRGB codes (`render_tile`, by
callgrind, on one thread), which need no quiet machine. The picture is that of [speed and error](../speed-and-error.md): 512x512, one
sphere, 4 attenuated point lights, shininess 50. They are no times: a vector's division counts as much as a copy, and AVX-512 is
not counted, because valgrind does not know it.

| samples | kernel | asked for | taken | million instructions | of `standard` | bound, linear |
| --- | --- | --- | --- | --- | --- | --- |
"""
OTHERS = """
## Other scenes

The same of what else such lights shine on, with one sample, in millions of instructions. A tier that costs as much as the one
before it is drawn as that one: no shape is sketched but spheres, ellipsoids, planes and
meshes without patterns.

| scene | kernel | `draft` | `standard` | `exact` | `standard` / `draft` | `exact` / `standard` |
| --- | --- | --- | --- | --- | --- | --- |
"""


def document(samples, accuracy):
    text = json.dumps(scenes.scene(scenes.lights(4, scenes.FADING), samples=samples,
                                   accuracy=accuracy))
    return text.replace('"RADIUS"', "1")


def counted(text, kernel):
    """Millions of instructions, and the plan's tier and bound."""
    with tempfile.TemporaryDirectory() as folder:
        run = subprocess.run(
            ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null",
             "--toggle-collect=render_tile", SHADE, "render", "-", "-o", f"{folder}/picture.png",
             "--threads", "1", "--kernel", kernel], input=text.encode(), capture_output=True,
            check=True)
    explained = json.loads(subprocess.run(
        [SHADE, "explain", "-", "--kernel", kernel], input=text.encode(), capture_output=True,
        check=True).stdout)
    number = int(re.search(rb"Collected : (\d+)", run.stderr)[1])
    return number / 1e6, explained["tier"], explained["bound"]["linear"]["most"]


def others():
    """Scenes beside the one sphere, by name."""
    ball = {"type": "sphere", "material": scenes.MATERIAL}
    steps = [{**ball, "radius": 0.45, "transform": {"translate": [x, y, 0]}}
             for x in (-1, 0, 1) for y in (-0.55, 0.55)]
    ground = {"type": "plane", "material": scenes.MATERIAL, "transform": {"translate": [0, -1, 0]}}
    checker = {**scenes.MATERIAL, "diffuse": {"pattern": "checker", "colors": [0.2, 0.8]}}
    places = [c for j in range(17) for i in range(32) for c in (i / 4, j / 4)]
    turned = {"rotate": [20, 30, 0]}
    return {"a sphere": [ball],
            "an ellipsoid": [{**ball, "transform": {**turned, "scale": [1, 0.8, 0.7]}}],
            "six spheres": steps,
            "a sphere on a plane": [ball, ground],
            "a mesh of 960 triangles": [{**scenes.ball(), "material": scenes.MATERIAL}],
            "the mesh with a pattern": [{**scenes.ball(), "uvs": places, "material": checker}],
            "a torus": [{**ball, "type": "torus"}],
            "a box": [{**ball, "type": "box", "transform": turned}]}


def count_others():
    rows = []
    for name, things in others().items():
        for kernel in KERNELS:
            draft, standard, exact = (counted(json.dumps(scenes.scene(
                scenes.lights(4, scenes.FADING), tier=tier, objects=things)), kernel)[0]
                                      for tier in TIERS)
            rows.append(f"| {name} | {kernel} | {draft:.1f} | {standard:.1f} | {exact:.1f} | "
                        f"{standard / draft:.2f} | {exact / standard:.2f} |")
    return rows


def asked(accuracy):
    return f"`{accuracy['tier']}`" if "tier" in accuracy else \
        f"{accuracy['maxError']:g} {accuracy['metric']}"


def main():
    rows = []
    for samples in (1, 4):
        for kernel in KERNELS:
            found = [(accuracy, *counted(document(samples, accuracy), kernel))
                     for accuracy in (*({"tier": tier} for tier in TIERS), *BUDGETS)]
            whole = found[1][1]
            rows += [f"| {samples} | {kernel} | {asked(accuracy)} | {tier} | {millions:.1f} | "
                     f"{millions / whole:.2f} | {bound:.2g} |"
                     for accuracy, millions, tier, bound in found]
    text = HEAD + "\n".join(rows) + "\n" + OTHERS + "\n".join(count_others()) + "\n"
    (Path(sys.argv[1]) / "instructions.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
