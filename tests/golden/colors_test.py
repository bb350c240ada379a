"""Integer pictures of shaded scenes against an independent conversion of the independent
evaluation: sRGB, YIQ and HSV within one code value, greys exact.

Silhouette pixels (reference/phong.py) are left out. Hue is compared round the circle, where the
saturation is enough for 8 bits to show a hue: below a chroma of 1/255 it is rounding.
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
        top = 2 ** output.get("bitDepth", 8) - 1
        for name, document in self.scenes:
            expected = self.expected[name]
            with self.subTest(scene=name, **output):
                encoded = color.srgb_encode(np.clip(expected.rgb, 0, 1))
                wanted, judged = convert(encoded)
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
        self.compare(lambda rgb: (color.codes(rgb), 1))

    def test_yiq(self):
        self.compare(lambda rgb: (color.yiq_codes(color.yiq(rgb)), 1), colorSpace="YIQ")

    def test_hsv(self):
        def convert(rgb):
            chroma = rgb.max(-1) - rgb.min(-1)
            hue = chroma > 1 / 255
            return color.codes(color.hsv(rgb)), np.stack([hue, hue | True, hue | True], -1)

        self.compare(convert, colorSpace="HSV")

    def test_one_channel_is_a_grey_picture(self):
        for channel, index in (("Y", 0), ("I", 1), ("Q", 2)):
            self.compare(lambda rgb, i=index: (color.yiq_codes(color.yiq(rgb))[..., i:i + 1], 1),
                         colorSpace="YIQ", channel=channel)
        self.compare(lambda rgb: (color.codes(color.hsv(rgb))[..., 2:3], 1),
                     colorSpace="HSV", channel="V")

    def test_grey_scene_has_no_color(self):
        document = reference_scenes.scene(
            {"type": "sphere", "material": GREY}, {"type": "torus", "radius": 1.5, "material": GREY},
            ambient=0.05, background=0.1)
        plain = program.codes(document)[..., :3]
        self.assertTrue((plain == plain[..., :1]).all())
        yiq = program.codes(document, colorSpace="YIQ")
        np.testing.assert_array_equal(yiq[..., 0], plain[..., 0])
        self.assertEqual({*yiq[..., 1:3].ravel()}, {128})
        hsv = program.codes(document, colorSpace="HSV")
        self.assertEqual({*hsv[..., :2].ravel()}, {0})
        np.testing.assert_array_equal(hsv[..., 2], plain[..., 0])


if __name__ == "__main__":
    unittest.main()
