"""Colors of CSS against arithmetic of our own: matrices from primaries and whites, and other programs' names.

build/tests/css_colors answers what src/scene/css.c makes of a text."""

import colorsys
import math
import os
import random
import subprocess
import unittest

import numpy as np
from PIL import ImageColor

BUILD = os.environ.get("SHADED_BUILD", "build")
D65, D50 = (0.3127, 0.3290), (0.3457, 0.3585)
BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])


def white(xy):
    return np.array([xy[0] / xy[1], 1, (1 - xy[0] - xy[1]) / xy[1]])


def to_xyz(primaries, white_xy):
    """The matrix of an RGB space: columns are primaries, scaled so that they add up to the white."""
    columns = np.array([[x, y, 1 - x - y] for x, y in primaries]).T
    return columns * np.linalg.solve(columns, white(white_xy))


def adapt(source, target):
    scale = (BRADFORD @ white(target)) / (BRADFORD @ white(source))
    return np.linalg.inv(BRADFORD) @ np.diag(scale) @ BRADFORD


SRGB = to_xyz([(0.64, 0.33), (0.30, 0.60), (0.15, 0.06)], D65)
P3 = to_xyz([(0.680, 0.320), (0.265, 0.690), (0.150, 0.060)], D65)
A98 = to_xyz([(0.64, 0.33), (0.21, 0.71), (0.15, 0.06)], D65)
REC2020 = to_xyz([(0.708, 0.292), (0.170, 0.797), (0.131, 0.046)], D65)
PROPHOTO = to_xyz([(0.734699, 0.265301), (0.159597, 0.840403), (0.036598, 0.000105)], D50)
TO_D65 = adapt(D50, D65)
# Ottosson, "A perceptual color space for image processing" (2020): to the cubes of LMS, of linear sRGB.
OKLAB = np.array([[1, 0.3963377774, 0.2158037573], [1, -0.1055613458, -0.0638541728], [1, -0.0894841775, -1.2914855480]])
OKLMS = np.array([[4.0767416621, -3.3077115913, 0.2309699292], [-1.2684380046, 2.6097574011, -0.3413193965],
                  [-0.0041960863, -0.7034186147, 1.7076147010]])


def odd(curve):
    return np.vectorize(lambda v: math.copysign(curve(abs(v)), v))


decode_srgb = odd(lambda v: v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4)
decode_a98 = odd(lambda v: v ** (563 / 256))
decode_prophoto = odd(lambda v: v / 16 if v <= 16 / 512 else v ** 1.8)
decode_2020 = odd(lambda v: v ** 2.4)


def of_xyz(xyz):
    return np.linalg.solve(SRGB, xyz)


def lab(v):
    """CIE 15:2004, by its inverse function of each of X, Y, Z."""
    f = np.array([(v[0] + 16) / 116 + v[1] / 500, (v[0] + 16) / 116, (v[0] + 16) / 116 - v[2] / 200])
    t = np.where(f > 6 / 29, f ** 3, 3 * (6 / 29) ** 2 * (f - 4 / 29))
    return of_xyz(TO_D65 @ (white(D50) * t))


def oklab(v):
    return OKLMS @ (OKLAB @ v) ** 3


def polar(v):
    return np.array([v[0], v[1] * math.cos(math.radians(v[2])), v[1] * math.sin(math.radians(v[2]))])


def hwb(v):
    w, b = v[1] / 100, v[2] / 100
    if w + b >= 1:
        return decode_srgb(np.full(3, w / (w + b)))
    r, g, blue = colorsys.hsv_to_rgb(v[0] / 360 % 1, 1, 1)
    return decode_srgb(np.array([r, g, blue]) * (1 - w - b) + w)


# Text with three places for numbers, the ranges of these, linear sRGB, and how near it is: matrices of
# the text have 16 digits, those of Oklab in Ottosson's words 10; ProPhoto's primaries have 6.
KINDS = [
    ("rgb({} {} {})", [(-100, 400)] * 3, lambda v: decode_srgb(v / 255), 1e-12),
    ("rgb({}% {}% {}%)", [(-50, 150)] * 3, lambda v: decode_srgb(v / 100), 1e-12),
    ("color(srgb {} {} {})", [(-1, 2)] * 3, decode_srgb, 1e-12),
    ("color(srgb-linear {} {} {})", [(-1, 2)] * 3, lambda v: v, 1e-12),
    ("color(display-p3 {} {} {})", [(-1, 2)] * 3, lambda v: of_xyz(P3 @ decode_srgb(v)), 1e-12),
    ("color(display-p3-linear {} {} {})", [(-1, 2)] * 3, lambda v: of_xyz(P3 @ v), 1e-12),
    ("color(a98-rgb {}% {}% {}%)", [(-100, 200)] * 3, lambda v: of_xyz(A98 @ decode_a98(v / 100)), 1e-12),
    ("color(rec2020 {} {} {})", [(-1, 2)] * 3, lambda v: of_xyz(REC2020 @ decode_2020(v)), 1e-12),
    ("color(prophoto-rgb {} {} {})", [(-0.1, 1.1)] * 3,
     lambda v: of_xyz(TO_D65 @ PROPHOTO @ decode_prophoto(v)), 2e-5),
    ("color(xyz {} {} {})", [(-1, 2)] * 3, of_xyz, 1e-12),
    ("color(xyz-d65 {} {} {})", [(-1, 2)] * 3, of_xyz, 1e-12),
    ("color(xyz-d50 {} {} {})", [(-1, 2)] * 3, lambda v: of_xyz(TO_D65 @ v), 1e-12),
    ("hsl({} {}% {}%)", [(-1, 361), (0, 100), (0, 100)],
     lambda v: decode_srgb(np.array(colorsys.hls_to_rgb(v[0] / 360 % 1, v[2] / 100, v[1] / 100))), 1e-12),
    ("hsl({}, {}%, {}%)", [(-720, 720), (0, 100), (0, 100)],
     lambda v: decode_srgb(np.array(colorsys.hls_to_rgb(v[0] / 360 % 1, v[2] / 100, v[1] / 100))), 1e-12),
    ("hwb({} {} {}%)", [(0, 360), (0, 80), (0, 80)], hwb, 1e-12),
    ("lab({} {} {})", [(0, 100), (-160, 160), (-160, 160)], lab, 1e-12),
    ("lab({}% {}% {}%)", [(0, 130), (-100, 100), (-100, 100)], lambda v: lab(v * [1, 1.25, 1.25]), 1e-12),
    ("lch({} {} {})", [(0, 100), (0, 230), (-10, 370)], lambda v: lab(polar(v)), 1e-12),
    ("lch({}% {}% {}deg)", [(0, 100)] * 2 + [(0, 360)], lambda v: lab(polar(v * [1, 1.5, 1])), 1e-12),
    ("oklab({} {} {})", [(0, 1.2), (-0.5, 0.5), (-0.5, 0.5)], oklab, 2e-6),
    ("oklab({}% {}% {}%)", [(0, 100), (-100, 100), (-100, 100)], lambda v: oklab(v * [0.01, 0.004, 0.004]), 2e-6),
    ("oklch({} {} {})", [(0, 1), (0, 0.5), (0, 360)], lambda v: oklab(polar(v)), 2e-6),
    ("oklch({}% {}% {})", [(0, 100), (0, 120), (0, 360)], lambda v: oklab(polar(v * [0.01, 0.004, 1])), 2e-6),
]


def read(texts):
    """(linear sRGB, alpha) of each text, and None for one that is wrong."""
    done = subprocess.run([os.path.join(BUILD, "tests", "css_colors")], input="".join(t + "\n" for t in texts),
                          text=True, capture_output=True, check=True)
    colors = []
    for line in done.stdout.splitlines():
        kind, *numbers = line.split(" ")
        if kind == "wrong":
            colors.append(None)
            continue
        rgb = np.array([float(n) for n in numbers[:3]])
        colors.append((decode_srgb(rgb) if kind == "encoded" else rgb, float(numbers[3])))
    assert len(colors) == len(texts)
    return colors


class Css(unittest.TestCase):
    def test_names_are_those_of_pillow(self):
        self.assertEqual(len(ImageColor.colormap), 148)
        names = sorted(ImageColor.colormap)
        for name, color in zip(names, read(names)):
            wanted = np.array(ImageColor.getrgb(name)) / 255
            self.assertIsNotNone(color, name)
            np.testing.assert_allclose(color[0], decode_srgb(wanted), rtol=0, atol=1e-15, err_msg=name)
            self.assertEqual(color[1], 1)

    def test_functions_follow_their_definitions(self):
        r = random.Random(4)
        for form, ranges, definition, tolerance in KINDS:
            with self.subTest(form):
                values = [[round(r.uniform(*span), r.randrange(8)) for span in ranges] for _ in range(400)]
                # Ends of ranges, and what lies between a curve's pieces.
                values += [[span[k] for span in ranges] for k in (0, 1)] + [[0, 0, 0]]
                texts = [form.format(*[f"{n:.12f}" for n in v]) for v in values]
                for text, color, v in zip(texts, read(texts), values):
                    self.assertIsNotNone(color, text)
                    wanted = definition(np.array(v, dtype=float))
                    size = max(1, np.abs(wanted).max())
                    np.testing.assert_allclose(color[0], wanted, rtol=0, atol=tolerance * size, err_msg=text)

    def test_hexadecimal_digits(self):
        r = random.Random(5)
        texts = ["#" + "".join(r.choice("0123456789abcdefABCDEF") for _ in range(n)) for n in (3, 4, 6, 8) * 50]
        for text, (rgb, alpha) in zip(texts, read(texts)):
            wanted = ImageColor.getrgb(text)
            np.testing.assert_allclose(rgb, decode_srgb(np.array(wanted[:3]) / 255), rtol=0, atol=1e-15)
            self.assertEqual(alpha, (wanted[3] if len(wanted) > 3 else 255) / 255)


if __name__ == "__main__":
    unittest.main()
