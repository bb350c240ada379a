"""`shade compare` tells what two renders, exact and standard, tell an independent computation."""

import json
import os
import subprocess
import unittest

import numpy as np

from reference import color, program

# The tiers differ by 1e-7 of a light: a strong one that is taken away again by a negative
# emission leaves errors of whole codes.
AMPLIFIED = {
    "image": {"width": 90, "height": 70, "samples": 1}, "background": [0.2, 0.3, 0.1],
    "lights": [{"type": "point", "position": [3, 2, 1000], "intensity": 3e5}],
    "objects": [{"type": "disc", "radius": 1.2, "transform": {"rotate": [90, 0, 0]},
                 "material": {"diffuse": [1, 0.8, 0.6], "ambient": 0,
                              "emissive": [-299997.5, -239998, -179998.4]}}]}
# Every kind of light and highlight.
MIXED = {
    "image": {"width": 80, "height": 60, "samples": 4}, "ambient": 0.05,
    "lights": [{"type": "point", "position": [3, 3, 3], "attenuation": [0, 0, 0.05]},
               {"type": "spot", "position": [-2, 3, 2], "direction": [2, -3, -2], "angle": 20,
                "penumbra": 0.5, "color": "#ffcc88"},
               {"type": "directional", "direction": [0, -1, -1], "color": [0.1, 0.2, 0.4]}],
    "objects": [{"type": "torus", "transform": {"rotate": [60, 0, 20]},
                 "material": {"diffuse": [0.4, 0.1, 0.05], "specular": 0.6, "shininess": 1000}},
                {"type": "plane", "transform": {"translate": [0, -1, 0]}}]}
OUTPUTS = [{}, {"display": "Display P3", "view": "ACES 1.0 - SDR Video"}, {"colorSpace": "YIQ"},
           {"colorSpace": "lin_rec709"}, {"channel": "G"}, {"bitDepth": 16}]


def compare(document):
    run = subprocess.run([os.path.join(program.BUILD, "shade"), "compare", "-"],
                         input=json.dumps(document).encode(), capture_output=True, check=False,
                         timeout=500)
    if run.returncode:
        raise AssertionError(run.stderr.decode())
    return json.loads(run.stdout)


def spread(values):
    ordered = np.sort(values, axis=None)
    place = -(-99 * ordered.size // 100)  # the nearest rank
    return {"max": ordered[-1], "mean": ordered.mean(), "p99": ordered[place - 1]}


def shown(document, tier, output):
    """The displayed picture before it is rounded."""
    output = {k: v for k, v in output.items() if k in ("display", "view", "colorSpace")}
    output = output or {"display": "sRGB", "view": "Standard"}
    document = {**document, "accuracy": {"tier": tier},
                "output": {"format": "exr", "bitDepth": "float", **output}}
    samples, names = program.read(program.shade(document), "exr")
    return np.stack([samples[..., names.index(c)] for c in "RGB"], -1)


class Compare(unittest.TestCase):
    def assert_spread(self, told, wanted, absolute=0.0):
        for name, value in wanted.items():
            self.assertLessEqual(abs(told[name] - value), absolute + 1e-6 * abs(value),
                                 (name, told, wanted))

    def test_linear_errors_are_those_of_two_renders(self):
        for document in (AMPLIFIED, MIXED):
            exact, other = (program.rgb(program.linear(document, tier))
                            for tier in ("exact", "standard"))
            told = compare(document)
            linear = told["tiers"][-2]["error"]["linear"]
            self.assertEqual(told["measuredIn"]["linear"], "lin_rec709")
            self.assertGreater(linear["max"], 0)
            wanted = spread(np.abs(exact - other))
            self.assert_spread(linear, wanted)
            largest = np.abs(exact).max()
            self.assertAlmostEqual(told["largest"] / largest, 1, 6)
            self.assert_spread(linear["relative"], {k: v / largest for k, v in wanted.items()})

    def test_codes_are_those_of_two_pictures(self):
        different = 0
        for document in (AMPLIFIED, MIXED, {**AMPLIFIED, "background": None}):
            for output in OUTPUTS:
                with self.subTest(**output):
                    pictures = [program.codes({**document, "accuracy": {"tier": tier}},
                                              **{**output, "bitDepth": 8})
                                for tier in ("exact", "standard")]
                    error = compare({**document, "output": output})["tiers"][-2]["error"]
                    apart = np.abs(pictures[0] - pictures[1])
                    self.assert_spread(error["code"], spread(apart))
                    self.assertAlmostEqual(error["code"]["equal"], (apart == 0).mean(), 8)
                    if apart.any():
                        psnr = 10 * np.log10(255 ** 2 / (apart.astype(float) ** 2).mean())
                        self.assertAlmostEqual(error["psnr"], psnr, 6)
                        different += 1
                    else:
                        self.assertIsNone(error["psnr"])
        self.assertGreater(different, 6)  # codes that never differ would prove nothing

    def test_delta_e_is_that_of_the_displayed_pictures(self):
        for document in (AMPLIFIED, MIXED):
            for output in OUTPUTS[:1] + OUTPUTS[2:5]:
                with self.subTest(**output):
                    told = compare({**document, "output": output})
                    linear = "colorSpace" in output
                    self.assertEqual(told["measuredIn"]["deltaE2000"],
                                     "lin_rec709" if linear else "sRGB / Standard")
                    labs = []
                    for tier in ("exact", "standard"):
                        picture = np.clip(shown(document, tier, {"colorSpace": "lin_rec709"}
                                                if linear else {}), 0, 1)
                        labs.append(color.lab(picture if linear else
                                              color.srgb_decode(picture)))
                    wanted = spread(color.delta_e_2000(*labs))
                    # Four digits of the matrix.
                    error = told["tiers"][-2]["error"]["deltaE2000"]
                    for name, value in wanted.items():
                        self.assertLess(abs(error[name] - value), 1e-7 + 2e-3 * value, name)
        self.assertGreater(wanted["max"], 0)

    def test_each_tier_is_told(self):
        told = compare({**MIXED, "accuracy": {"maxError": 1, "metric": "code"}})
        self.assertEqual([tier["tier"] for tier in told["tiers"]], ["draft", "standard", "exact"])
        for tier in told["tiers"]:
            self.assertIn(f"tier={tier['tier']}", tier["plan"])
            self.assertTrue(all(seconds >= 0 for seconds in tier["seconds"].values()))
        draft, standard, exact = told["tiers"]
        self.assertLess(draft["error"]["linear"]["max"], draft["bound"]["linear"])
        self.assertGreater(standard["error"]["linear"]["max"], 0)
        nothing = {"max": 0, "mean": 0, "p99": 0}
        self.assertEqual(exact["error"], {"linear": {**nothing, "relative": nothing},
                                          "code": {**nothing, "equal": 1},
                                          "deltaE2000": nothing, "psnr": None})

    def test_bounds_hold_and_are_tighter_once_the_picture_is_there(self):
        _, standard, exact = compare(MIXED)["tiers"]
        plan, seen = standard["bound"], standard["boundSeen"]
        self.assertLessEqual(standard["error"]["deltaE2000"]["max"], seen["deltaE2000"])
        self.assertLess(seen["deltaE2000"], 0.7 * plan["deltaE2000"])
        self.assertEqual({**seen, "deltaE2000": 0}, {**plan, "deltaE2000": 0})
        self.assertEqual(exact["boundSeen"], exact["bound"])

    def test_a_black_picture_has_no_relative_error(self):
        told = compare({"objects": [], "image": {"width": 4, "height": 4}})
        self.assertEqual(told["largest"], 0)
        self.assertIsNone(told["tiers"][-2]["error"]["linear"]["relative"])


if __name__ == "__main__":
    unittest.main()
