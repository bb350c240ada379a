"""Chromium beside us: which texts are colors of CSS, and what colors they are."""

import html
import itertools
import json
import os
import random
import re
import shutil
import subprocess
import tempfile
import unittest

import numpy as np
from PIL import ImageColor

from reference import color, program

PAGE = """<pre></pre><p></p><script>
const texts = %s, style = document.querySelector('p').style;
const computed = () => getComputedStyle(document.querySelector('p')).color;
document.querySelector('pre').textContent = JSON.stringify(texts.map(text => {
    style.color = '';
    style.color = text;
    if (!style.color) return null;
    const plain = computed();
    style.color = `color(from ${text} srgb-linear r g b / alpha)`;
    return [plain, computed()];
}));
</script>"""


def chromium(texts):
    """For each text None, or what Chromium computes: the color, and the color in linear sRGB."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "page.html")
        with open(path, "w", encoding="utf-8") as file:
            file.write(PAGE % json.dumps(texts).replace("<", "\\u003c"))
        run = subprocess.run(["chromium", "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={folder}/user",
                              "--virtual-time-budget=10000", "--dump-dom", f"file://{path}"],
                             capture_output=True, text=True, timeout=500, check=False)
    found = re.search(r"<pre>(.*?)</pre>", run.stdout, re.DOTALL)
    if not found or not found.group(1):
        raise AssertionError(run.stdout[-300:] + run.stderr[-300:])
    return json.loads(html.unescape(found.group(1)))


def ours(texts):
    done = subprocess.run([os.path.join(program.BUILD, "tests", "css_colors")], input="".join(t + "\n" for t in texts),
                          text=True, capture_output=True, check=True)
    return [line.split(" ") for line in done.stdout.splitlines()]


def numbers(text):
    """Of "color(srgb-linear R G B / A)"."""
    return [float(n) for n in re.findall(r"(?<![\w.])-?[\d.]+(?:e-?\d+)?", text.partition("srgb-linear")[2])]


def some_colors():
    r = random.Random(9)
    spans = {"lab": [(0, 100), (-120, 120), (-120, 120)], "lch": [(0, 100), (0, 150), (0, 360)],
             "oklab": [(0, 1), (-0.4, 0.4), (-0.4, 0.4)], "oklch": [(0, 1), (0, 0.4), (0, 360)]}
    for space in ("srgb", "srgb-linear", "display-p3", "display-p3-linear", "a98-rgb", "prophoto-rgb", "xyz", "xyz-d50",
                  "xyz-d65"):  # Chromium 156 decodes rec2020 as a camera's signal, as the text did until 2025
        spans["color(" + space] = [(-0.2, 1.3)] * 3
    for name, span in spans.items():
        for _ in range(20):
            values = " ".join(f"{r.uniform(*s):.5f}" for s in span)
            yield f"{name}{' ' if name.startswith('color') else '('}{values})"
    yield from ImageColor.colormap
    for _ in range(40):
        yield f"rgb({r.randrange(256)} {r.randrange(256)} {r.randrange(256)} / {r.randrange(101)}%)"
        yield f"hsl({r.randrange(-400, 800)} {r.randrange(101)}% {r.randrange(101)}%)"
        yield f"hwb({r.randrange(-400, 800)} {r.randrange(101)}% {r.randrange(101)}%)"


PIECES = ["0", "1", "50%", "-2", "+.5", "1e1", "1.", ".5.5", "none", "20deg", "0.1turn", "3px", ",", ",", "/", "/", " ", " ",
          "/**/", "(", ")", "x", "1%2%", "1-1", "#", "\\t"]
NAMES = ["rgb", "rgba", "hsl", "hsla", "hwb", "lab", "lch", "oklab", "oklch", "RGB"]
SPACES = ["srgb", "srgb-linear", "display-p3", "rec2020", "xyz", "XYZ-D50", "rgb", ""]


def some_texts():
    """Texts that are nearly colors, half of them for the worse."""
    r = random.Random(10)
    good = ["1", "50%", "-2", "+.5", "1e1", "none", "20deg", "0"]
    for name in NAMES + [f"color({space}" for space in SPACES]:
        begin = name + (" " if "(" in name else "(")
        for between, behind in itertools.product((" ", ",", " , ", "/"), ("/", ",", " / ", " ")):
            for count in (2, 3, 4):
                for _ in range(8):
                    values = [r.choice(good) for _ in range(count)]
                    yield begin + between.join(values) + r.choice(["", behind + r.choice(["0.5", "20%", "none", "1deg"])]) + ")"
        for _ in range(60):
            yield begin + "".join(r.choice(PIECES) for _ in range(r.randrange(9))) + ")"
    for _ in range(150):
        yield "#" + "".join(r.choice("0123456789abcdefABCDEFg") for _ in range(r.randrange(10)))
    yield from (" red", "red ", "RED", "re d", "red/**/", "/**/red", "reds", "-red", "transparent", "Transparent", "#fff ",
                "# fff", "rgb (1 2 3)", "rgb(1 2 3)x", "rgb( 1 2 3 )", "red;", "red!important")


# What CSS holds in its range, and we refuse with these words: see src/scene/css.h.
STRICTER = re.compile(r"alpha is from 0 to 1|(chroma|saturation) is negative")


@unittest.skipUnless(shutil.which("chromium"), "chromium is not installed")
class Browser(unittest.TestCase):
    def test_colors_are_those_of_chromium(self):
        """Chromium's matrices have few digits: its white is (0.9997, 1.0001, 1.0002). Colors of these spaces
        reach 4, and what is sRGB all the way is 1e-5 off."""
        texts = list(some_colors())
        for text, theirs, (kind, *values) in zip(texts, chromium(texts), ours(texts)):
            with self.subTest(text):
                self.assertIsNotNone(theirs)
                rgb = np.array([float(v) for v in values[:3]])
                rgb = color.srgb_decode(rgb) if kind == "encoded" else rgb
                wanted = numbers(theirs[1])
                srgb = theirs[0].startswith(("rgb", "color(srgb"))
                np.testing.assert_allclose(rgb, wanted[:3], rtol=0, atol=1e-5 if srgb else 8e-4)
                self.assertAlmostEqual(float(values[3]), wanted[3] if len(wanted) > 3 else 1, delta=1e-5)

    def test_the_same_texts_are_colors(self):
        texts = sorted(set(some_texts()))
        taken, stricter = 0, 0
        for text, theirs, answer in zip(texts, chromium(texts), ours(texts)):
            with self.subTest(text):
                us = answer[0] != "wrong"
                taken += us
                if theirs is not None and not us:
                    self.assertRegex(" ".join(answer), STRICTER)
                    stricter += 1
                else:
                    self.assertEqual(us, theirs is not None, (answer, theirs))
        self.assertGreater(taken, 300)
        self.assertGreater(len(texts) - taken, 300)
        self.assertLess(stricter, 20)


if __name__ == "__main__":
    unittest.main()
