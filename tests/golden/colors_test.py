"""Integer pictures of shaded scenes, 8 and 16 bits, against an independent conversion of the
independent evaluation: sRGB, YIQ and HSV within one code value, greys exact.

Silhouette pixels (reference/phong.py) are left out. Hue is compared round the circle, where the
saturation is enough for 8 bits to show a hue: below a chroma of 1/255 it is rounding. A chart of
colors that are not shaded goes where scenes do not: near black, beyond 1, and below 0.
"""

import unittest

import numpy as np

import reference_scenes
from reference import color, phong, program

GREY = {"diffuse": 0.6, "specular": 0.3, "shininess": 25}


def scenes():
    hand = dict(reference_scenes.by_hand())
    for name in ("shape_torus", "colors", "camera_frame", "lobes", "attenuation"):
        yield name, hand[name]
    for seed in (7, 11, 13):
        yield f"seed_{seed}", reference_scenes.by_seed(seed)


def kept_in_range(document):
    """With a background (alpha is another test's) and few enough lights to stay below 1."""
    document = {**document, "background": document.get("background") or "#203040"}
    if "lights" in document:
        document["lights"] = [{**light, "intensity": 0.5 * light.get("intensity", 1)}
                              for light in document["lights"]]
    return document


class Colors(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scenes = [(name, kept_in_range(document)) for name, document in scenes()]
        cls.expected = {name: phong.render(document) for name, document in cls.scenes}

    def compare(self, convert, **output):
        """`convert` takes encoded values and bits to codes, and to which of them are judged."""
        for bits in 8, 16:
            self.compare_bits(convert, bits, bitDepth=bits, **output)

    def compare_bits(self, convert, bits, **output):
        top = 2 ** bits - 1
        for name, document in self.scenes:
            expected = self.expected[name]
            with self.subTest(scene=name, **output):
                encoded = color.srgb_encode(np.clip(expected.rgb, 0, 1))
                wanted, judged = convert(encoded, bits)
                measured = program.codes(document, **output)[..., :wanted.shape[-1]]
                away = np.abs(measured - wanted)
                if output.get("colorSpace") == "HSV":
                    away[..., 0] = np.minimum(away[..., 0], top - away[..., 0])
                # values above 1 are cut at different places by conversions and codes
                inside = ~expected.silhouette & (expected.rgb.max(-1) <= 1)
                self.assertGreater(inside.mean(), 0.5)
                away = away * judged * inside[..., None]
                self.assertLessEqual(away.max(), 1, np.argwhere(away > 1)[:3].tolist())

    def test_srgb(self):
        self.compare(lambda rgb, bits: (color.codes(rgb, bits), 1))

    def test_yiq(self):
        self.compare(lambda rgb, bits: (color.yiq_codes(color.yiq(rgb), bits), 1), colorSpace="YIQ")

    def test_hsv(self):
        def convert(rgb, bits):
            chroma = rgb.max(-1) - rgb.min(-1)
            hue = chroma > 1 / 255
            return color.codes(color.hsv(rgb), bits), np.stack([hue, hue | True, hue | True], -1)

        self.compare(convert, colorSpace="HSV")

    def test_one_channel_is_a_grey_picture(self):
        for channel, index in (("Y", 0), ("I", 1), ("Q", 2)):
            self.compare(lambda rgb, bits, i=index:
                         (color.yiq_codes(color.yiq(rgb), bits)[..., i:i + 1], 1),
                         colorSpace="YIQ", channel=channel)
        for channel, index in (("S", 1), ("V", 2)):
            self.compare(lambda rgb, bits, i=index:
                         (color.codes(color.hsv(rgb), bits)[..., i:i + 1], 1),
                         colorSpace="HSV", channel=channel)

    def test_grey_scene_has_no_color(self):
        document = reference_scenes.scene(
            {"type": "sphere", "material": GREY}, {"type": "torus", "radius": 1.5, "material": GREY},
            ambient=0.05, background=0.1)
        for bits in 8, 16:
            plain = program.codes(document, bitDepth=bits)[..., :3]
            self.assertTrue((plain == plain[..., :1]).all())
            yiq = program.codes(document, bitDepth=bits, colorSpace="YIQ")
            self.assertLessEqual(np.abs(yiq[..., 0] - plain[..., 0]).max(), bits // 16)
            self.assertEqual({*yiq[..., 1:3].ravel()}, {128 if bits == 8 else 32896})
            hsv = program.codes(document, bitDepth=bits, colorSpace="HSV")
            self.assertEqual({*hsv[..., :2].ravel()}, {0})
            np.testing.assert_array_equal(hsv[..., 2], plain[..., 0])


CHART = 72  # colors a side


def chart_colors():
    """Linear Rec.709 [CHART^2,3], each a float: where the two pieces of the sRGB curve meet and
    below, dark to bright, saturated or nearly grey, with negative components, greys."""
    random = np.random.default_rng(61966)
    count = CHART * CHART // 6

    def between(low, high):
        return 10 ** random.uniform(np.log10(low), np.log10(high), (count, 3))

    peak = between(1e-5, 8)[:, :1]
    sets = [between(1e-4, 0.0034), between(1e-7, 1), peak * random.uniform(0, 1, (count, 3)) ** 3,
            peak * random.uniform(0.9, 1, (count, 3)), random.uniform(-0.05, 0.2, (count, 3)),
            np.repeat(between(1e-6, 4)[:, :1], 3, 1)]
    return np.concatenate(sets).astype(np.float32).astype(np.float64)


def chart(colors):
    """A scene with one color a pixel: squares that face the camera and emit."""
    at = [(i - (CHART - 1) / 2, j - (CHART - 1) / 2)
          for j in reversed(range(CHART)) for i in range(CHART)]
    return {"image": {"width": CHART, "height": CHART, "samples": 1},
            "camera": {"type": "orthographic", "position": [0, 0, 9], "height": CHART},
            "lights": [],
            "objects": [{"type": "box", "material": {"emissive": list(rgb), "diffuse": 0},
                         "transform": {"translate": [x, y, 0]}} for rgb, (x, y) in zip(colors, at)]}


class Chart(unittest.TestCase):
    """Within one code; a float's rounding is a hundredth of a 16-bit code, but where a hue
    magnifies it."""

    @classmethod
    def setUpClass(cls):
        cls.linear = chart_colors()
        cls.encoded = color.srgb_encode(cls.linear)
        cls.document = chart(cls.linear)
        cls.grey = (cls.linear == cls.linear[:, :1]).all(-1)

    def codes(self, bits, **output):
        picture = program.codes(self.document, bitDepth=bits, **output)
        return picture.reshape(CHART * CHART, -1)[:, :3]

    def within_one(self, measured, wanted, judged=True):
        away = np.where(judged, np.abs(measured - wanted), 0)
        worst = np.unravel_index(away.argmax(), away.shape)
        self.assertLessEqual(away.max(), 1, f"{self.linear[worst[0]]}: {measured[worst[0]]}, "
                                            f"not {wanted[worst[0]]}")

    def test_the_chart_is_what_it_says(self):
        seen = program.rgb(program.linear(self.document)).reshape(-1, 3)
        np.testing.assert_array_equal(seen, self.linear)
        self.assertGreater(self.grey.sum(), 800)
        self.assertGreater((self.linear.max(-1) < 0.0031308).sum(), 1500)
        self.assertGreater((self.linear.max(-1) > 1).sum(), 100)
        self.assertGreater((self.linear < 0).sum(), 400)

    def test_srgb(self):
        for bits in 8, 16:
            self.within_one(self.codes(bits), color.codes(self.encoded, bits))

    def test_yiq(self):
        for bits in 8, 16:
            got = self.codes(bits, colorSpace="YIQ")
            self.within_one(got, color.yiq_codes(color.yiq(self.encoded), bits))
            self.assertEqual({*got[self.grey, 1:].ravel()}, {128 if bits == 8 else 32896})

    def test_hsv(self):
        for bits in 8, 16:
            top = 2 ** bits - 1
            hsv = color.hsv(self.encoded)
            wanted, got = color.codes(hsv, bits), self.codes(bits, colorSpace="HSV")
            turned = np.abs(got[:, 0] - wanted[:, 0]) > top / 2
            got[turned, 0] += np.where(got[turned, 0] < wanted[turned, 0], top, -top)
            self.within_one(got, wanted, np.stack([hsv[:, 1] > 1 / 255, self.grey | True,
                                                   self.grey | True], -1))
            self.assertEqual({*got[self.grey, :2].ravel()}, {0})


if __name__ == "__main__":
    unittest.main()
