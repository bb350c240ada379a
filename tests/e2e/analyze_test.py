"""POST /v1/analyze and `shade analyze` from outside: figures against numpy's, of the same picture as floats.

The floats come from an EXR of the same output, whose samples are what is displayed before it becomes codes. CLOSE
is what the last digits of f32 leave; a count may differ by the pixels that lie on the edge of a bin.
"""

import colorsys
import json
import math
import subprocess
import tempfile
import unittest
from pathlib import Path

import numpy as np

from e2e.daemon import BUILD, Daemon
from reference import program

SHADE = str(BUILD / "shade")
CLOSE = 2e-6
SCENE = {"image": {"width": 64, "height": 48, "samples": 1}, "background": [0.1, 0.2, 0.05],
         "objects": [{"type": "sphere", "material": {"preset": "gold"}},
                     {"type": "torus", "material": {"diffuse": [0.1, 0.2, 0.9], "specular": 1.5},
                      "transform": {"translate": [0.5, 0.5, 0.7], "rotate": [60, 0, 0], "scale": 0.6}}]}
VIEW = {"display": "sRGB", "view": "Standard"}


def nearest_rank(values, percent):
    """The smallest value that at least so many percent do not exceed."""
    return np.sort(values)[max(math.ceil(percent / 100 * len(values)), 1) - 1]


class Http(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon()

    @classmethod
    def tearDownClass(cls):
        cls.daemon.stop()

    def told(self, scene):
        answer = self.daemon.post("/v1/analyze", scene)
        self.assertEqual(answer.status, 200, answer.body)
        return json.loads(answer.body)

    def displayed(self, scene, **output):
        answer = self.daemon.render({**scene, "output": {**output, "format": "exr", "bitDepth": "float"}})
        self.assertEqual(answer.status, 200, answer.body)
        samples, _ = program.read(answer.body, "exr")
        return samples[..., :3].reshape(-1, 3)

    def check(self, channel, values):
        self.assertEqual(channel["count"], len(values))
        for name, expected in (("min", values.min()), ("max", values.max()), ("mean", values.mean())):
            self.assertAlmostEqual(channel[name], expected, delta=CLOSE * max(1, abs(values).max()), msg=name)
        for percent, value in channel["percentiles"].items():
            self.assertAlmostEqual(value, nearest_rank(values, float(percent)),
                                   delta=CLOSE * max(1, abs(values).max()), msg=percent)
        histogram = channel["histogram"]
        low, high = histogram["edges"]
        counts, _ = np.histogram(values, bins=len(histogram["counts"]), range=(low, high))
        self.assertEqual(sum(histogram["counts"]), len(values))
        self.assertLessEqual(np.abs(counts - histogram["counts"]).sum(), 0.02 * len(values))

    def test_figures_are_those_of_the_picture(self):
        out = self.told({**SCENE, "output": VIEW})["outputs"][0]
        rgb = self.displayed(SCENE, **VIEW)
        self.assertEqual((out["pixels"], out["transparent"], out["nonFinite"]), (64 * 48, 0, 0))
        for channel, values in zip(out["rgb"], rgb.T):
            self.check(channel, values)
        self.assertEqual(out["outOfGamut"], ((rgb < 0) | (rgb > 1)).any(axis=1).sum())
        yiq = rgb @ np.array([[.30, .59, .11], [.60, -.28, -.32], [.21, -.52, .31]]).T
        for channel, values in zip(out["yiq"], yiq.T):
            self.check(channel, values)

    def test_hues_are_of_what_has_one(self):
        out = self.told({**SCENE, "background": 0.3, "output": VIEW})["outputs"][0]
        rgb = np.maximum(self.displayed({**SCENE, "background": 0.3}, **VIEW), 0)
        hsv = np.array([colorsys.rgb_to_hsv(*pixel) for pixel in rgb])
        colored = hsv[:, 1] > 1e-4
        self.assertGreater((~colored).sum(), 1000)
        self.check(out["hsv"][0], hsv[colored, 0])
        for channel, values in zip(out["hsv"][1:], hsv.T[1:]):
            self.check(channel, values)

    def test_grey_has_no_color_in_lab(self):
        out = self.told({"image": {"width": 8, "height": 8}, "objects": [], "background": 0.18,
                         "output": VIEW})["outputs"][0]
        lightness, a, b = out["lab"]
        self.assertAlmostEqual(lightness["mean"], 116 * 0.18 ** (1 / 3) - 16, delta=0.02)
        self.assertAlmostEqual(a["mean"], 0, delta=0.02)
        self.assertAlmostEqual(b["mean"], 0, delta=0.02)

    def test_what_is_bright_is_counted(self):
        scene = {"image": {"width": 8, "height": 8, "samples": 1}, "objects": [], "background": [2, 0.5, 0.5],
                 "output": VIEW}
        out = self.told(scene)["outputs"][0]
        self.assertEqual((out["outOfGamut"], out["clipped"]), (64, 64))

    def test_each_output_is_analyzed(self):
        told = self.told({**SCENE, "outputs": [{"name": "a"}, {"name": "b", "colorSpace": "YIQ"}]})
        self.assertEqual([out["name"] for out in told["outputs"]], ["a", "b"])

    def test_mistakes_have_their_pointers(self):
        answer = self.daemon.post("/v1/analyze", {"objects": [{"type": "sphere", "radius": 0}]})
        self.assertEqual(answer.status, 422)
        self.assertEqual(json.loads(answer.body)["errors"][0]["pointer"], "/objects/0/radius")
        self.assertEqual(self.daemon.post("/v1/analyze", SCENE, {"Accept": "image/png"}).status, 406)


class Command(unittest.TestCase):
    def test_the_command_tells_the_same(self):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "figures.json")
            done = subprocess.run([SHADE, "analyze", "-", "-o", str(path)], input=json.dumps(SCENE), text=True,
                                  capture_output=True, check=False)
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            self.assertEqual(json.loads(path.read_text())["outputs"][0]["pixels"], 64 * 48)


if __name__ == "__main__":
    unittest.main()
