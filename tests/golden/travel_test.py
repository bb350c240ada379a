"""The examples look the same, within one code, under other houses' configurations: numbers are
linear Rec.709, `#rrggbb` is sRGB, and YIQ and HSV are there.

configs/ has the ACES CG and studio configurations v1.0.0 for OpenColorIO 2.1, as OpenColorIO's
sources have them (src/OpenColorIO/builtinconfigs/configs; BSD-3-Clause, Copyright Contributors to
the OpenColorIO Project). elsewhere.ocio is a small one of our own."""

import io
import json
import os
import subprocess
import unittest
from pathlib import Path

import numpy as np
from PIL import Image

from reference import program

EXAMPLES = Path(program.SOURCE, "api", "examples")
ELSEWHERE = Path(__file__).with_name("elsewhere.ocio")
CONFIGURATIONS = [ELSEWHERE, *sorted(Path(__file__).with_name("configs").glob("*.ocio"))]
SPACES = ("srgb_tx", "YIQ", "HSV")


def pictures(document, color_spaces, *options):
    """A small picture in each space."""
    made = {}
    for space in color_spaces:
        output = {"format": "png", **space}
        run = subprocess.run([os.path.join(program.BUILD, "shade"), "render", "-", "-o", "-", *options],
                             input=json.dumps({**document, "output": output}).encode(),
                             capture_output=True, check=False, timeout=300)
        if run.returncode:
            raise AssertionError(run.stderr.decode())
        made[str(space)] = np.asarray(Image.open(io.BytesIO(run.stdout)), dtype=int)
    return list(made.values())


class Travel(unittest.TestCase):
    def same(self, document, spaces, elsewhere, hue=False):
        document = {name: value for name, value in document.items()
                    if name not in ("output", "outputs")}
        document["workingSpace"] = "lin_rec709"
        document["image"] = {**document.get("image", {}), "width": 96, "height": 64, "samples": 1}
        here = pictures(document, spaces)
        for configuration in CONFIGURATIONS:
            there = pictures(document, elsewhere, "--ocio", str(configuration))
            for space, one, other in zip(spaces, here, there):
                away = np.abs(one - other)
                if space.get("colorSpace") == "HSV":
                    # A hue turns by rounding where there is next to none, and wraps at red.
                    away[..., 0] = np.minimum(away[..., 0], 255 - away[..., 0])
                    away[..., 0] *= one[..., 1] * one[..., 2] > 16 * 255
                self.assertLessEqual(away.max(), 1, (configuration.name, space))

    def test_examples(self):
        spaces = [{"colorSpace": space} for space in SPACES]
        view = {"display": "sRGB", "view": "Standard"}
        plain = {"display": "sRGB - Display", "view": "Un-tone-mapped"}
        for path in sorted(EXAMPLES.glob("*.json")):
            with self.subTest(path.stem):
                self.same(json.loads(path.read_text()), [*spaces, view], [*spaces, plain])


def chunks(png):
    """{type: data} of a PNG."""
    found, at = {}, 8
    while at < len(png):
        size = int.from_bytes(png[at:at + 4], "big")
        found[png[at + 4:at + 8].decode()] = png[at + 8:at + 8 + size]
        at += 12 + size
    return found


class Tags(unittest.TestCase):
    """What files say of their color follows from what the configuration does, not from names."""

    def tags(self, *options, **output):
        scene = {"image": {"width": 8, "height": 8, "samples": 1}, "objects": [],
                 "output": {"format": "png", **output}}
        run = subprocess.run([os.path.join(program.BUILD, "shade"), "render", "-", "-o", "-", *options],
                             input=json.dumps(scene).encode(), capture_output=True, check=False,
                             timeout=300)
        self.assertEqual(run.returncode, 0, run.stderr)
        return chunks(run.stdout)

    def test_built_in(self):
        self.assertEqual(self.tags()["cICP"], bytes([1, 13, 0, 1]))
        self.assertEqual(self.tags(display="Display P3")["cICP"], bytes([12, 13, 0, 1]))
        self.assertNotIn("cICP", self.tags(display="Rec.1886"))
        self.assertIn("gAMA", self.tags(display="Rec.1886", view="ACES 1.0 - SDR Video"))
        for output in {"view": "Raw"}, {"colorSpace": "raw"}, {"colorSpace": "YIQ"}:
            self.assertFalse({"cICP", "gAMA", "cHRM", "sRGB", "iCCP"} & set(self.tags(**output)))

    def test_elsewhere(self):
        ocio = ("--ocio", str(ELSEWHERE))
        self.assertEqual(self.tags(*ocio, display="sRGB - Display")["cICP"], bytes([1, 13, 0, 1]))
        self.assertEqual(self.tags(*ocio, colorSpace="sRGB - Texture")["cICP"], bytes([1, 13, 0, 1]))
        self.assertEqual(self.tags(*ocio, display="Rec.2100-PQ - Display", bitDepth=16)["cICP"],
                         bytes([9, 16, 0, 1]))
        self.assertEqual(self.tags(*ocio, colorSpace="lin_srgb", bitDepth=16)["cICP"],
                         bytes([1, 8, 0, 1]))
        self.assertFalse({"cICP", "gAMA", "cHRM", "sRGB", "iCCP"} & set(self.tags(*ocio, view="Raw")))


if __name__ == "__main__":
    unittest.main()
