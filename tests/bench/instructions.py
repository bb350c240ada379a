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
    (Path(sys.argv[1]) / "instructions.md").write_text(HEAD + "\n".join(rows) + "\n",
                                                       encoding="utf-8")


if __name__ == "__main__":
    main()
