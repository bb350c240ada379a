"""Budgets count what JPEG and WebP lose: files as Pillow reads them, against the PNG of the same samples."""

import io
import json
import re
import unittest

import numpy as np
from PIL import Image

from e2e.daemon import Daemon
from reference import color

SCENE = {"image": {"width": 96, "height": 72, "samples": 4}, "background": "#203040",
         "objects": [{"type": "torus", "material": {"preset": "brass"}},
                     {"type": "sphere", "radius": 0.3, "material": {"diffuse": "#f20"}}]}
TOLD = re.compile(r"quality=(\d+); error<=(\S+) (\w+); p99<=([0-9.e-]+)$")


def pixels(data, mode="RGB"):
    return np.asarray(Image.open(io.BytesIO(data)).convert(mode)).astype(int)


class CodecTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon()
        cls.addClassCleanup(cls.daemon.stop)

    def picture(self, most, metric, side=96, **output):
        scene = {**SCENE, "image": {**SCENE["image"], "width": side},
                 "accuracy": {"maxError": most, "metric": metric}, "output": output}
        answer = self.daemon.render(scene)
        self.assertEqual(answer.status, 200, answer.body)
        return answer

    def problem(self, scene):
        answer = self.daemon.render({**SCENE, **scene})
        self.assertEqual(answer.status, 422, answer.body[:100])
        return json.loads(answer.body)["errors"][0]

    def test_pictures_whose_colors_go_through_floats(self):
        """Small ones, and those that are dithered, have no ready samples."""
        for output in {"side": 17}, {"side": 31, "dither": True}, {"dither": True}:
            with self.subTest(output=output):
                answer = self.picture(60, "code", format="jpeg", **output)
                image = {**SCENE["image"], "width": output.pop("side", 96)}
                png = self.daemon.render({**SCENE, "image": image, "output": output})
                errors = np.abs(pixels(png.body) - pixels(answer.body))
                # The plan may take another tier: a code.
                self.assertLessEqual(errors.max(), float(TOLD.match(answer.headers["Shaded-Codec"])[2]) + 1)

    def samples(self, answer, mode="RGB"):
        """What was encoded: a PNG in the tier that the answer tells."""
        tier = re.match("tier=(\\w+)", answer.headers["Shaded-Plan"])[1]
        png = self.daemon.render({**SCENE, "accuracy": {"tier": tier}})
        return pixels(png.body, mode)

    def test_told_is_what_another_reader_measures(self):
        for kind in "jpeg", "webp":
            for metric, most in ("code", 60), ("code", 45), ("linear", 0.1), ("deltaE2000", 20):
                with self.subTest(kind=kind, metric=metric, most=most):
                    answer = self.picture(most, metric, format=kind)
                    quality, error, unit, p99 = TOLD.match(answer.headers["Shaded-Codec"]).groups()
                    a, b = self.samples(answer), pixels(answer.body)
                    self.assertEqual(unit, metric)
                    if metric == "deltaE2000":
                        errors = color.delta_e_2000(*(color.lab(color.srgb_decode(x / 255)) for x in (a, b)))
                    elif metric == "linear":
                        errors = np.abs(color.srgb_decode(a / 255) - color.srgb_decode(b / 255))
                    else:
                        errors = np.abs(a - b)
                    # Told figures are rounded up to two digits, classes of p99 by 1 %.
                    self.assertLessEqual(errors.max(), float(error) * (1 + 1e-4))
                    self.assertLessEqual(float(error), max(errors.max() * 1.1, 1e-9))
                    self.assertLessEqual(np.quantile(errors, 0.99, method="higher"), float(p99) * 1.0001)
                    self.assertLessEqual(float(p99), np.quantile(errors, 0.991, method="higher") * 1.12)
                    plan = re.search(r"([0-9.e-]+) %s" % metric, answer.headers["Shaded-Plan"])[1]
                    self.assertLessEqual(float(error) + float(plan), most)

    def test_what_is_told_adds_up_to_no_more_than_the_budget(self):
        """Where the plan's bound leaves what the codec loses, but not when both are rounded up."""
        def find(most):
            answer = self.picture(most, "deltaE2000", format="jpeg")
            plan = re.search(r"([0-9.e-]+) deltaE2000", answer.headers["Shaded-Plan"])[1]
            return float(TOLD.match(answer.headers["Shaded-Codec"])[2]), float(plan)

        error, plan = find(6)
        scene = {**SCENE, "accuracy": {"maxError": 6}, "output": {"format": "jpeg"}}
        bound = json.loads(self.daemon.post("/v1/explain", scene).body)["bound"]["deltaE2000"]["most"]
        self.assertLess(bound, plan)
        most = error + (bound + plan) / 2
        self.assertLessEqual(sum(find(most)), most)

    def test_the_quality_is_the_least_of_its_neighbors(self):
        answer = self.picture(30, "code", format="jpeg")
        quality = int(TOLD.match(answer.headers["Shaded-Codec"])[1])
        self.assertLess(quality, 100)
        named = self.picture(30, "code", format="jpeg", quality=quality)
        self.assertEqual(named.body, answer.body)
        self.assertEqual(named.headers["Shaded-Codec"], answer.headers["Shaded-Codec"])
        self.assertNotEqual(named.headers["ETag"], answer.headers["ETag"])
        error = self.problem({"accuracy": {"maxError": 30, "metric": "code"},
                              "output": {"format": "jpeg", "quality": quality - 1}})
        self.assertEqual(error["pointer"], "/output/quality")

    def test_what_is_told_to_be_met_is_met(self):
        for output, metric in (({"format": "jpeg"}, "code"), ({"format": "webp", "quality": 99}, "code"),
                               ({"format": "jpeg"}, "deltaE2000"), ({"format": "jpeg", "quality": 40}, "linear")):
            with self.subTest(output=output, metric=metric):
                error = self.problem({"accuracy": {"maxError": 1e-2, "metric": metric}, "output": output})
                most = float(re.search("together ([0-9.e+-]+)", error["detail"])[1])
                self.picture(most, metric, **output)

    def test_webp_loses_nothing_where_each_loss_is_too_much(self):
        for most, metric in (2, "code"), (0.5, "deltaE2000"), (1e-2, "linear"):
            with self.subTest(metric=metric):
                answer = self.picture(most, metric, format="webp")
                quality, error, _, p99 = TOLD.match(answer.headers["Shaded-Codec"]).groups()
                self.assertEqual((int(quality), float(error), float(p99)), (100, 0, 0))
                np.testing.assert_array_equal(pixels(answer.body), self.samples(answer))
        # By the same tier: as one that asks for no loss.
        self.assertEqual(self.picture(1e-2, "linear", format="webp", quality=100, effort=4).body, answer.body)

    def test_the_lossless_needs_no_search(self):
        for output in {"format": "png"}, {"format": "webp", "quality": 100}:
            answer = self.picture(0.5, "deltaE2000", **output)
            self.assertIsNone(answer.headers["Shaded-Codec"])
            np.testing.assert_array_equal(pixels(answer.body), self.samples(answer))
        self.assertIsNone(self.daemon.render({**SCENE, "output": {"format": "jpeg"}}).headers["Shaded-Codec"])

    def test_each_of_several_outputs_is_told(self):
        scene = {**SCENE, "accuracy": {"maxError": 40, "metric": "code"},
                 "outputs": [{"name": "a"}, {"name": "b", "format": "jpeg"},
                             {"name": "c", "format": "webp", "channel": "G"},
                             {"name": "d", "format": "jpeg", "scope": "histogram"}]}
        told = self.daemon.render(scene).headers["Shaded-Codec"].split(", ")
        self.assertEqual([one.split(";")[0] for one in told], ["output=1", "output=2"])
        scene["outputs"][1]["quality"] = 1
        self.assertEqual(self.problem(scene)["pointer"], "/outputs/1/quality")

    def test_hidden_colors_do_not_count(self):
        answer = self.daemon.render({**SCENE, "background": None, "accuracy": {"maxError": 40, "metric": "code"},
                                     "output": {"format": "webp"}})
        error = float(TOLD.match(answer.headers["Shaded-Codec"])[2])
        b = pixels(answer.body, "RGBA")
        a = pixels(self.daemon.render({**SCENE, "background": None}).body, "RGBA")
        seen = (a[..., 3] > 0) | (b[..., 3] > 0)
        # The plan's tier may differ from the PNG's: a code.
        self.assertLessEqual(np.abs(a - b)[seen].max(), error + 1)

    def test_metrics_that_are_not_known(self):
        for metric in "linear", "deltaE2000":
            error = self.problem({"accuracy": {"maxError": 5, "metric": metric},
                                  "output": {"format": "jpeg", "colorSpace": "YIQ"}})
            self.assertEqual(error["pointer"], "/accuracy/metric")
            # What is lossless is within any budget, and nobody named a quality.
            answer = self.picture(0.1, metric, format="webp", colorSpace="YIQ")
            self.assertEqual(answer.headers["Shaded-Codec"], f"quality=100; error<=0 {metric}; p99<=0")
        self.picture(40, "code", format="jpeg", colorSpace="YIQ")

    def test_a_deadline_ends_the_search(self):
        scene = {**SCENE, "image": {"width": 4000, "height": 4000, "samples": 1},
                 "accuracy": {"maxError": 30}, "output": {"format": "webp", "effort": 6}}
        daemon = Daemon("--timeout", "1", "--max-pixels", "16000000")
        self.addCleanup(daemon.stop)
        answer = daemon.render(scene)
        self.assertEqual(json.loads(answer.body)["status"], answer.status)
        self.assertIn(answer.status, (503, 504))


if __name__ == "__main__":
    unittest.main()
