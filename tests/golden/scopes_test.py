"""Scopes beside what numpy makes of the displayed floats, pixel by pixel.

The same scene as an EXR picture in the same space gives the floats. A trace is where the ground's color is not:
graticules and labels are left aside, by comparing with the scope of a black picture of the same size, in which
nothing but they and the trace of black are drawn.
"""

import json
import unittest

import numpy as np

from e2e.daemon import Daemon
from reference import program

GROUND = [16, 18, 22]
BALL = {"image": {"width": 300, "height": 220, "samples": 1}, "background": [0.01, 0.02, 0.05],
        "lights": [{"type": "point", "position": [3, 3, 3]}, {"type": "point", "position": [-3, 0, 3], "color": [0.2, 0.1, 0.9]}],
        "objects": [{"type": "sphere", "material": {"diffuse": [0.9, 0.5, 0.1], "specular": 0.8, "shininess": 20}}]}
BARS = {"Yl": (1, 1, 0), "Cy": (0, 1, 1), "G": (0, 1, 0), "Mg": (1, 0, 1), "R": (1, 0, 0), "B": (0, 0, 1)}
NAMES = ["vectorscope", "chromaticity", "waveform", "parade", "histogram", "falsecolor", "gamut"]


def sized(document, width, height):
    return {**document, "image": {**document["image"], "width": width, "height": height}}


def bars(level=0.75):
    """Vertical bars of encoded sRGB, by emission alone."""
    boxes = [{"type": "box", "size": [0.5, 3, 0.1], "transform": {"translate": [0.5 * k - 1.25, 0, 0]},
              "material": {"ambient": 0, "diffuse": 0,
                           "emissive": f"rgb({' '.join(f'{100 * level * c}%' for c in bar)})"}}
             for k, bar in enumerate(BARS.values())]
    return {"image": {"width": 300, "height": 300, "samples": 1}, "lights": [], "objects": boxes,
            "camera": {"type": "orthographic", "position": [0, 0, 4], "height": 3}}


def picture(document, scope, **output):
    samples, _ = program.read(program.shade({**document, "output": {"scope": scope, "colorSpace": "sRGB", **output}}), "png")
    return samples


def displayed(document, space="sRGB"):
    samples, names = program.read(program.shade({**document, "output": {"format": "exr", "bitDepth": "float", "colorSpace": space}}),
                                  "exr")
    return np.stack([samples[..., names.index(name)] for name in "RGB"], -1)


def yiq(rgb):
    return rgb @ np.array([[0.30, 0.59, 0.11], [0.60, -0.28, -0.32], [0.21, -0.52, 0.31]]).T


def lit(document, scope, **output):
    """Where there is a trace, and where there is nothing but ground in the scope of black."""
    black = {**document, "lights": [], "background": [0, 0, 0], "objects": []}
    plain = (picture(black, scope, **output) == GROUND).all(axis=2)
    return (picture(document, scope, **output) != GROUND).any(axis=2), plain


def frame(width, height):
    """docs/model.md, Scopes: where plots are, with room for labels."""
    least = min(width, height)
    text = 0 if least < 160 else np.floor(max(least / 32, 10))
    edge, left, low = np.ceil(0.7 * text), np.ceil(2.6 * text), np.ceil(1.8 * text)
    return left, edge, width - left - edge, height - edge - low


class Scopes(unittest.TestCase):
    def assert_trace(self, document, scope, x, y, **output):
        wanted = np.zeros((document["image"]["height"], document["image"]["width"]), bool)
        inside = (x >= 0) & (y >= 0) & (x < wanted.shape[1]) & (y < wanted.shape[0])
        wanted[y[inside].astype(int), x[inside].astype(int)] = True
        trace, plain = lit(document, scope, **output)
        self.assertGreater(wanted[plain].sum(), 20)
        # A value on the edge of a cell may be rounded to the other side of it.
        apart = (trace != wanted) & plain
        self.assertLessEqual(apart.sum(), max(2, wanted.sum() // 200))

    def vector_place(self, rgb, width, height):
        values, turn = yiq(rgb), np.radians(33)
        gain = 0.84 * min(width, height) / 2 / 0.6357
        i, q = values[..., 1].ravel(), values[..., 2].ravel()
        return (width / 2 + gain * (q * np.cos(turn) - i * np.sin(turn)),
                height / 2 - gain * (q * np.sin(turn) + i * np.cos(turn)))

    def test_a_vectorscope_puts_each_bar_in_its_box(self):
        document = bars()
        picture_of = picture(document, "vectorscope").astype(int)
        trace, plain = lit(document, "vectorscope")
        gain = 0.84 * 150 / 0.6357
        for name, bar in BARS.items():
            x, y = self.vector_place(0.75 * np.array(bar, float), 300, 300)
            with self.subTest(name):
                green = picture_of[int(y[0]), int(x[0])]
                self.assertGreater(green[1] - green[0], 60, "the trace's color")
                # The box of 2.5 degrees and 2.5 IRE, in whole pixels: nothing is lit outside of the six boxes.
                trace[int(y[0]) - 1:int(y[0]) + 2, int(x[0]) - 1:int(x[0]) + 2] = False
                # The walls of both boxes, at half their height, are drawn, and nothing is between them.
                for share, wall in ((0.2, True), (0.11, False)):
                    ends = [self.vector_place((1 + side * share) * 0.75 * np.array(bar, float), 300, 300) for side in (-1, 1)]
                    for across, down in ends:
                        near = plain[int(down[0]) - 1:int(down[0]) + 2, int(across[0]) - 1:int(across[0]) + 2]
                        self.assertEqual(not near.all(), wall, share)
        self.assertEqual((trace & plain).sum(), 0)
        # Bars at 100 % are on the circle where red and cyan are, and not in the boxes.
        x, _ = self.vector_place(np.array([1.0, 0, 0]), 300, 300)
        self.assertTrue(lit(bars(1), "vectorscope")[0][:, int(x[0])].any())

    def test_traces_are_where_values_are(self):
        for width, height in ((300, 220), (90, 110), (640, 360)):
            document = sized(BALL, width, height)
            rgb = displayed(document)
            column = np.broadcast_to(np.arange(width) + 0.5, (height, width)) / width
            left, top, wide, high = frame(width, height)

            def row(level):
                return np.minimum(top + high * (1.1 - np.clip(level, -0.1, 1.1)) / 1.2, top + high - 1).ravel()

            with self.subTest(width=width, height=height):
                self.assert_trace(document, "vectorscope", *self.vector_place(rgb, width, height))
                self.assert_trace(document, "waveform", (left + column * wide).ravel(), row(yiq(rgb)[..., 0]))
                part = wide / 3
                gap = part / 40 if part > 40 else 0
                x = np.concatenate([(left + c * part + gap + column * (part - 2 * gap)).ravel() for c in range(3)])
                self.assert_trace(document, "parade", x, np.concatenate([row(rgb[..., c]) for c in range(3)]))

    def test_yiq_outputs_have_traces_of_their_own_channels(self):
        document = sized(BALL, 300, 220)
        rgb = displayed(document)
        self.assert_trace(document, "vectorscope", *self.vector_place(rgb, 300, 220), colorSpace="YIQ")

    def test_chromaticities_are_those_of_the_light(self):
        document = {**sized(BALL, 300, 220), "ambient": 0.05}
        held = np.clip(displayed(document), 0, 1)
        linear = np.where(held <= 0.04045, held / 12.92, ((held + 0.055) / 1.055) ** 2.4)
        xyz = linear @ np.array([[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750],
                                 [0.0193339, 0.1191920, 0.9503041]]).T
        total = xyz @ [1, 15, 3]
        self.assertGreater(xyz[..., 1].min(), 0)
        gain = min(300 / 0.69, 220 / 0.66)
        x = 150 + gain * (4 * xyz[..., 0] / total - 0.315)
        y = 110 - gain * (9 * xyz[..., 1] / total - 0.3)
        trace, plain = lit(document, "chromaticity")
        near = np.zeros_like(trace)
        for dx in (-1, 0, 1):  # matrices in seven digits, and a float of Lab
            for dy in (-1, 0, 1):
                near[(y + dy).astype(int), (x + dx).astype(int)] = True
        self.assertEqual((trace & plain & ~near).sum(), 0)
        exact = np.zeros_like(trace)
        exact[y.astype(int), x.astype(int)] = True
        self.assertGreater((exact & trace)[plain].sum(), 0.97 * exact[plain].sum())

    def test_a_histogram_has_roots_of_counts(self):
        width, height = 640, 360
        document = sized(BALL, width, height)
        rgb = displayed(document)
        bins = np.clip(np.floor(rgb * 256), 0, 255).astype(int)
        counts = np.array([np.bincount(bins[..., c].ravel(), minlength=256) for c in range(3)])
        most = counts[:, 1:-1].max()
        heights = np.sqrt(np.minimum(counts / most, 1))
        left, top, wide, high = frame(width, height)
        shown = picture(document, "histogram")
        bottom = int(top + high)
        for x in range(int(left) + 2, int(left + wide) - 2):
            if abs((x - left) / wide * 4 - round((x - left) / wide * 4)) < 0.02:
                continue  # a line of the graticule
            bar = heights[:, int((x - left) / wide * 256)].max()
            rows = np.flatnonzero((shown[int(top):bottom, x] != GROUND).any(axis=1))
            self.assertEqual(len(rows), int(np.ceil(bar * high)), x)

    def test_false_colors_are_bands_of_a_stop(self):
        document = {**sized(BALL, 300, 220), "ambient": 0.001}
        y = displayed(document, "lin_rec709") @ [0.2126, 0.7152, 0.0722]
        for exposure in (0, -2.5, 3):
            shown = picture(document, "falsecolor", exposure=exposure)[:-16]  # above the legend
            band = np.clip(np.floor(np.log2(y / 0.18) + exposure + 0.5), -7, 7)[:-16]
            colors = {}
            for value in np.unique(band):
                found = np.unique(shown[band == value], axis=0, return_counts=True)
                color = found[0][found[1].argmax()]
                # Floats are rounded at the edges of bands.
                self.assertGreater(found[1].max(), 0.995 * found[1].sum())
                self.assertNotIn(tuple(color), colors)
                colors[tuple(color)] = value
                if value == 0:
                    self.assertEqual(tuple(color), (128, 128, 128))

    def test_a_gamut_is_marked_where_it_is_left(self):
        material = {"diffuse": [0, 0.8, 0.05], "specular": 0.8, "shininess": 20}
        document = {**sized(BALL, 300, 220), "workingSpace": "ACEScg", "colorSpace": "ACEScg",
                    "objects": [{"type": "sphere", "material": material}]}
        rgb = displayed(document)
        shown = picture(document, "gamut")
        high, low = (rgb > 1).any(axis=2), (rgb < 0).any(axis=2)
        self.assertGreater(high.sum(), 30)
        self.assertGreater(low.sum(), 30)
        marks = {(238, 48, 44): high & ~low, (40, 104, 255): low & ~high, (255, 160, 0): high & low}
        for color, wanted in marks.items():
            self.assertEqual(((shown == color).all(axis=2) != wanted)[:-16].sum(), 0, color)  # above the legend
        grey = shown[:-16][(~high & ~low)[:-16]]
        self.assertTrue((grey[:, 0] == grey[:, 1]).all() and (grey[:, 0] == grey[:, 2]).all())

    def test_every_size_and_format_has_every_scope(self):
        for name in NAMES:
            for width, height in ((1, 1), (16, 16), (17, 400), (400, 9)):
                with self.subTest(name=name, width=width, height=height):
                    shown = picture(sized(BALL, width, height), name)
                    self.assertEqual(shown.shape, (height, width, 3))
            clear = {**sized(BALL, 200, 200), "background": None, "objects": []}
            self.assertEqual(picture(clear, name).shape, (200, 200, 3), "nothing is seen")
            for kind, space in (("jpeg", "sRGB"), ("webp", "Display P3"), ("tiff", "ACEScg")):
                output = {"scope": name, "format": kind, "colorSpace": space}
                self.assertGreater(len(program.shade({**sized(BALL, 64, 64), "output": output})), 100)
        many = {**sized(BALL, 64, 48), "outputs": [{"name": "picture"}, *({"name": name, "scope": name} for name in NAMES)]}
        with Daemon() as daemon:
            answer = daemon.render(many)
            self.assertEqual(answer.status, 200)
            alone = daemon.render({**sized(BALL, 64, 48), "output": {}})
            self.assertIn(alone.body, answer.body, "beside scopes the picture is the same")
            described = daemon.post("/v1/explain", {**sized(BALL, 64, 48), "output": {"scope": "parade"}})
            self.assertEqual(json.loads(described.body)["outputs"][0]["scope"], "parade")


if __name__ == "__main__":
    unittest.main()
