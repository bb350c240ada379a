"""The kernels of another machine, emulated, give the bits that this machine's give.

Pictures are compared in linear light: OpenColorIO's curves are its own on each kind of processor."""

import json
import os
import random
import re
import subprocess
import unittest
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

SOURCE = Path(os.environ["SHADED_SOURCE"])
OTHERS, OWN = Path(os.environ["SHADED_BUILD"]), SOURCE / "build"
EMULATOR = os.environ["SHADED_EMULATOR"].split()
TIERS = ("standard", "exact")
SHAPES = ("sphere", "box", "cylinder", "cone", "torus", "disc", "plane")


def run(*arguments, **options):
    done = subprocess.run(arguments, capture_output=True, check=False, timeout=500, **options)
    if done.returncode:
        raise AssertionError(f"{arguments} exits {done.returncode}: {done.stderr.decode()[:2000]}")
    return done


def picture(command, scene):
    return run(*command, "-", "-o", "-",
               input=json.dumps(scene).encode()).stdout


def made(seed):
    """A scene of any shapes, lights and highlights."""
    draw = random.Random(seed)

    def vector(size):
        return [draw.uniform(-size, size) for _ in range(3)]

    def light():
        kind = draw.choice(("point", "spot", "directional"))
        found = {"type": kind, "color": [draw.random() for _ in range(3)]}
        if kind != "directional":
            found |= {"position": vector(4), "attenuation": [1, draw.random(), draw.random()]}
        if kind != "point":
            found["direction"] = vector(1)
        if kind == "spot":
            found |= {"angle": draw.uniform(5, 80), "penumbra": draw.random(),
                      "exponent": draw.choice((0, draw.uniform(0, 20)))}
        return found

    def thing():
        return {"type": draw.choice(SHAPES),
                "transform": {"translate": vector(1.2), "rotate": vector(180),
                              "scale": [draw.uniform(0.2, 1.2) for _ in range(3)]},
                "material": {"diffuse": [draw.random() for _ in range(3)],
                             "specular": draw.random(), "shininess": 10 ** draw.uniform(-1, 4),
                             "side": draw.choice(("both", "front"))}}

    return {"image": {"width": 96, "height": 72, "samples": draw.choice((1, 4))},
            "camera": {"position": [0, 1, draw.uniform(1, 5)]},
            "lights": [light() for _ in range(draw.randint(1, 7))],
            "objects": [thing() for _ in range(draw.randint(1, 8))]}


def scenes():
    """Examples, at a third of their size, and made ones."""
    for path in sorted((SOURCE / "api" / "examples").glob("*.json")):
        scene = json.loads(path.read_text(encoding="utf-8"))
        scene.pop("outputs", None)
        image = scene.setdefault("image", {})
        for side in ("width", "height"):
            image[side] = image.get(side, 512) // 3
        image.pop("region", None)
        yield path.stem, scene
    for seed in range(24):
        yield f"made {seed}", made(seed)


class SameBits(unittest.TestCase):
    def test_pictures_are_the_same_bytes(self):
        output = {"format": "png", "bitDepth": 16, "colorSpace": "lin_rec709"}
        cases = [(name, {**scene, "accuracy": {"tier": TIERS[i % 2]}, "output": output})
                 for i, (name, scene) in enumerate(scenes())]

        def both(case):
            return [picture([*command, "render"], case[1])
                    for command in ([OWN / "shade"], [*EMULATOR, OTHERS / "shade"])]

        with ThreadPoolExecutor(os.cpu_count()) as workers:
            found = list(workers.map(both, cases))
        for (name, scene), (own, other) in zip(cases, found):
            with self.subTest(name, tier=scene["accuracy"]["tier"]):
                self.assertTrue(own == other)
        self.assertGreater(len({own for own, _ in found}), 40)

    def test_sums_of_lights_are_the_same_bits(self):
        own, other = (
            re.search("bits of all sums: ([0-9a-f]{16})", done.stdout.decode()).group(1)
            for done in (run(OWN / "tests" / "unit_shade_lists"),
                         run(*EMULATOR, OTHERS / "tests" / "unit_shade_lists")))
        self.assertEqual(own, other)


if __name__ == "__main__":
    unittest.main()
